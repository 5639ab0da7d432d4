"""What a loop will do before it is run: simulated with motors as likely as the model's standard errors say.

Each run draws gain, pole (and L/R) from the model's covariance, each effect's parameters from their standard errors,
and where within a count the encoder begins. Limits hold 95 of 100 runs.
"""

import dataclasses
import math

import jax
import numpy as np

from jaxmotor._errors import JaxmotorError
from jaxmotor._precision import in_float64
from jaxmotor.control._hardware import Hardware
from jaxmotor.control._loops import CountedPositionLoop, CountedSpeedLoop
from jaxmotor.control._run import run_on
from jaxmotor.estimate import Model
from jaxmotor.validation import Band, Interval, draw_motors, limits

Loop = CountedSpeedLoop | CountedPositionLoop
RUNS = 128
"""Of which bands are made, unless told."""
LEAST_RUNS = 40
"""Fewer give no 95 % band."""
TAIL = 0.25
"""Share of the ticks at the end that the steady state is the mean of."""


@dataclasses.dataclass(frozen=True, eq=False)
class Prediction:
    """A step of the reference from rest, predicted."""

    time_s: np.ndarray
    """(n,) of the ticks [s]."""
    shown: Band
    """(n,) what the counts show at each tick: mean speed over the tick before [rad/s], or angle [rad]."""
    volts: Band
    """(n,) [V]"""
    overshoot_percent: Interval
    """Of `measure_step`: above the reference, of it."""
    steady_error: Interval
    """Reference minus the mean over the last quarter [rad/s or rad]."""
    saturated_percent: Interval
    """Share of ticks at full duty."""


def predict_step(
    model: Model,
    loop: Loop,
    hardware: Hardware,
    reference: float,
    *,
    seconds: float = 1.0,
    runs: int = RUNS,
    seed: int = 0,
) -> Prediction:
    """`loop` on `model` from rest, asked for `reference` [rad/s, or rad for a position loop] for `seconds`.

    **Raises:** `JaxmotorError` where the reference is zero or there are too few runs or ticks for a band.
    """
    ticks = round(seconds / hardware.period_s)
    if not (math.isfinite(reference) and reference != 0) or ticks < 8 or runs < LEAST_RUNS:
        raise JaxmotorError(
            f"a step to {reference:g} over {ticks} ticks in {runs} runs gives no prediction; the reference is not 0, "
            f"there are 8 ticks at least and {LEAST_RUNS} runs"
        )
    counts, volts = run_loop(model, loop, hardware, reference, ticks, runs, seed)
    angles = isinstance(loop, CountedPositionLoop)
    shown = counts * hardware.count_rad if angles else np.diff(counts, prepend=0.0) / hardware.counts_per_tick
    measured = np.array([measure_step(one, reference) for one in shown])
    # Counts are whole, so what is measured comes in steps.
    one_count = hardware.count_rad if angles else 1 / hardware.counts_per_tick
    steady = reference - float(np.median(measured[:, 1])) or math.nan
    saturated = 100 * (np.abs(volts) >= hardware.supply_V - 0.5 * hardware.step_V).mean(axis=1)
    return Prediction(
        np.arange(ticks) * hardware.period_s,
        Band.of(shown),
        Band.of(volts),
        _interval(measured[:, 0], 100 * one_count / 3 / abs(steady)),
        _interval(measured[:, 1], one_count if angles else one_count / max(1, int(TAIL * ticks))),
        _interval(saturated),
    )


def measure_step(shown: np.ndarray, reference: float) -> tuple[float, float]:
    """(overshoot [% of the steady state], reference minus steady state) of what the counts `shown` (n,) from rest.

    The steady state is the mean of the last quarter, and the overshoot that of a mean over three ticks, since the
    largest of many rounded speeds is not the overshoot. NaN where the motor stays at rest.
    """
    steady = float(shown[-max(1, int(TAIL * len(shown))) :].mean())
    smooth = np.convolve(shown, np.ones(3) / 3, mode="valid")
    over = max(0.0, 100 * float((smooth / steady).max() - 1)) if steady else math.nan
    return over, reference - steady


@in_float64
def run_loop(
    model: Model, loop: Loop, hardware: Hardware, reference: float, ticks: int, runs: int, seed: int
) -> tuple[np.ndarray, np.ndarray]:
    """(runs, ticks) count at each tick, and voltage [V], of `loop` on `model` first and then on draws of it.

    They start from rest, at a constant `reference`.
    """
    key, start = jax.random.split(jax.random.key(seed))
    reading = np.asarray(jax.random.uniform(start, (runs,)).at[0].set(0.5))
    return run_on(hardware, draw_motors(model, runs, key), loop, np.full(ticks, reference), reading)


def _interval(values: np.ndarray, step: float = 0.0) -> Interval:
    """Mean and limits; what is measured in steps of `step` has limits rounded outwards by half of one."""
    low, high = limits(values)
    return Interval(float(values.mean()), float(low) - step / 2, float(high) + step / 2)
