"""When the rows of a foreign log were, and the segments that they make."""

import dataclasses
import itertools
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from jaxmotor.recording._chosen_rows import between_moments, check_apart
from jaxmotor.recording._recording import RecordingError
from jaxmotor.recording._table import Table
from jaxmotor.recording._units import existing, split_time

MAX_LABELS = 10_000
"""Segments that a column of labels may begin."""


class Cut(NamedTuple):
    """A log, cut into segments."""

    table: Table
    bounds: np.ndarray
    """(segments + 1,) rows at which segments begin, and the end."""
    labels: list[str | None]
    """Of each segment."""
    stamps: tuple[np.ndarray, float]
    """(n,) when the rows were, and the step of the last printed digit [s]."""


@dataclasses.dataclass(frozen=True)
class Clock:
    """What was stated of the time of rows, and of their segments."""

    time: str | None
    """`COL:UNIT`; None where rows have no time stamps, and are `period_s` apart."""
    period_s: float | None
    segment: str | None
    """A column; where it is that of the time, a segment begins where time runs back."""
    gap_s: float | None
    """More than that between two rows begins a segment, too."""
    drop_first: int
    """Rows that are left out of each segment but the first, whose first rows were not even read."""

    def column(self, table: Table) -> tuple[str, float]:
        """The column of the time, and its unit [s]; no name where there is none."""
        return ("", 1.0) if self.time is None else split_time(self.time, table.cells)

    def since_first(self, table: Table) -> np.ndarray:
        """(n,) how long after the first row each is [s]."""
        name, unit_s = self.column(table)
        return table.since_first(name) * unit_s if name else np.arange(len(table)) * (self.period_s or 1.0)

    def between(self, table: Table, begin_s: float | None, end_s: float | None) -> Table:
        """The rows from `begin_s` on and up to `end_s` [s] after the first one."""
        if begin_s is None and end_s is None:
            return table
        if self.segment == self.column(table)[0]:
            raise RecordingError("--begin and --end are on one clock, and each segment starts its own; leave them out")
        return between_moments(table, self.since_first(table), begin_s, end_s)

    def cut(self, table: Table) -> Cut:
        """**Raises:** `RecordingError` where there are no such segments, or time does not run on in one."""
        name, unit_s = self.column(table)
        gaps = np.zeros(len(table), bool)
        if self.gap_s is not None:
            gaps = np.diff(table.since_first(name), prepend=0.0) > self.gap_s / unit_s
        labels = self._labels(table, name)
        starts = [0, *(row for row in range(1, len(table)) if gaps[row] or labels[row] != labels[row - 1])]
        if len(starts) > MAX_LABELS:
            many = "--gap" if gaps.any() else repr(self.segment)
            raise RecordingError(f"{many} begins {len(starts)} segments; it is no segment column, or split the log")
        if self.segment is not None and not gaps.any():
            check_apart(table, self.segment, starts)
        bounds = np.array([*starts, len(table)])
        kept = self._kept(table, bounds)
        table, bounds = table.only(kept), np.concatenate([[0], np.cumsum(kept)])[bounds]
        time_s = self.since_first(table)
        if name:
            _check_time(table, time_s, bounds, name, self.segment is None)
        resolution_s = table.resolution(name) * unit_s if name else 0.0
        return Cut(table, bounds, [labels[row] for row in starts], (time_s, resolution_s))

    def _labels(self, table: Table, name: str) -> Sequence[str | None]:
        """Of the segment of each row."""
        if self.segment is None:
            return [None] * len(table)
        column = existing(self.segment, table.cells)
        if column == name:
            back = np.diff(table.numbers(name), prepend=-np.inf) < 0
            return [str(number) for number in np.cumsum(back).tolist()]
        return [label.strip() for label in table.cells[column]]

    def _kept(self, table: Table, bounds: np.ndarray) -> np.ndarray:
        """(n,) whether a row is none of those that are dropped."""
        kept = np.ones(len(table), bool)
        for start, stop in itertools.pairwise(bounds[1:].tolist()):
            if self.drop_first >= stop - start:
                sentence = f"--drop-first {self.drop_first} leaves nothing of this segment's {stop - start} rows"
                raise table.fault(start, f"{sentence}; lower it")
            kept[start : start + self.drop_first] = False
        return kept


def _check_time(table: Table, time_s: np.ndarray, bounds: np.ndarray, clock: str, alone: bool) -> None:
    """**Raises:** `RecordingError` where the time in the column `clock` does not run on in a segment; `alone` says that
    no column tells segments apart."""
    step = np.diff(time_s)
    step[bounds[1:-1] - 1] = 1.0
    late = np.flatnonzero(step <= 0)
    if not len(late):
        return
    row = int(late[0]) + 1
    stands = step[row - 1] == 0
    hint = ""
    if stands and (step == 0).sum() > 1:
        hint = (
            "; where stamps are coarse and rows come evenly, state --period instead of --time; where motors take "
            "turns, read one of them (--only COL=VALUE)"
        )
    elif row == 1:
        hint = ", or leave a stale first row out (--drop-first 1)"
    elif alone:
        apart = f"the column that tells the experiments apart (--segment; {clock!r} if each starts its own clock)"
        hint = f", or name {apart}"
    what, at = "stands still" if stands else "runs backwards", table.cells[clock][row].strip()
    raise table.fault(row, f"the time {what} at {clock} = {at}; correct or delete the row{hint}")
