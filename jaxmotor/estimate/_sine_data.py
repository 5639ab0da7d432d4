"""The sine segments of a recording as padded arrays, for the sine fits. Numpy only."""

from typing import Literal

import numpy as np

from jaxmotor.estimate._sine_fit import Sines
from jaxmotor.prediction import bucket, up_by_four
from jaxmotor.recording import Recording, Segment, at_duty

LEAST_SINES, LEAST_ROWS = 8, 512
"""The fewest where few shapes are asked for; more come by factors of four."""


def sine_segments(recording: Recording, segments: tuple[int, ...]) -> tuple[int, ...]:
    """Those of `segments` that are sines of a stated frequency, where ticks are even."""
    if recording.period_s is None:
        return ()
    return tuple(index for index in segments if recording.segments[index].sine_Hz is not None)


def sine_data(recording: Recording, segments: tuple[int, ...], few_shapes: bool = False) -> Sines:
    """The sine segments among `segments`; there must be one, and an even `period_s`.

    With `few_shapes` there are more rows, and after the last frequency some of 1 Hz without rows.
    """
    chosen = sine_segments(recording, segments)
    period = recording.period_s
    assert chosen and period is not None
    kind, window = _kind(recording)
    runs = [recording.segments[index] for index in chosen]
    unit = recording.count_rad if recording.measured == "count" else 1.0
    shape = (len(chosen), bucket(max(map(len, runs))))
    if few_shapes:
        shape = (up_by_four(LEAST_SINES, shape[0]), up_by_four(LEAST_ROWS, shape[1]))
    time = np.broadcast_to(np.arange(shape[1]) * period, shape).copy()
    volts, measured, valid = np.zeros(shape), np.zeros(shape), np.zeros(shape, bool)
    for row, run in enumerate(runs):
        tick = np.arange(len(run)) if run.tick is None else run.tick - run.tick[0]
        keep = tick < shape[1]
        cells = (row, tick[keep])
        volts[cells], measured[cells] = run.volts[keep], _measured(recording, run, unit)[keep]
        valid[cells] = run.read[keep]
    if kind == "mean_speed":
        valid[:, 0] = False
    frequency = np.ones(shape[0])
    frequency[: len(runs)] = [run.sine_Hz for run in runs]
    rows = (frequency, time, volts, measured, valid)
    return Sines(*rows, np.asarray(unit), np.asarray(period), kind, window, recording.measured == "count")


def _kind(recording: Recording) -> tuple[Literal["position", "mean_speed", "speed"], float]:
    if recording.measured != "speed":
        return "position", 0.0
    window, period = recording.speed_window_s or 0.0, recording.period_s or 0.0
    return ("mean_speed" if abs(window - period) < 1e-6 * period else "speed"), window


def _measured(recording: Recording, run: Segment, unit: float) -> np.ndarray:
    if run.count is not None:
        return at_duty(recording, (run.count - run.count[0]).astype(float), run.time_s)
    if run.angle_rad is not None:
        return at_duty(recording, (run.angle_rad - run.angle_rad[0]) / unit, run.time_s)
    assert run.speed_rad_s is not None
    return at_duty(recording, run.speed_rad_s / unit, run.time_s)
