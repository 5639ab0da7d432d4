"""Which segments to fit and which to hold out."""

import dataclasses
import itertools

import numpy as np

from jaxmotor.recording import Recording, Segment

SHARE = 3
"""Every third segment of a kind is held out."""
SHORTEST = 60
"""Rows that a part of a cut segment has at least."""


def split(recording: Recording) -> tuple[Recording, tuple[int, ...]]:
    """The recording, its segments cut in three where there are fewer than three, and the segments to hold out.

    Every third segment of each kind; of fewer than three segments the last third of each. Rests are no segments.
    """
    moving = [index for index, segment in enumerate(recording.segments) if segment.kind != "rest"]
    if len(moving) < SHARE:
        recording = _cut(recording)
        moving = [index for index, segment in enumerate(recording.segments) if segment.kind != "rest"]
    held_out: list[int] = []
    for kind in {recording.segments[index].kind for index in moving}:
        held_out += [index for index in moving if recording.segments[index].kind == kind][SHARE - 1 :: SHARE]
    return recording, tuple(sorted(held_out))


def _cut(recording: Recording) -> Recording:
    segments = [part for segment in recording.segments for part in _parts(segment)]
    return dataclasses.replace(recording, segments=tuple(segments))


def _parts(segment: Segment) -> list[Segment]:
    if segment.kind == "rest" or len(segment) < SHARE * SHORTEST:
        return [segment]
    edges = np.linspace(0, len(segment), SHARE + 1).astype(int).tolist()
    return [_slice(segment, slice(begin, end)) for begin, end in itertools.pairwise(edges)]


def _slice(segment: Segment, rows: slice) -> Segment:
    optional = ("duty", "count", "angle_rad", "speed_rad_s", "supply_V", "current_A")
    columns = {name: getattr(segment, name) for name in optional}
    begin = float(segment.time_s[rows][0])
    return dataclasses.replace(
        segment,
        start_s=segment.start_s + begin,
        at_rest=segment.at_rest and rows.start == 0,
        time_s=segment.time_s[rows] - begin,
        volts=segment.volts[rows],
        tick=None if segment.tick is None else segment.tick[rows] - segment.tick[rows][0],
        extra={},
        **{name: None if column is None else column[rows] for name, column in columns.items()},
    )
