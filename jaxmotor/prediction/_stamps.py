"""Whether the time stamps of a log of counts bring more error than its counts. Numpy only.

A stamp in whole milliseconds is up to one off. A shaft that turns at w turns w times that in the meantime, and a
difference of two readings has the variance (r w)²/6 from stamps of resolution r, beside the rounding's. Logs that were
made to the millisecond have the same stamps, and no such error: so the best flexible model must leave that much.

A program that is interrupted between reading and stamping is off by a random time, of standard deviation s. Each count
then has the error w s of its own, which one turn gains and the next one loses: turns k and k+1 have the covariance
-(w s)² - 1/12, in counts. What a model does not explain of the motion is much alike from row to row instead: of it the
covariance of turns k and k+2 tells, which readings leave at zero.
"""

import dataclasses

import numpy as np

from jaxmotor.prediction._flexible_model import flexible_model
from jaxmotor.prediction._packing import log_rows
from jaxmotor.recording import Recording

RESOLUTIONS_S = (0.01, 0.001)
"""Of stamps that are printed: hundredths and thousandths of a second."""
LEFT = 0.9
"""Part of the expected error that the flexible model must leave."""

ENOUGH = 6000
"""Rows from which the spread of readings about their stamps is known well enough."""
FEWEST = 200
"""Pairs of turns that tell it."""


def coarse_stamps(recording: Recording, segments: tuple[int, ...]) -> float | None:
    """Resolution [s] of the stamps of the `segments` (indices) of `recording`, where these make most of the error of
    its counts; else None."""
    if recording.measured != "count" or recording.period_s is not None:
        return None
    steps = np.concatenate([np.diff(recording.segments[index].time_s) for index in segments])
    whole = [each for each in RESOLUTIONS_S if np.abs(steps / each - np.rint(steps / each)).max(initial=0.0) < 1e-3]
    if not whole or not len(steps):
        return None
    rows = log_rows(recording, segments)
    if not rows.valid.any():
        return None
    rounding = recording.count_rad / np.sqrt(6)
    stamps = whole[0] * recording.count_rad * float(np.sqrt(np.mean(rows.speed[rows.valid] ** 2))) / np.sqrt(6)
    if stamps < rounding:
        return None
    left = flexible_model(rows).level * rows.typical_s * recording.count_rad
    return whole[0] if left > LEFT * np.hypot(rounding, stamps) else None


def late_readings(recording: Recording, segments: tuple[int, ...]) -> float | None:
    """Standard deviation [s] of the time between stamps and readings of the `segments` (indices) of `recording`, where
    it makes more error of its counts than rounding; else None."""
    if recording.measured != "count" or recording.period_s is not None:
        return None
    rows = log_rows(recording, segments)
    rows = rows.first(min(ENOUGH, len(rows.volts)))
    known = rows.counts & (np.abs(rows.speed) > 0)
    if known.sum() < FEWEST:
        return None
    turn = flexible_model(rows).residual * rows.duration
    once, twice = (_covariance(turn, known, rows.piece, lag) for lag in (1, 2))
    square = float(np.mean(rows.speed[known] ** 2))
    excess = twice - once - 1 / 12
    return float(np.sqrt(excess / square)) if excess > 1 / 12 else None


def _covariance(values: np.ndarray, known: np.ndarray, piece: np.ndarray, lag: int) -> float:
    """Of `values` (n,) that are `known` in one piece with those `lag` rows on; 0 where they are too few."""
    both = known[:-lag] & known[lag:] & (piece[:-lag] == piece[lag:])
    return float(np.mean((values[:-lag] * values[lag:])[both])) if both.sum() >= FEWEST else 0.0


def as_angles(recording: Recording) -> Recording:
    """`recording` of counts as one of angles, whose error is estimated."""
    segments = [
        dataclasses.replace(segment, count=None, angle_rad=segment.count * recording.count_rad)
        for segment in recording.segments
        if segment.count is not None
    ]
    return dataclasses.replace(recording, segments=tuple(segments))
