"""Reads the CSV of another program: only what is certain, with lines for complaints."""

import csv
import dataclasses
import itertools
import math
import re
from collections.abc import Collection, Sequence
from decimal import Decimal
from pathlib import Path
from typing import Literal

import numpy as np

from jaxmotor._sentences import shown
from jaxmotor.recording._matrix_text import without_brackets, without_row_ends
from jaxmotor.recording._recording import RecordingError
from jaxmotor.recording._serial import labels_of, without_arrival, without_labels
from jaxmotor.recording._text import NUMBER, check_names, fault, limit_rows, load, text_of

DELIMITERS = {",": "comma", ";": "semicolon", "\t": "tab", " ": "blanks"}
COMMENTS = ("#", "%", "=~=~")
"""The last is PuTTY's."""
MISSING = ("", "nan", "-nan", "na")
"""Cells that say that nothing was measured, in small letters."""
MOST_ABOVE = 200
"""Lines that a board may print above the column names, or where there are none, above the rows."""
LARGEST = 1e17
"""Greater numbers are damage."""
NOTHING = "a line of column names and then rows are needed; the log has none"
EXACT = 15
"""Digits that every float holds."""
_DECIMAL_COMMA = re.compile(r"[+-]?[0-9]+,[0-9]+([eE][+-]?[0-9]+)?")
_DECIMALS = re.compile(r"[+-]?[0-9]*\.?([0-9]*)(?:[eE]([+-]?[0-9]{1,3}))?")
_THOUSANDS = re.compile(r"[+-]?[0-9.]*\.[0-9.,]*")
_FIELD_ENDS = re.compile(r"[,;\t]|(?<![,;\t ]) +(?![,;\t ])")
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
        self._check_size(name, values)
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

    def _check_size(self, name: str, values: np.ndarray) -> None:
        if (large := np.abs(values) > LARGEST).any():
            row = int(np.argmax(large))
            raise self.fault(row, f"{name} is {values[row]:g}, more than can be meant; correct or delete the row")

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


