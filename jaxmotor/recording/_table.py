"""The cells of a foreign log by column, as numbers: only what is certain, with lines for complaints."""

import dataclasses
import math
import re
from collections.abc import Sequence
from decimal import Decimal
from typing import Literal

import numpy as np

from jaxmotor._sentences import shown
from jaxmotor.recording._recording import RecordingError
from jaxmotor.recording._text import NUMBER, fault

MISSING = ("", "nan", "-nan", "na")
"""Cells that say that nothing was measured, in small letters."""
LARGEST = 1e17
"""Greater numbers are damage."""
EXACT = 15
"""Digits that every float holds."""
_DECIMAL_COMMA = re.compile(r"[+-]?[0-9]+,[0-9]+([eE][+-]?[0-9]+)?")
_DECIMALS = re.compile(r"[+-]?[0-9]*\.?([0-9]*)(?:[eE]([+-]?[0-9]{1,3}))?")
_WHOLE = re.compile(r"([+-]?[0-9]+)(?:\.0*)?")


@dataclasses.dataclass(frozen=True)
class Table:
    """Cells by column, as text."""

    source: str
    lines: Sequence[int]
    """Line of each row in the file."""
    cells: dict[str, list[str]]
    place: Literal["line", "row"] = "line"
    """What `lines` count."""
    lines_above: int = 0
    """Lines of something else above the column names, or where there are none, above the rows."""
    is_cut: bool = False
    """The last line ended before its last field, and is left out."""
    damaged: int = 0
    """Lines that were no rows, and are left out."""

    def __len__(self) -> int:
        return len(self.lines)

    @property
    def left_out(self) -> dict[str, int]:
        """For a header: what of the file was not read as rows."""
        above = {"lines_above": self.lines_above} if self.lines_above else {}
        damaged = {"damaged_lines": self.damaged} if self.damaged else {}
        return above | ({"cut_lines": 1} if self.is_cut else {}) | damaged

    def fault(self, row: int, sentence: str) -> RecordingError:
        """The error about `row`, counted from 0."""
        return fault(self.source, self.lines[row], sentence, self.place)

    def only(self, rows: np.ndarray) -> "Table":
        """The table of the rows at which `rows` (n,) is true."""
        if rows.all():
            return self
        kept = np.flatnonzero(rows).tolist()
        cells = {name: [column[row] for row in kept] for name, column in self.cells.items()}
        return dataclasses.replace(self, lines=[self.lines[row] for row in kept], cells=cells)

    def missing(self, name: str) -> np.ndarray:
        """(n,) whether the cell is empty or says that nothing was measured (`nan`, `NA`)."""
        return np.array([cell.strip().lower() in MISSING for cell in self.cells[name]], bool)

    def numbers(self, name: str) -> np.ndarray:
        """(n,) float64.

        **Raises:** `RecordingError` for the first cell that is not a finite number.
        """
        cells = self.cells[name]
        try:
            if any("_" in cell for cell in cells):
                raise ValueError("Python would take 1_000 for a number")
            values = np.array(cells, dtype=np.float64)
        except ValueError:
            raise self.first_fault(name) from None
        if not np.isfinite(values).all():
            raise self.first_fault(name)
        if (large := np.abs(values) > LARGEST).any():
            row = int(np.argmax(large))
            raise self.fault(row, f"{name} is {values[row]:g}, more than can be meant; correct or delete the row")
        return values

    def since_first(self, name: str) -> np.ndarray:
        """(n,) float64, each cell less the first one, exact to the last printed digit.

        Seconds since 1970 with microseconds, or nanoseconds, have more digits than a float: they are subtracted as
        they are printed.

        **Raises:** `RecordingError`, as `numbers`.
        """
        cells = self.cells[name]
        if max(map(len, cells)) <= EXACT:
            values = self.numbers(name)
            return values - values[0]
        for row, cell in enumerate(cells):
            if not NUMBER.fullmatch(cell.strip()) or not math.isfinite(float(cell)):
                raise self.first_fault(name) from None
            if abs(float(cell)) > 1e20:
                raise self.fault(row, f"{name} is {float(cell):g}, more than can be meant; correct or delete the row")
        first = Decimal(cells[0].strip())
        return np.array([float(Decimal(cell.strip()) - first) for cell in cells])

    def held(self, name: str) -> np.ndarray:
        """(n,) float64, where an empty cell holds what was there before; NaN before the first value.

        **Raises:** `RecordingError`, as `numbers`.
        """
        values = self.sparse(name)
        filled = ~np.isnan(values)
        last = np.maximum.accumulate(np.where(filled, np.arange(len(values)), -1))
        return np.where(last >= 0, values[last], np.nan)

    def sparse(self, name: str) -> np.ndarray:
        """(n,) float64, NaN where the cell is missing.

        **Raises:** `RecordingError`, as `numbers`.
        """
        missing = self.missing(name)
        cells = ["0" if no else cell for cell, no in zip(self.cells[name], missing.tolist(), strict=True)]
        return np.where(missing, np.nan, dataclasses.replace(self, cells={name: cells}).numbers(name))

    def integers(self, name: str) -> np.ndarray | None:
        """(n,) int64, exact, also where they are printed as 22.0; None where some cell is not a whole number.

        **Raises:** `RecordingError`, as `numbers`, and for whole numbers that are printed without their last digits
        (1.23457e+06).
        """
        values = self.numbers(name)
        cells = self.cells[name]
        if all(map(str.isdecimal, cells)):
            whole = list(map(int, cells))
        else:
            if not (values == np.rint(values)).all():
                return None
            matches = [_WHOLE.fullmatch(cell.strip()) for cell in cells]
            if not all(matches):
                self._check_digits(name)
                return values.astype(np.int64) if np.abs(values).max() <= 2**53 else None
            whole = [int(match[1]) for match in matches if match]
        return np.array(whole, dtype=np.int64) if max(map(abs, whole)) <= 2**62 else None

    def resolution(self, name: str) -> float:
        """The step of the last digit that is printed, of the cell with the most digits."""
        return 10.0 ** -max(map(_decimals, self.cells[name]))

    def _check_digits(self, name: str) -> None:
        for row, cell in enumerate(self.cells[name]):
            if _decimals(cell) < 0 and float(cell) != 0:
                raise self.fault(
                    row, f"{name} is {shown(cell)}, whose last digits were not printed; export all digits of it"
                )

    def first_fault(self, name: str) -> RecordingError:
        """The error about the first cell of a column that is not a finite number."""
        for row, cell in enumerate(self.cells[name]):
            cell = cell.strip()
            if _DECIMAL_COMMA.fullmatch(cell):
                return self.fault(
                    row, f"{name} is {shown(cell)}, with a decimal comma; say so with --decimal-comma, or export points"
                )
            if not NUMBER.fullmatch(cell) or not math.isfinite(float(cell)):
                found = shown(cell) if cell else "empty"
                return self.fault(row, f"{name} is {found}, not a finite number; correct or delete the row")
        return RecordingError(f"{self.source}: column {name!r} is not numbers; export it again")


def _decimals(cell: str) -> int:
    match = _DECIMALS.fullmatch(cell.strip())
    return len(match[1]) - int(match[2] or 0) if match else 0
