"""Whether the time stamps of a log of counts are coarser than its counts. Numpy only.

A stamp in whole milliseconds is up to one off. A shaft that turns at w turns w times that in the meantime, and a
difference of two readings has the variance (r w)²/6 from stamps of resolution r, beside the rounding's. Logs that were
made to the millisecond have the same stamps, and no such error: so the best flexible model must leave that much.
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


def as_angles(recording: Recording) -> Recording:
    """`recording` of counts as one of angles, whose error is estimated."""
    segments = [
        dataclasses.replace(segment, count=None, angle_rad=segment.count * recording.count_rad)
        for segment in recording.segments
        if segment.count is not None
    ]
    return dataclasses.replace(recording, segments=tuple(segments))
