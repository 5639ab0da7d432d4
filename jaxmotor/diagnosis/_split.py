"""Which rows to fit and which to hold out."""

import itertools
from typing import NamedTuple

import numpy as np

from jaxmotor.recording import Recording, Segment

SHARE = 3
"""Every third part of a kind is held out."""
SHORTEST = 60
"""Rows that a part of a cut segment has at least; one of those that motion cuts a third of them."""


class Part(NamedTuple):
    """A segment of a recording, or rows of one."""

    segment: int
    rows: range


def split(recording: Recording) -> tuple[Part, ...]:
    """What to hold out: every third segment of each kind, where those of more than a third of all rows are cut in
    three; where that is none, of segments that are all cut. Rests are no segments.

    The motor runs through a segment that is cut as through any other: only its first speed has to be known.
    """
    moving = [index for index, segment in enumerate(recording.segments) if segment.kind != "rest"]
    rows = sum(len(recording.segments[index]) for index in moving)
    return _thirds(recording, moving, rows // SHARE + 1) or _thirds(recording, moving, 0)


def _thirds(recording: Recording, moving: list[int], longest: int) -> tuple[Part, ...]:
    """Every third part of each kind, segments longer than `longest` rows cut."""
    by_kind: dict[str, list[Part]] = {}
    for index in moving:
        segment = recording.segments[index]
        edges = _edges(segment, longest)
        parts = [Part(index, range(begin, end)) for begin, end in itertools.pairwise(edges)]
        by_kind.setdefault(segment.kind, []).extend(parts)
    held_out = [part for same in by_kind.values() for part in same[SHARE - 1 :: SHARE]]
    return tuple(sorted(held_out, key=lambda part: part.segment))


def _edges(segment: Segment, longest: int) -> list[int]:
    """Between which rows the parts of `segment` are: one, or three of as many rows; where one of these would show less
    than half of its share of the motion, three of as much motion."""
    rows = len(segment)
    if rows < SHARE * SHORTEST or rows <= longest:
        return [0, rows]
    even = np.linspace(0, rows, SHARE + 1).astype(int)
    moves = np.cumsum(_moves(segment))
    if 2 * SHARE * np.diff(moves[even[1:] - 1], prepend=0).min() >= moves[-1]:
        return even.tolist()
    inner = np.searchsorted(moves, moves[-1] * np.arange(1, SHARE) / SHARE, side="right")
    edges = np.concatenate([[0], inner, [rows]])
    return (edges if (np.diff(edges) >= SHORTEST // SHARE).all() else even).tolist()


def _moves(segment: Segment) -> np.ndarray:
    """(n,) whether the shaft turns at each row, by what was read there."""
    if segment.speed_rad_s is not None:
        return np.nan_to_num(segment.speed_rad_s) != 0
    read = segment.angle_rad if segment.count is None else segment.count
    assert read is not None
    return np.nan_to_num(np.diff(read, prepend=read[0])) != 0
