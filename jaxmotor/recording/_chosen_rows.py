"""The rows of a log that are read: those of one of several motors, those between two moments."""

from collections.abc import Sequence

import numpy as np

from jaxmotor._sentences import one_of, shown
from jaxmotor.recording._recording import RecordingError
from jaxmotor.recording._table import Table
from jaxmotor.recording._text import NUMBER


def of_one(table: Table, only: str | None) -> Table:
    """The rows of `table` in which the column of `only`, `COL=VALUE`, has that value; all of them where it is None.

    **Raises:** `RecordingError` where there is no such column, or no such row.
    """
    if only is None:
        return table
    column = next((name for name in table.cells if only.startswith(f"{name}=")), None)
    if column is None:
        raise RecordingError(
            f"--only {shown(only)} names no column and a value of it, COL=VALUE; the columns are "
            f"{one_of(map(shown, table.cells), only)}"
        )
    value, cells = only[len(column) + 1 :].strip(), [cell.strip() for cell in table.cells[column]]
    rows = np.array([_is_same(cell, value) for cell in cells], bool)
    if not rows.any():
        values = one_of(map(shown, dict.fromkeys(cells)), value)
        raise RecordingError(f"column {shown(column)} is never {shown(value)}; it is {values}")
    return table.only(rows)


def between_moments(table: Table, time_s: np.ndarray, begin_s: float | None, end_s: float | None) -> Table:
    """The rows of `table`, at `time_s` (n,) after the first one, from `begin_s` on and up to `end_s` [s].

    **Raises:** `RecordingError` where hardly any is left.
    """
    begin, end = 0.0 if begin_s is None else begin_s, np.inf if end_s is None else end_s
    rows = (time_s >= begin) & (time_s <= end)
    if rows.sum() < 2:
        until = f"to {end:g} s" if np.isfinite(end) else "on"
        raise RecordingError(
            f"from {begin:g} s {until} after the first row there are {rows.sum()} rows, of a log that lasts "
            f"{time_s.max():.4g} s; change --begin or --end"
        )
    return table.only(rows)


def check_apart(table: Table, column: str, starts: Sequence[int]) -> None:
    """**Raises:** `RecordingError` where most of the segments that `column` begins, at the rows `starts`, are single
    rows, which tell nothing of how a motor moves."""
    single = sum(stop - start == 1 for start, stop in zip(starts, [*starts[1:], len(table)], strict=True))
    if len(starts) < 2 or 2 * single <= len(starts):
        return
    labels = [cell.strip() for cell in table.cells[column]]
    hint = "name another column"
    if 2 * len(set(labels)) <= len(starts):
        example = shown(f"{column}={labels[0]}")
        hint = f"where motors take turns in it, read one of them at a time: --only {example}"
    raise RecordingError(f"{shown(column)} changes with every row, and a row alone is no segment; {hint}")


def _is_same(cell: str, value: str) -> bool:
    if NUMBER.fullmatch(cell) and NUMBER.fullmatch(value):
        return float(cell) == float(value)
    return cell == value
