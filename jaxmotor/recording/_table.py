"""Reads the CSV of another program: only what is certain, with lines for complaints."""

import csv
import dataclasses
import math
import re
from pathlib import Path

import numpy as np

from jaxmotor._sentences import shown
from jaxmotor.recording._recording import RecordingError
from jaxmotor.recording._text import fault, limit_rows, load, text_of

DELIMITERS = {",": "comma", ";": "semicolon", "\t": "tab"}
LARGEST = 1e17
"""Greater numbers are damage; microseconds since 1970 are less."""
_DECIMAL_COMMA = re.compile(r"[+-]?[0-9]+,[0-9]+([eE][+-]?[0-9]+)?")
_NUMBER = re.compile(r"[+-]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][+-]?[0-9]+)?")
_DECIMALS = re.compile(r"[+-]?[0-9]*\.?([0-9]*)(?:[eE]([+-]?[0-9]{1,3}))?")


@dataclasses.dataclass(frozen=True)
class Table:
    """Cells by column, as text."""

    source: str
    first: int
    """Line of the first row in the file."""
    cells: dict[str, list[str]]

    def fault(self, row: int, sentence: str) -> RecordingError:
        """The error about `row`, counted from 0."""
        return fault(self.source, self.first + row, sentence)

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
            raise self._first_fault(name) from None
        if not np.isfinite(values).all():
            raise self._first_fault(name)
        if (large := np.abs(values) > LARGEST).any():
            row = int(np.argmax(large))
            raise self.fault(row, f"{name} is {values[row]:g}, more than can be meant; correct or delete the row")
        return values

    def held(self, name: str) -> np.ndarray:
        """(n,) float64, where an empty cell holds what was there before; NaN before the first value.

        **Raises:** `RecordingError`, as `numbers`.
        """
        cells = self.cells[name]
        filled = np.array([bool(cell.strip()) for cell in cells])
        values = np.full(len(cells), np.nan)
        part = Table(self.source, self.first, {name: [cell if cell.strip() else "0" for cell in cells]})
        values[filled] = part.numbers(name)[filled]
        last = np.maximum.accumulate(np.where(filled, np.arange(len(cells)), -1))
        return np.where(last >= 0, values[last], np.nan)

    def integers(self, name: str) -> np.ndarray | None:
        """(n,) int64, exact; None where some cell is not a whole number of at most 62 bits.

        **Raises:** `RecordingError`, as `numbers`.
        """
        self.numbers(name)
        try:
            values = [int(cell) for cell in self.cells[name]]
        except ValueError:
            return None
        return np.array(values, dtype=np.int64) if max(map(abs, values)) <= 2**62 else None

    def resolution(self, name: str) -> float:
        """The step of the last digit that is printed, of the cell with the most digits."""
        return 10.0 ** -max(map(_decimals, self.cells[name]))

    def _first_fault(self, name: str) -> RecordingError:
        for row, cell in enumerate(self.cells[name]):
            cell = cell.strip()
            if _DECIMAL_COMMA.fullmatch(cell):
                return self.fault(row, f"{name} is {shown(cell)}, with a decimal comma; export with decimal points")
            if not _NUMBER.fullmatch(cell) or not math.isfinite(float(cell)):
                found = shown(cell) if cell else "empty"
                return self.fault(row, f"{name} is {found}, not a finite number; correct or delete the row")
        return RecordingError(f"{self.source}: column {name!r} is not numbers; export it again")


def read_table(path: Path) -> Table:
    """The log at `path`: comment lines, a line of column names, rows.

    **Raises:** `RecordingError`.
    """
    source = str(path)
    text = text_of(load(path), source)
    limit_rows(text.count("\n"), source)
    lines = text.rstrip().split("\n")
    top = next((row for row, line in enumerate(lines) if line.strip() and not line.startswith("#")), None)
    if top is None or top + 1 == len(lines):
        raise RecordingError(f"{source}: a line of column names and then rows are needed; the log has none")
    delimiter = _delimiter(lines[top], lines[top + 1], source, top + 1)
    names = [name.strip() for name in _split([lines[top]], delimiter, source, top + 1)[0]]
    _check_names(names, source, top + 1)
    rows = _split(lines[top + 1 :], delimiter, source, top + 2)
    _check_widths(rows, lines[top + 1 :], len(names), source, top + 2)
    cells = {name: list(column) for name, column in zip(names, zip(*rows, strict=True), strict=True) if name}
    return Table(source, top + 2, cells)


def _delimiter(header: str, row: str, source: str, line: int) -> str:
    found = [mark for mark in DELIMITERS if mark in header]
    if len(found) > 1:
        # A name may hold a comma; the row then tells.
        found = [mark for mark in found if len(next(csv.reader([header], delimiter=mark))) == _width(row, mark) > 1]
    if len(found) != 1:
        marks = " or ".join(DELIMITERS.values())
        raise fault(
            source,
            line,
            f"the columns are separated by one of {marks}, and here it is not clear by which; export with one of them",
        )
    return found[0]


def _width(row: str, delimiter: str) -> int:
    return len(next(csv.reader([row], delimiter=delimiter), []))


def _split(lines: list[str], delimiter: str, source: str, first: int) -> list[list[str]]:
    if not any('"' in line for line in lines):
        return [line.split(delimiter) for line in lines]
    rows = []
    for number, line in enumerate(lines, first):
        try:
            rows.append(next(csv.reader([line], delimiter=delimiter, strict=True), [""]))
        except csv.Error as error:
            raise fault(source, number, f"the quotes do not fit ({error}); correct the row") from error
    return rows


def _check_names(names: list[str], source: str, line: int) -> None:
    if all(_NUMBER.fullmatch(name) for name in names):
        raise fault(source, line, "numbers where the column names are expected; put a line of names above them")
    doubled = [name for name in names if name and names.count(name) > 1]
    if doubled:
        raise fault(source, line, f"column {shown(doubled[0])} stands twice; name each column once")


def _check_widths(rows: list[list[str]], lines: list[str], width: int, source: str, first: int) -> None:
    for number, (row, line) in enumerate(zip(rows, lines, strict=True), first):
        if len(row) != width:
            what = "a comment or blank line" if not line.strip() or line.startswith("#") else f"{len(row)} fields"
            hint = "if the decimal mark is a comma, export with decimal points" if len(row) > width else "correct it"
            raise fault(source, number, f"{what} where the columns are {width}; {hint}")


def _decimals(cell: str) -> int:
    match = _DECIMALS.fullmatch(cell.strip())
    return len(match[1]) - int(match[2] or 0) if match else 0
