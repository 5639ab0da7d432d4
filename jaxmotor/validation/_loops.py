"""Motors, encoders and the controller of a header in closed loops, against the run on the motor itself."""

import dataclasses

import numpy as np

from jaxmotor.motor import Motor, SpeedLoop
from jaxmotor.prediction import Conditions, Sensors, each, shaft_angles, simulate_loops, steps_per_row, supply_of
from jaxmotor.recording import Recording
from jaxmotor.validation._controller import Controller, Logged, agreeing_ticks, compare_with_log, on_ticks
from jaxmotor.validation._response import Response, measure_runs
from jaxmotor.validation._validation import Band, Comparison, Interval, LoopRun

FEWEST = 20
"""Ticks of a run that says something."""


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
    period, angles = recording.period_s, shaft_angles(recording)
    assert period is not None
    instantaneous = recording.measured == "speed" and recording.speed_window_s == 0.0
    count_rad = np.where(ideal, 0.0, recording.count_rad if recording.counts_per_rev else 0.0)
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
) -> LoopRun | None:
    """The `closed_loop` segment `index` of `recording`, from rest, run by `controller` on each of a batch of `motors`.

    The first of them is the fitted one, whose speed without rounding is the band's mean; the others are draws from its
    covariance. A run is taken up to where the header's controller is no more the one that ran; None where that is at
    once.
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
    ideal, time = runs["exact"][:1], np.arange(number) * recording.period_s
    run, _ = compared(index, controller, time, logged, np.concatenate([ideal, runs["seen"]]), 0.0)
    return dataclasses.replace(run, speed=dataclasses.replace(run.speed, mean=ideal[0]))


def compared(
    index: int, controller: Controller, time: np.ndarray, logged: Logged, runs: np.ndarray, initial: float
) -> tuple[LoopRun, Response]:
    """`runs` (run, n) of what the controller saw [rad/s], and the response of the first of them, which has no noise.

    The others are what it is taken from.
    """
    own, first, predicted = measure_runs(logged.speed, runs, time, initial)
    reference = controller.reference_rad_s
    run = LoopRun(
        segment=index,
        kind=controller.kind,
        reference_rad_s=reference,
        time_s=time,
        measured_speed_rad_s=np.where(logged.seen, logged.speed, np.nan),
        speed=Band.of(runs[1:]),
        rise_time_s=Comparison.of(own.rise_time[0], predicted.rise_time),
        overshoot_percent=Comparison.of(own.overshoot[0], predicted.overshoot),
        steady_speed_rad_s=Comparison.of(own.final[0], predicted.final),
        steady_error_rad_s=Comparison.of(reference - own.final[0], reference - predicted.final),
        rmse_rad_s=Interval.of(np.sqrt(np.mean((runs[1:] - logged.speed)[:, logged.seen] ** 2, axis=1))),
    )
    return run, first
