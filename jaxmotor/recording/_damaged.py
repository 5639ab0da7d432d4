"""Lines that a serial line, a reset or two programs at one port tore: left out where the user says so."""

import bisect
import dataclasses
from collections.abc import Callable, Collection, Sequence

import numpy as np

from jaxmotor.recording._recording import RecordingError
from jaxmotor.recording._table import Table
from jaxmotor.recording._text import NUMBER

MOST_DAMAGED = 0.2
"""Part of the lines that may be damaged: of more, the columns are others than those stated."""
MOST_STAMPS = 0.02
"""Part of the rows whose time may be damaged: of more, time runs back or stands still for another reason."""


def whole_table(read: Callable[[bool], Table], stated: Collection[str], clock: str | None, drop: bool) -> Table:
    """The table that `read` gives, of lines that may be damaged or not; without those that are where they are to be
    dropped (`without_damaged`).

    **Raises:** `RecordingError`; for the first of a few damaged lines with the option that leaves them out, where rows
    have a time.
    """
    if drop:
        return without_damaged(read(True), stated, clock)
    try:
        table = read(False)
        wrong = [column for column in _named(table, stated) if not _numbers(table, column, clock).all()]
        if not wrong or clock is None:
            return table
        raise table.first_fault(wrong[0])
    except RecordingError as error:
        damaged = 0 if clock is None else _damaged_lines(read, stated, clock)
        if not damaged:
            raise
        what = "it" if damaged == 1 else f"the {damaged} damaged lines"
        raise RecordingError(f"{error}; or leave {what} out with --drop-damaged") from None


def _damaged_lines(read: Callable[[bool], Table], stated: Collection[str], clock: str) -> int:
    """How many would be left out; none where that does not help."""
    try:
        return without_damaged(read(True), stated, clock).damaged
    except RecordingError:
        return 0


def without_damaged(table: Table, stated: Collection[str], clock: str | None) -> Table:
    """`table` without the rows in which one of the columns that are `stated` (`COL` or `COL:UNIT`) holds anything but
    a number or nothing, that of the `clock` anything but a number.

    **Raises:** `RecordingError` where more than a few lines are damaged.
    """
    whole = np.ones(len(table), bool)
    for column in _named(table, stated):
        whole &= _numbers(table, column, clock)
    return left_out(table, whole)


def in_order(table: Table, clock: str) -> Table:
    """`table` without the few rows whose time in the column `clock` does not lie between those before and those after
    it: the fewest whose absence makes time run on."""
    whole = np.zeros(len(table), bool)
    whole[_rising(table.numbers(clock).tolist())] = True
    return left_out(table, whole) if (~whole).sum() <= MOST_STAMPS * len(table) else table


def left_out(table: Table, whole: np.ndarray) -> Table:
    """`table` of the `whole` rows (n,), the others counted.

    **Raises:** `RecordingError`, as `without_damaged`.
    """
    damaged = table.damaged + int((~whole).sum())
    if damaged > MOST_DAMAGED * (len(table) + table.damaged):
        raise RecordingError(
            f"{table.source}: {damaged} of its {len(table) + table.damaged} lines are damaged, more than a serial line "
            "does; check which columns are stated"
        )
    return dataclasses.replace(table.only(whole), damaged=damaged)


def _named(table: Table, stated: Collection[str]) -> list[str]:
    """The columns that are `stated`, and are there."""
    found = [[column for column in table.cells if f"{one}:".startswith(f"{column}:")] for one in stated]
    return list(dict.fromkeys(max(columns, key=len) for columns in found if columns))


def _numbers(table: Table, column: str, clock: str | None) -> np.ndarray:
    """(n,) whether each cell is a number or, but for the `clock`, says that nothing was measured."""
    cells = table.cells[column]
    if _all_numbers(cells):
        return np.ones(len(cells), bool)
    numbers = np.array([bool(NUMBER.fullmatch(cell.strip())) for cell in cells])
    return numbers if clock is not None and _named(table, [clock]) == [column] else numbers | table.missing(column)


def _all_numbers(cells: Sequence[str]) -> bool:
    """Nearly always, and seen ten times as fast as cell by cell."""
    try:
        return not any("_" in cell for cell in cells) and bool(np.isfinite(np.array(cells, float)).all())
    except ValueError:
        return False


def _rising(values: Sequence[float]) -> list[int]:
    """The places of the most `values` that rise from each to the next (patience sorting)."""
    ends, places, before = [], [], []
    for place, value in enumerate(values):
        rank = bisect.bisect_left(ends, value)
        before.append(places[rank - 1] if rank else -1)
        if rank == len(ends):
            ends.append(value)
            places.append(place)
        else:
            ends[rank], places[rank] = value, place
    at, found = places[-1] if places else -1, []
    while at >= 0:
        found.append(at)
        at = before[at]
    return found[::-1]
