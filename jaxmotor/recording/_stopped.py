"""A shaft that stood still although it was driven: a dead sensor, a stall, a stop."""

import numpy as np

from jaxmotor.recording._direction import SLOWEST_RAD_S
from jaxmotor.recording._recording import Recording, Segment

LONG_ROWS, LONG_S = 50, 0.5
"""Rows without any motion, at least, and how long they last [s]: less is a motor that has not broken away yet."""
DRIVEN, AMONG = 0.1, 0.75
"""Part of these rows in which the input is larger than in that part of the rows with an input in which the shaft
moves."""


def warn_stopped(recording: Recording) -> list[str]:
    """The longest stretch in which the shaft does not move at all, driven as where it moves."""
    found = _stretches(recording)
    if not found:
        return []
    index, start, stop = max(found, key=lambda one: one[2] - one[1])
    segment = recording.segments[index]
    first_s, last_s = (
        segment.start_s + segment.time_s[row] - recording.segments[0].start_s for row in (start, max(start - 1, 0))
    )
    lasts_s = segment.time_s[stop - 1] - segment.time_s[start]
    is_end = index == len(recording.segments) - 1 and stop == len(segment)
    what = f" (jaxmotor import: --end {last_s:.7g})" if is_end else ""
    if index == 0 and start == 0 and not is_end:
        what = f" (jaxmotor import: --begin {first_s + segment.time_s[stop] - segment.time_s[start]:.7g})"
    others = f", and {len(found) - 1} times more" if len(found) > 1 else ""
    return [
        f"the shaft does not move at all for {lasts_s:.3g} s from {first_s:.4g} s on{others}, driven as where it "
        f"moves: the motor or its sensor had stopped; leave these rows out{what}"
    ]


def _stretches(recording: Recording) -> list[tuple[int, int, int]]:
    """Segment, and first and last row, of what `warn_stopped` tells."""
    moving = [_moves(recording, segment) for segment in recording.segments]
    sizes = [np.abs(segment.volts) for segment in recording.segments]
    moved = np.concatenate([size[move & (size > 0)] for size, move in zip(sizes, moving, strict=True)])
    if not moved.size:
        return []
    large_V = np.quantile(moved, AMONG)
    found = []
    for index, (segment, move, size) in enumerate(zip(recording.segments, moving, sizes, strict=True)):
        edges = np.flatnonzero(np.diff((~move).astype(int), prepend=0, append=0)).reshape(-1, 2)
        found += [
            (index, start, stop)
            for start, stop in edges.tolist()
            if stop - start >= LONG_ROWS
            and segment.time_s[stop - 1] - segment.time_s[start] >= LONG_S
            and (size[start:stop] >= large_V).mean() >= DRIVEN
        ]
    return found


def _moves(recording: Recording, segment: Segment) -> np.ndarray:
    """(n,) whether the shaft moves in each row; without a reading it may."""
    shaft = np.asarray(segment.shaft, float)
    moves = np.ones(len(shaft), bool)
    read = np.flatnonzero(segment.read)
    if recording.measured == "speed":
        moves[read] = np.abs(shaft[read]) > SLOWEST_RAD_S
    else:
        step = np.diff(shaft[read]) != 0
        moves[read] = np.append(step, False) | np.append(False, step)
    return moves