def read_table(
    path: Path,
    *,
    columns: str | None = None,
    drop: int = 0,
    decimal_comma: bool = False,
    drop_damaged: bool = False,
    stated: Collection[str] = (),
) -> Table:
    """The log at `path`: comment lines, a line of column names, rows.

    What a board prints as it starts may stand above the line that names all `stated` columns (`COL` or `COL:UNIT`). The
    names may stand in the last comment line above the rows, or in one that names all `stated`, or before each number
    (`pwm:200,rpm:35`). Where there are none, `columns` gives them, separated by commas; lines above the first one of so
    many numbers are then left out. The first `drop` rows are left out unread. With `decimal_comma` numbers are like
    3,14. With `drop_damaged` lines of another number of fields are left out, and bytes that are no text may stand in
    them. Times of day that a serial monitor put before its lines are left out, and so are a last line that is cut, what
    separates the last number of each row from nothing, and the brackets of a matrix in MATLAB's words.

    **Raises:** `RecordingError`.
    """
    source = str(path)
    text = text_of(load(path), source, is_damaged=drop_damaged)
    limit_rows(text.count("\n"), source)
    lines = without_row_ends(without_brackets(without_arrival(text.rstrip().split("\n")), MOST_ABOVE))
    if not lines:
        raise RecordingError(f"{source}: {NOTHING}")
    # Below the rows comments and blank lines say nothing of them.
    rows_end = next((row for row in range(len(lines), 0, -1) if _is_content(lines[row - 1])), len(lines))
    if is_cut := rows_end == len(lines) and _is_cut(text, lines):
        lines.pop()
    del lines[rows_end:]
    top = next((row for row, line in enumerate(lines) if _is_content(line)), len(lines))
    labelled = 0
    if (labels := labels_of(lines[-1])) is not None:
        if columns is not None:
            raise fault(source, top + 1, "names stand before its numbers already; leave --columns out")
        top, drop, columns = min(top + drop, len(lines)), 0, ",".join(labels)
        begun = (row for row, line in enumerate(lines[top : top + MOST_ABOVE]) if labels_of(line) == labels)
        top += (labelled := next(begun, 0))
        lines[top:] = without_labels(lines[top:], lines[-1], source, top + 1, is_damaged=drop_damaged)
    # Where numbers have commas, one separates only quotes, and nothing else does.
    by_comma = not decimal_comma or (
        '"' in lines[-1] and not any(mark in lines[-1] for mark in DELIMITERS.keys() - ",")
    )
    marks = [mark for mark in DELIMITERS if mark != "," or by_comma]
    rows_begin, above = 0, labelled
    comments = reversed(range(max(top - MOST_ABOVE, 0), top))
    commented = next((row for row in comments if _names_all(lines[row], marks, stated)), None)
    if columns is None and commented is None:
        above, rows_begin = _lines_above_names(lines[top : top + MOST_ABOVE], marks, stated)
    elif columns is not None and labels is None:
        above = rows_begin = _lines_above_rows(lines[top:], drop, marks, columns.count(",") + 1)
    top += rows_begin
    if columns is not None:
        top, drop = min(top + drop, len(lines)), 0
    names, first, delimiter = (
        _above_names(lines, top, marks, commented, source)
        if columns is None
        else _stated_names(lines, top, marks, columns, source)
    )
    check_names(names, source, first, "put names above them, or state --columns")
    first += drop
    if first >= len(lines):
        raise RecordingError(f"{source}: {NOTHING}")
    rows = _split(lines[first:], delimiter, source, first + 1, is_damaged=drop_damaged)
    rows, numbers = _without_empty_end(rows, len(names)), range(first + 1, len(lines) + 1)
    if drop_damaged:
        rows, numbers = _of_width(rows, numbers, len(names), source)
    else:
        _check_widths(rows, lines[first:], len(names), source, first + 1)
    cells = {name: list(column) for name, column in zip(names, zip(*rows, strict=True), strict=True) if name}
    damaged = len(lines) - first - len(rows)
    table = Table(source, numbers, cells, lines_above=above, is_cut=is_cut, damaged=damaged)
    return _with_points(table) if decimal_comma else table


def _is_cut(text: str, lines: list[str]) -> bool:
    """The log ends in the middle of a line, with fewer fields than the one above has: somebody ended the capture."""
    fields = [len(_FIELD_ENDS.findall(line.strip())) for line in lines[-2:]]
    return len(lines) > 2 and not text.endswith(("\n", "\r")) and fields[1] < fields[0]


def _is_content(line: str) -> bool:
    return bool(line.strip()) and not line.startswith(COMMENTS) and not line.lower().startswith("sep=")


def _lines_above_names(lines: list[str], marks: list[str], stated: Collection[str]) -> tuple[int, int]:
    """How many of `lines` stand above the one that names all `stated` columns, with a row below it, and above its
    names or, where these are a comment, its rows; 0 if none does."""
    for above, (line, following) in enumerate(itertools.pairwise(lines)):
        if _is_row(following) and _names_all(line, marks, stated):
            return above, above + line.startswith(COMMENTS)
    return 0, 0


def _lines_above_rows(lines: list[str], drop: int, marks: list[str], width: int) -> int:
    """How many of `lines` stand above the first row of `width` numbers; 0 if there is none, or if one of them has
    `width` fields or numbers alone, too: it may name the columns, or be a damaged row. So it is if the row after the
    first `drop` lines is such a row: then these are stale ones."""
    mark = next((mark for mark in marks if mark in lines[-1]), " ") if lines else " "

    def is_whole(line: str) -> bool:
        return _fields(line, mark) == width and _is_row(line)

    if any(map(is_whole, lines[drop : drop + 1])):
        return 0
    above = next((above for above, line in enumerate(lines[:MOST_ABOVE]) if is_whole(line)), 0)
    return 0 if any(_fields(line, mark) == width or _is_row(line) for line in lines[:above]) else above


