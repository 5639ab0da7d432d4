"""Which rows to fit and which to hold out."""

import itertools
from typing import NamedTuple

import numpy as np

from jaxmotor.recording import Recording

SHARE = 3
"""Every third part of a kind is held out."""
SHORTEST = 60
"""Rows that a part of a cut segment has at least."""


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
        by_kind.setdefault(segment.kind, []).extend(_parts(index, len(segment), longest))
    held_out = [part for same in by_kind.values() for part in same[SHARE - 1 :: SHARE]]
    return tuple(sorted(held_out, key=lambda part: part.segment))


def _parts(index: int, rows: int, longest: int) -> list[Part]:
    if rows < SHARE * SHORTEST or rows <= longest:
        return [Part(index, range(rows))]
    edges = np.linspace(0, rows, SHARE + 1).astype(int).tolist()
    return [Part(index, range(begin, end)) for begin, end in itertools.pairwise(edges)]
