"""What a loop will do before it is run: simulated with motors as likely as the model's standard errors say.

Each run draws gain, pole (and L/R) from the model's covariance, each effect's parameters from their standard errors,
and where within a count the encoder begins. Limits hold 95 of 100 runs.
"""

import dataclasses
import math
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from jaxmotor._errors import JaxmotorError
from jaxmotor._precision import in_float64, to_jax
from jaxmotor.control._hardware import Hardware
from jaxmotor.control._loops import CountedPositionLoop, CountedSpeedLoop
from jaxmotor.estimate import Model
from jaxmotor.motor import Begin, Motor, Rows, simulate_motor, steps_for
from jaxmotor.motor.effects import TransportDelay
from jaxmotor.validation import Band, Interval, draw_motors, limits

Loop = CountedSpeedLoop | CountedPositionLoop
RUNS = 128
LEAST_RUNS = 40
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
    run = run_loop(model, loop, hardware, reference, ticks, runs, seed)
    shown = run.shown(hardware, isinstance(loop, CountedPositionLoop))
    measured = np.array([measure_step(one, reference) for one in shown])
    # Counts are whole, so what is measured comes in steps.
    angles = isinstance(loop, CountedPositionLoop)
    one_count = hardware.count_rad if angles else 1 / hardware.counts_per_tick
    steady = reference - float(np.median(measured[:, 1])) or math.nan
    saturated = 100 * (np.abs(run.volts) >= hardware.supply_V - 0.5 * hardware.step_V).mean(axis=1)
    return Prediction(
        np.arange(ticks) * hardware.period_s,
        Band.of(shown),
        Band.of(run.volts),
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


class Runs(NamedTuple):
    """Simulated runs (m, n) side by side; the first is the model itself."""

    turn: np.ndarray
    """From each tick to the next, as the encoder sees it before rounding [rad]."""
    volts: np.ndarray
    """Asked for at each tick [V]."""
    begins: np.ndarray
    """(m,) where within a count each begins."""

    def shown(self, hardware: Hardware, angles: bool) -> np.ndarray:
        """(m, n) mean speed over the tick before each tick [rad/s] as the counts have it, or the angle [rad]."""
        exact = self.begins[:, None] + self.turn.cumsum(axis=1) / hardware.count_rad
        counts = np.floor(np.concatenate([self.begins[:, None], exact[:, :-1]], axis=1))
        if angles:
            return (counts - counts[:, :1]) * hardware.count_rad
        return np.diff(counts, axis=1, prepend=counts[:, :1]) / hardware.counts_per_tick


@in_float64
def run_loop(model: Model, loop: Loop, hardware: Hardware, reference: float, ticks: int, runs: int, seed: int) -> Runs:
    """`runs` runs of `loop` on motors as `model` allows, for `ticks` ticks from rest at a constant `reference`."""
    size = -(-ticks // 64) * 64  # whole blocks, so that few shapes are compiled
    key, start = jax.random.split(jax.random.key(seed))
    motors = draw_motors(model, runs, key)
    begins = jax.random.uniform(start, (runs,)).at[0].set(0.5)
    steps = jnp.asarray(steps_for(hardware.period_s, float(model.motor.pole)), jnp.int32)
    values = (hardware.count_rad, hardware.period_s, hardware.supply_V, reference)
    count, period, supply, asked = (jnp.asarray(number) for number in values)
    late = jnp.asarray(hardware.delay_s) if hardware.delay_s else None
    turn, volts = _run(motors, to_jax(loop), begins, count, late, jnp.zeros(size), period, supply, asked, steps)
    return Runs(np.asarray(turn)[:, :ticks], np.asarray(volts)[:, :ticks], np.asarray(begins))


@eqx.filter_jit
def _run(
    motors: Motor,
    loop: Loop,
    begins: Float[Array, " m"],
    count_rad: Float[Array, ""],
    late: Float[Array, ""] | None,
    zeros: Float[Array, " n"],
    period: Float[Array, ""],
    supply: Float[Array, ""],
    reference: Float[Array, ""],
    steps: Int[Array, ""],
) -> tuple[Float[Array, "m n"], Float[Array, "m n"]]:
    first = jnp.zeros(zeros.shape, bool).at[0].set(True)
    time = jnp.arange(zeros.shape[0], dtype=zeros.dtype) * period
    rows = Rows(zeros + reference, first, zeros, time)

    def one(motor: Motor, begin: Float[Array, ""]) -> tuple[Float[Array, " n"], Float[Array, " n"]]:
        effects = motor.effects if late is None else (*motor.effects, TransportDelay(late))
        motor = Motor(motor.linear, effects, motor.viscous_share)
        place = Begin(jnp.zeros_like(begin), begin)
        run = simulate_motor(motor, rows, period, supply, steps, loop, count_rad, begin=place)
        return run.seen_turn, run.volts

    return jax.vmap(one)(motors, begins)


def _interval(values: np.ndarray, step: float = 0.0) -> Interval:
    """Mean and limits; what is measured in steps of `step` has limits rounded outwards by half of one."""
    low, high = limits(values)
    return Interval(float(values.mean()), float(low) - step / 2, float(high) + step / 2)
