"""Motors, encoders and the controller of a header in closed loops, against the run on the motor itself."""

import dataclasses

import numpy as np

from jaxmotor.motor import Motor, SpeedLoop
from jaxmotor.prediction import Conditions, Sensors, each, shaft_angles, simulate_loops, steps_per_row, supply_of
from jaxmotor.recording import Recording
from jaxmotor.validation._controller import Controller, Logged, agreeing_ticks, compare_with_log, on_ticks
from jaxmotor.validation._response import measure_runs
from jaxmotor.validation._validation import Band, Comparison, Interval

FEWEST = 20
"""Ticks of a run that says something."""


@dataclasses.dataclass(frozen=True, eq=False)
class LoopOfMotors:
    """One closed-loop segment, and what draws from the covariance of the fitted motor do in its place."""

    segment: int
    kind: str
    """`P` or `PI`."""
    reference_rad_s: float
    time_s: np.ndarray
    measured_rad_s: np.ndarray
    """(n,) speed as the controller saw it; NaN where the tick was lost."""
    speed: Band
    """(n,) as the controller of the fitted motor would see it without rounding; the limits hold 95 % of the runs."""
    rise_time_s: Comparison
    overshoot_percent: Comparison
    steady_error_rad_s: Comparison
    rmse_rad_s: Interval
    """Of a run's speed from the measured one."""


def run_loops(
    motors: Motor,
    recording: Recording,
    index: int,
    controller: Controller,
    now: float,
    ticks: int,
    *,
    reading: np.ndarray,
    ideal: np.ndarray,
    speed_rad_s: float = 0.0,
    warmth: float = 0.0,
) -> dict[str, np.ndarray]:
    """`simulate_loops` over `ticks` ticks of the segment `index`, with `controller` on each of a batch of `motors`.

    `now` is that of its law, `reading` (batch,) where in a count each encoder begins; where `ideal` (batch,) neither
    counts nor duties are rounded.
    """
    period, counts, angles = recording.period_s, recording.counts_per_rev, shaft_angles(recording)
    assert period is not None
    instantaneous = recording.measured == "speed" and recording.speed_window_s == 0.0
    count_rad = np.where(ideal, 0.0, 2 * np.pi / counts if counts else 0.0)
    law = each(controller.law(now), len(ideal))._replace(step_V=np.where(ideal, 0.0, controller.step_V))
    steps = steps_per_row(period, float(np.asarray(motors.linear.pole)[0]))
    angle = 0.0 if angles is None else float(angles[index][0])
    return simulate_loops(
        motors,
        SpeedLoop(law),
        Sensors(reading, count_rad, instantaneous & (count_rad == 0)),
        np.full(ticks, controller.reference_rad_s),
        Conditions(period, steps, supply_of(recording), speed_rad_s, angle, warmth),
    )


def loop_of_motors(
    motors: Motor, recording: Recording, index: int, controller: Controller, *, seed: int = 0
) -> LoopOfMotors | None:
    """The `closed_loop` segment `index` of `recording`, from rest, run by `controller` on each of a batch of `motors`.

    The first of them is the fitted one, the others are draws from its covariance. A run is taken up to where the
    header's controller is no more the one that ran; None where that is at once.
    """
    assert recording.period_s is not None
    logged = on_ticks(recording, recording.segments[index], 0.0)
    _, now = compare_with_log(controller, recording.period_s, logged)
    number = agreeing_ticks(controller, recording.period_s, logged, now)
    if number < FEWEST:
        return None
    size = len(np.asarray(motors.linear.pole))
    reading = np.random.default_rng(seed).random(size)
    exact = np.zeros(size, bool)
    runs = run_loops(motors, recording, index, controller, now, number, reading=reading, ideal=exact)
    logged = Logged(*(values[:number] for values in logged))
    return _compared(index, controller, recording.period_s, logged, runs["exact"][0], runs["seen"])


def _compared(
    index: int, controller: Controller, period: float, logged: Logged, ideal: np.ndarray, speed: np.ndarray
) -> LoopOfMotors:
    time = np.arange(len(ideal)) * period
    own, _, predicted = measure_runs(logged.speed, np.concatenate([ideal[None], speed]), time, 0.0)
    reference = controller.reference_rad_s

    return LoopOfMotors(
        segment=index,
        kind=controller.kind,
        reference_rad_s=reference,
        time_s=time,
        measured_rad_s=np.where(logged.seen, logged.speed, np.nan),
        speed=dataclasses.replace(Band.of(speed), mean=ideal),
        rise_time_s=Comparison.of(own.rise_time[0], predicted.rise_time),
        overshoot_percent=Comparison.of(own.overshoot[0], predicted.overshoot),
        steady_error_rad_s=Comparison.of(reference - own.final[0], reference - predicted.final),
        rmse_rad_s=Interval.of(np.sqrt(np.mean((speed - logged.speed)[:, logged.seen] ** 2, axis=1))),
    )
