"""Speeds that a program takes over a fixed time, however long it was since the row before.

A loop that should take S divides what was counted since the row before by S. Where a row comes after T instead, its
speed is too high by T/S: the mean over that time is the speed S/T.
"""

import dataclasses
from collections.abc import Iterable

import numpy as np

from jaxmotor.recording._recording import Recording, Segment

STEADY = 0.2
"""Difference of the speeds before and after a row, over their mean, up to which the motor turns steadily there."""
FAST = 0.25
"""Of the speed that nine in ten rows stay below, from which its readings are exact enough."""
SLOPE, ERROR = 0.2, 0.1
"""By how much the slope of log speed over log time may be off from 1, and its standard error."""


def over_rows(recording: Recording, fixed_s: float) -> Recording:
    """`recording`, whose speeds were taken over `fixed_s` [s], with means over the time since the row before."""
    times = [_since_before(segment) for segment in recording.segments]
    steps = np.concatenate([time[1:] for time in times])
    usual_s = recording.period_s or (float(np.median(steps)) if len(steps) else fixed_s)
    segments = tuple(
        dataclasses.replace(segment, speed_rad_s=segment.shaft * np.append(fixed_s / usual_s, fixed_s / time[1:]))
        for segment, time in zip(recording.segments, times, strict=True)
    )
    rows = None if recording.period_s else 1
    return dataclasses.replace(recording, segments=segments, speed_window_rows=rows, speed_window_s=usual_s)


def seen_fixed_time_s(segments: Iterable[Segment]) -> float | None:
    """The usual time between rows [s], where speeds are seen to be in proportion to the time since the row before: the
    logarithm of the one over that of the other has the slope 1 while the motor turns steadily. None where they are
    not, or rows are too even to tell."""
    known = [segment for segment in segments if len(segment) > 5]
    if not known:
        return None
    usual_s = float(np.median(np.concatenate([_since_before(segment)[1:] for segment in known])))
    fast = FAST * float(np.quantile(np.abs(np.concatenate([segment.shaft for segment in known])), 0.9))
    late, higher = (
        np.concatenate(column) for column in zip(*(_beside(one, usual_s, fast) for one in known), strict=True)
    )
    square = float(late @ late)
    if len(late) < 3 or square == 0:
        return None
    slope = float(late @ higher) / square
    error = float(np.sqrt(np.sum((higher - slope * late) ** 2) / (len(late) - 1) / square))
    return usual_s if abs(slope - 1) < SLOPE and error < ERROR else None


def _since_before(segment: Segment) -> np.ndarray:
    """(n,) time since the row before [s], NaN of the first."""
    return np.diff(segment.time_s, prepend=np.nan)


def _beside(segment: Segment, usual_s: float, fast: float) -> tuple[np.ndarray, np.ndarray]:
    """Of rows at which the motor turns steadily and `fast` [rad/s], the logarithms of the time since the row before,
    over the `usual_s`, and of the speed, over that of rows two before and two after: the next one is often early."""
    speed, time = segment.shaft.astype(np.float64), _since_before(segment)
    before, own, after = speed[:-4], speed[2:-2], speed[4:]
    around = (before + after) / 2
    steady = (np.abs(after - before) < STEADY * np.abs(around)) & (np.abs(around) > fast) & (own * around > 0)
    return np.log(time[2:-2][steady] / usual_s), np.log(own[steady] / around[steady])
