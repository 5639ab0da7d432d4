"""Lines that a serial line, a reset or two programs at one port tore: left out where the user says so."""

import bisect
import dataclasses
from collections.abc import Collection, Sequence

import numpy as np

from jaxmotor.recording._recording import RecordingError
from jaxmotor.recording._table import MOST_DAMAGED, Table
from jaxmotor.recording._text import NUMBER

MOST_STAMPS = 0.02
"""Part of the rows whose time may be damaged: of more, time runs back or stands still for another reason."""


def without_damaged(table: Table, stated: Collection[str]) -> Table:
    """`table` without the rows in which one of the columns that are `stated` (`COL` or `COL:UNIT`) holds anything but
    a number or nothing.

    **Raises:** `RecordingError` where more than a few lines are damaged.
    """
    columns = {max(found, key=len) for one in stated if (found := _columns_of(one, table.cells))}
    whole = np.ones(len(table), bool)
    for column in columns:
        whole &= table.missing(column) | np.array(
            [bool(NUMBER.fullmatch(cell.strip())) for cell in table.cells[column]]
        )
    return left_out(table, whole)


def in_order(table: Table, clock: str) -> Table:
    """`table` without the few rows whose time in the column `clock` is missing, or does not lie between those before
    and those after it: the fewest whose absence makes time run on."""
    table = left_out(table, ~table.missing(clock))
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


def _columns_of(stated: str, columns: Collection[str]) -> list[str]:
    return [column for column in columns if stated == column or stated.startswith(f"{column}:")]


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
