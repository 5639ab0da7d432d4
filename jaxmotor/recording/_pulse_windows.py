"""Speeds from the time between two pulses: means over a time that is the longer, the slower the shaft.

A program that notes when the pulses of a sensor came, N in a turn, prints y = Δ/T with Δ = 2π/N, T the time between the
last two. They came before the row: with rows r apart, the last one T/2 before it on average if several come in a row,
r/2 if at most one does. A mean over T + min(T, r) that ends at the row is as late.
"""

from collections.abc import Iterable

import numpy as np
from jaxtyping import Bool, Float

from jaxmotor.recording._recording import Recording, RecordingError, Segment

FEWEST = 10
"""New readings of a turning shaft that show where speeds come from."""
STEADY = 0.4
"""Scatter of the angle between two, over that of the speeds and of the times, up to which it is always the same."""
MOST = 1e5
"""Pulses per turn that a program times one by one."""
OPPOSED = -0.9
"""Correlation of the logarithms of speeds and times, which is -1 where the angle between two is the same."""


def pulse_windows(segment: Segment, pulses_per_rev: float) -> tuple[Float[np.ndarray, " n"], Bool[np.ndarray, " n"]]:
    """(n,) over how long before its row each speed of `segment` is a mean [s], and whether a pulse came since the row
    before: else the last speed is printed again, or none after a while without pulses."""
    assert segment.speed_rad_s is not None
    size, time = np.abs(segment.speed_rad_s), segment.time_s
    row_s = np.diff(time, prepend=time[:1])
    row_s[0] = row_s[1] if len(row_s) > 1 else 1.0
    with np.errstate(divide="ignore", over="ignore"):
        apart_s = 2 * np.pi / pulses_per_rev / size
    fresh = np.isfinite(apart_s) & ((np.diff(size, prepend=size[:1]) != 0) | (apart_s < row_s))
    return np.where(fresh, apart_s + np.minimum(apart_s, row_s), row_s), fresh


def usual_window_s(segments: Iterable[Segment], pulses_per_rev: float) -> float | None:
    """The median of the windows [s]; None where there is none."""
    known = [window[fresh] for window, fresh in (pulse_windows(one, pulses_per_rev) for one in segments)]
    every = np.concatenate([np.zeros(0), *known])
    return float(np.median(every)) if len(every) else None


def seen_pulses_per_rev(segments: Iterable[Segment]) -> float | None:
    """Pulses per turn, where speeds are seen to be from the time between two: each new one, times the time since the
    one before it, is the same angle. None where they are not, or where speeds or times hardly differ."""
    parts = [_new_readings(segment) for segment in segments]
    apart, size = (np.log(np.concatenate([np.zeros(0), *column])) for column in zip(*parts, strict=True))
    if len(apart) < FEWEST or min(np.std(apart), np.std(size)) == 0:
        return None
    angle = apart + size
    steady = _scatter(angle) < STEADY * min(_scatter(apart), _scatter(size))
    opposed = float(np.corrcoef(apart, size)[0, 1]) < OPPOSED
    if not (steady and opposed and np.log(2 * np.pi / MOST) < np.median(angle) < np.log(2 * np.pi)):
        return None
    return 2 * np.pi / float(np.exp(np.median(angle)))


def _new_readings(segment: Segment) -> tuple[np.ndarray, np.ndarray]:
    """(m,) time since the reading before [s] and size [rad/s], of new readings while the shaft turns."""
    assert segment.speed_rad_s is not None
    size, time_s = np.abs(segment.speed_rad_s[segment.read]), segment.time_s[segment.read]
    new = np.flatnonzero(np.diff(size, prepend=size[:1]) != 0)
    turns = (size[new][1:] > 0) & (size[new][:-1] > 0)
    return np.diff(time_s[new])[turns], size[new][1:][turns]


def _scatter(column: np.ndarray) -> float:
    """Median distance from the median."""
    return float(np.median(np.abs(column - np.median(column))))


def check_pulses(recording: Recording) -> None:
    """**Raises:** `RecordingError` where speeds are from pulses, and nobody knows over how long."""
    if recording.speed_pulses_per_rev is None:
        return
    if recording.speed_window_rows is not None or not recording.speed_window_s:
        raise RecordingError(
            f"{recording.source}: speed_pulses_per_rev needs speed_window_s, over how long speeds usually are, and no "
            "speed_window_rows"
        )