def _names_all(line: str, marks: list[str], stated: Collection[str]) -> bool:
    """`line`, or the comment that it is, names all `stated` columns, and there are some."""
    rows = [[cell.strip().strip('"') for cell in line.lstrip("".join(COMMENTS)).split(mark)] for mark in marks]
    return bool(stated) and any(all(_column_of(one, cells) for one in stated) for cells in rows)


def _column_of(stated: str, cells: list[str]) -> bool:
    """One of `cells` is the column that is `stated`, alone or with its unit."""
    return any(stated == cell or stated.startswith(f"{cell}:") for cell in cells if cell)


def _above_names(
    lines: list[str], top: int, marks: list[str], commented: int | None, source: str
) -> tuple[list[str], int, str]:
    """The names as the log has them, how many lines stand above the rows, and what separates the columns. Where the
    comment in line `commented` is known to name all that are stated, it is that one."""
    if top == len(lines):
        raise RecordingError(f"{source}: {NOTHING}")
    named = next((row for row in reversed(range(top)) if lines[row].strip()), 0) if commented is None else commented
    above = lines[named].lstrip("".join(COMMENTS)).strip() if top else ""
    if above and (commented is not None or _is_row(lines[top])):
        delimiter = _delimiter(lines[top], lines[top], marks, source, top + 1)
        width = _fields(lines[top], delimiter)
        for mark in (delimiter, *DELIMITERS):
            names = _names_of(above, mark, width, source, named + 1)
            if len(names) == width:
                return names, top, delimiter
    first = next((row for row in range(top + 1, len(lines)) if lines[row].strip()), len(lines))
    if first == len(lines):
        raise RecordingError(f"{source}: {NOTHING}")
    delimiter = _delimiter(lines[top], lines[first], marks, source, top + 1)
    return _names_of(lines[top], delimiter, _fields(lines[first], delimiter), source, top + 1), first, delimiter


def _names_of(line: str, delimiter: str, width: int, source: str, number: int) -> list[str]:
    """The names in a `line` above rows of `width` fields: between blanks they may be words with one blank between."""
    names = [name.strip() for name in _split([line], delimiter, source, number)[0]]
    if delimiter != " " or len(names) == width:
        return names
    phrases = re.split(r"\s{2,}|\t", line.strip())
    return phrases if len(phrases) == width else names


def _stated_names(
    lines: list[str], top: int, marks: list[str], columns: str, source: str
) -> tuple[list[str], int, str]:
    """As `_above_names`, of a log without names."""
    if top == len(lines):
        raise RecordingError(f"{source}: the log has no rows; export it again")
    if not any(map(NUMBER.fullmatch, _bare_cells(lines[top]))) and re.search("[A-Za-z]", lines[top]):
        raise fault(source, top + 1, "this line names the columns already; leave --columns out")
    # The last row: a stale first one may be torn. So may the last one be, where the log was cut.
    last = len(lines) - (len(lines) - top > 1 and not any(mark in lines[-1] for mark in DELIMITERS))
    delimiter = _delimiter(lines[last - 1], lines[last - 1], marks, source, last)
    names, width = [name.strip() for name in columns.split(",")], _width(lines[last - 1], delimiter)
    if len(names) not in (width, _fields(lines[last - 1], delimiter)):
        raise fault(source, last, f"{_counted(width)}, and --columns names {len(names)}; name each of them")
    return names, top, delimiter


def _is_row(line: str) -> bool:
    """Numbers, whatever separates them, and at least one."""
    cells = _bare_cells(line)
    return any(map(NUMBER.fullmatch, cells)) and all(
        NUMBER.fullmatch(cell) or cell.lower() in MISSING for cell in cells
    )


def _bare_cells(line: str) -> list[str]:
    return [cell.strip('"') for cell in re.split(r"[,;\t ]+", line.strip())]


