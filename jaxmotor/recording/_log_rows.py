"""The rows of a foreign log that say something: each with its input, its shaft, or both."""

import numpy as np

from jaxmotor.recording._clock import Cut
from jaxmotor.recording._log_columns import Log
from jaxmotor.recording._log_input import input_of
from jaxmotor.recording._recording import RecordingError
from jaxmotor.recording._shaft import Shaft
from jaxmotor.recording._units import Input, Scale
from jaxmotor.recording._unread import are_far_apart, between

HOLDS = "; where an input acts until the next one, state --input-holds"
"""What else may be where no row has both."""


def read_log(
    cut: Cut,
    stated: Input,
    shaft: Shaft,
    scale: Scale,
    supply_V: float | None,
    measured: np.ndarray | None,
    acted_before: bool,
    holds: bool,
) -> tuple[Log, np.ndarray]:
    """The log without the rows whose input is missing, and without those at the ends of what is left whose shaft is;
    and where its segments begin and end."""
    table, bounds, _, (time_s, resolution_s) = cut
    no_input, no_shaft = table.missing(stated.column), table.missing(shaft.column(table.cells)[0])
    row = _rows_before(bounds) if acted_before else np.arange(len(table))
    row = _held(row, ~no_input, bounds, acted_before) if holds else row
    known, read = ~no_input[row], ~no_shaft
    whole = known & read
    if not whole.any():
        hint = "" if holds or no_input.all() or no_shaft.all() else HOLDS
        raise RecordingError(f"no row has both an input and a shaft; log both at the same moments{hint}")
    if not whole.all() and len(set(np.searchsorted(bounds, np.flatnonzero(whole), side="right"))) < len(bounds) - 1:
        raise RecordingError("a segment has no row with both an input and a shaft; leave it out of the log")
    given = input_of(table.only(~no_input), stated, supply_V, measured is not None)
    [(name, values)] = shaft.read(table.only(read), scale).items()
    kept = between(known, read, np.isin(np.arange(len(table)), bounds))
    # A turn over several rows is not counted from row to row; and what a row without pulses counted is lost.
    is_lost = shaft.pulses or not (holds or are_far_apart(read[kept]))
    kept = whole if name == "count" and is_lost else kept
    column = np.zeros(len(table), values.dtype)
    column[read] = values
    log = Log(
        (time_s[kept], resolution_s),
        given.at((np.cumsum(~no_input) - 1)[row][kept]),
        {name: column[kept]},
        None if measured is None else measured[kept],
        None if kept.all() else np.concatenate([[False], np.diff(np.flatnonzero(kept)) > 1]),
        None if read[kept].all() else no_shaft[kept],
        holds,
    )
    return log, np.concatenate([[0], np.cumsum(kept)])[bounds]


def _held(row: np.ndarray, given: np.ndarray, bounds: np.ndarray, acted_before: bool) -> np.ndarray:
    """(n,) of each row the one whose input acts there, where that is `given` in some alone: the last up to `row`, or,
    where inputs are those that acted until their row, the next from it on. `row` itself where its segment has none."""
    rows, number = np.flatnonzero(given), len(given)
    place = np.searchsorted(rows, row, "left") if acted_before else np.searchsorted(rows, row, "right") - 1
    of = np.concatenate([rows, [number]])[place]
    segment = np.repeat(np.arange(len(bounds) - 1), np.diff(bounds))
    same = (of < number) & (segment[np.minimum(of, number - 1)] == segment)
    return np.where(same, of, row)


def _rows_before(bounds: np.ndarray) -> np.ndarray:
    """(n,) the row whose input acts from each row on, where inputs are those that acted until their row."""
    row = np.arange(1, bounds[-1] + 1)
    row[bounds[1:] - 1] -= 1
    return row
