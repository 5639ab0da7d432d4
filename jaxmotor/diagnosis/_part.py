"""A part of a long recording, which shows what the whole is to be asked for."""

import dataclasses
import math

import numpy as np

from jaxmotor.recording import Recording, Segment

ENOUGH = 10_000
"""Rows in which any effect shows that is not small, and of which a search takes seconds."""
LONG = 3
"""Times that number, from which a search of a part comes first: what it saves is more than it takes."""
PIECES = 6
"""Of such a part."""
LASTS = 20.0
"""Time constants of a piece at least: its first speed is not known."""


def part_of(recording: Recording, pole_rad_s: float) -> Recording | None:
    """About `ENOUGH` rows of `recording`, in pieces all through it; None where it is short, or these show no motion."""
    total = sum(map(len, recording.segments))
    if total < LONG * ENOUGH:
        return None
    row_s = float(np.median(np.concatenate([np.diff(segment.time_s) for segment in recording.segments])))
    rows = max(ENOUGH // PIECES, math.ceil(LASTS / max(LASTS / ENOUGH, pole_rad_s * row_s)))
    pieces = [piece for segment in recording.segments for piece in _pieces(segment, rows)]
    chosen = np.unique(np.linspace(0, len(pieces) - 1, max(round(len(pieces) * ENOUGH / total), 1)).astype(int))
    part = tuple(pieces[number] for number in chosen.tolist())
    moves = any(np.ptp(piece.shaft) > 0 and piece.volts.any() for piece in part)
    return dataclasses.replace(recording, segments=part) if moves else None


def _pieces(segment: Segment, rows: int) -> list[Segment]:
    edges = np.linspace(0, len(segment), max(round(len(segment) / rows), 1) + 1).astype(int)
    return [_piece(segment, slice(*edges[k : k + 2].tolist())) for k in range(len(edges) - 1)]


def _piece(segment: Segment, rows: slice) -> Segment:
    """The `rows` of `segment`, as one of their own."""
    columns = {name: value[rows] for name, value in vars(segment).items() if isinstance(value, np.ndarray)}
    begin = float(segment.time_s[rows.start])
    columns["time_s"] = columns["time_s"] - begin
    if segment.tick is not None:
        columns["tick"] = columns["tick"] - columns["tick"][0]
    return dataclasses.replace(
        segment,
        **columns,
        start_s=segment.start_s + begin,
        at_rest=segment.at_rest and rows.start == 0,
        extra={name: text[rows] for name, text in segment.extra.items()},
    )