def _delimiter(header: str, row: str, marks: list[str], source: str, line: int) -> str:
    found = [mark for mark in marks if mark in header]
    if len(found) > 1:
        # A name may hold a comma; the row then tells.
        fitting = [mark for mark in found if _width(header, mark) == _width(row, mark) > 1]
        found = [mark for mark in fitting if mark != " "] or fitting
    if len(found) != 1:
        raise fault(
            source,
            line,
            f"the columns are separated by one of {' or '.join(DELIMITERS.values())}, and here it is not clear by "
            "which; export with one of them",
        )
    return found[0]


def _width(line: str, delimiter: str) -> int:
    if delimiter == " ":
        return len(line.split())
    try:
        return len(next(csv.reader([line], delimiter=delimiter), []))
    except csv.Error:
        # One of its fields is longer than any number or name.
        return 1


def _fields(line: str, delimiter: str) -> int:
    """`_width` of a `line`, without an empty last field."""
    return _width(line, delimiter) - (delimiter != " " and line.rstrip().endswith(delimiter))


def _without_empty_end(rows: list[list[str]], width: int) -> list[list[str]]:
    """Rows of `width` cells, where all that have one more have nothing in it: their numbers end with what separates
    them."""
    longer = [row for row in rows if len(row) != width]
    if longer and all(len(row) == width + 1 and not row[width].strip() for row in longer):
        return [row[:width] for row in rows]
    return rows


def _of_width(
    rows: list[list[str]], numbers: Sequence[int], width: int, source: str
) -> tuple[list[list[str]], list[int]]:
    """Those of `rows`, and of their line `numbers`, that have `width` cells.

    **Raises:** `RecordingError` where none has.
    """
    rows = [row[:width] if len(row) == width + 1 and not row[width].strip() else row for row in rows]
    kept = [(row, number) for row, number in zip(rows, numbers, strict=True) if len(row) == width]
    if not kept:
        raise RecordingError(f"{source}: no line has the {_counted(width)} of its columns; check their names")
    return [row for row, _ in kept], [number for _, number in kept]


def _split(lines: list[str], delimiter: str, source: str, first: int, *, is_damaged: bool = False) -> list[list[str]]:
    """The cells of `lines`; none of a line whose quotes do not fit, where the log `is_damaged`."""
    if delimiter == " ":
        return [line.split() for line in lines]
    if not any('"' in line for line in lines):
        return [line.split(delimiter) for line in lines]
    rows = []
    for number, line in enumerate(lines, first):
        try:
            rows.append(next(csv.reader([line], delimiter=delimiter, strict=True), [""]))
        except csv.Error as error:
            if is_damaged:
                rows.append([])
                continue
            raise fault(source, number, f"the quotes do not fit ({error}); correct the row") from error
    return rows


def _with_points(table: Table) -> Table:
    """`table` of decimal commas with decimal points; a point there would be a mark of thousands."""
    for name, column in table.cells.items():
        for row, cell in enumerate(column):
            if "." in cell and _THOUSANDS.fullmatch(cell.strip()):
                raise table.fault(row, f"{name} is {shown(cell)}, with a point where commas are decimal; export plain")
    cells = {name: [cell.replace(",", ".") for cell in column] for name, column in table.cells.items()}
    return dataclasses.replace(table, cells=cells)


def _check_widths(rows: list[list[str]], lines: list[str], width: int, source: str, first: int) -> None:
    for number, (row, line) in enumerate(zip(rows, lines, strict=True), first):
        if len(row) != width:
            what = "a comment or blank line" if not line.strip() or line.startswith(COMMENTS) else _counted(len(row))
            hint = "correct or delete it"
            if all(len(one) == len(row) for one in rows):
                hint = "all rows are so: name their columns with --columns"
            elif len(row) > width:
                hint = "if commas are decimal marks, export with another separator"
            elif number == first:
                hint = "correct it, or leave it out with --drop-first"
            raise fault(source, number, f"{what} where the columns are {width}; {hint}")


def _counted(fields: int) -> str:
    return f"{fields} fields" if fields != 1 else "1 field"


def _decimals(cell: str) -> int:
    match = _DECIMALS.fullmatch(cell.strip())
    return len(match[1]) - int(match[2] or 0) if match else 0
