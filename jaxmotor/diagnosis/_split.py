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
    """The recording, segments of more than a third of its rows cut in three, and the segments to hold out.

    Every third segment of each kind; where that is none, of segments that are all cut. Rests are no segments.
    """
    rows = sum(len(recording.segments[index]) for index in _moving(recording))
    parts = _cut(recording, rows // SHARE + 1)
    held_out = _thirds(parts)
    if not held_out:
        parts = _cut(recording, 0)
        held_out = _thirds(parts)
    return parts, held_out


def _moving(recording: Recording) -> list[int]:
    return [index for index, segment in enumerate(recording.segments) if segment.kind != "rest"]


def _thirds(recording: Recording) -> tuple[int, ...]:
    by_kind: dict[str, list[int]] = {}
    for index in _moving(recording):
        by_kind.setdefault(recording.segments[index].kind, []).append(index)
    return tuple(sorted(index for same in by_kind.values() for index in same[SHARE - 1 :: SHARE]))


def _cut(recording: Recording, longest: int) -> Recording:
    """`recording` with its segments longer than `longest` rows cut; itself where none is."""
    segments = [part for segment in recording.segments for part in _parts(segment, longest)]
    if len(segments) == len(recording.segments):
        return recording
    return dataclasses.replace(recording, segments=tuple(segments))


def _parts(segment: Segment, longest: int) -> list[Segment]:
    if segment.kind == "rest" or len(segment) < SHARE * SHORTEST or len(segment) <= longest:
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
