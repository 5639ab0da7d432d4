"""Reads the CSV of another program: where its names and rows are, and what separates them."""

import csv
import dataclasses
import itertools
import re
from collections.abc import Collection, Sequence
from pathlib import Path

from jaxmotor._sentences import shown
from jaxmotor.recording._matrix_text import without_brackets, without_row_ends
from jaxmotor.recording._recording import RecordingError
from jaxmotor.recording._serial import labels_of, without_arrival, without_labels
from jaxmotor.recording._table import MISSING, Table
from jaxmotor.recording._text import NUMBER, check_names, fault, limit_rows, load, text_of

DELIMITERS = {",": "comma", ";": "semicolon", "\t": "tab", " ": "blanks"}
COMMENTS = ("#", "%", "=~=~")
"""The last is PuTTY's."""
MOST_ABOVE = 200
"""Lines that a board may print above the column names, or where there are none, above the rows."""
NOTHING = "a line of column names and then rows are needed; the log has none"
_THOUSANDS = re.compile(r"[+-]?[0-9.]*\.[0-9.,]*")
_FIELD_ENDS = re.compile(r"[,;\t]|(?<![,;\t ]) +(?![,;\t ])")


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
    lines, is_cut = _lines_of(path, drop_damaged)
    top = next((row for row, line in enumerate(lines) if _is_content(line)), len(lines))
    rows_begin, above = 0, 0
    if (labels := labels_of(lines[-1])) is not None:
        if columns is not None:
            raise fault(source, top + 1, "names stand before its numbers already; leave --columns out")
        top, drop, columns = min(top + drop, len(lines)), 0, ",".join(labels)
        begun = (row for row, line in enumerate(lines[top : top + MOST_ABOVE]) if labels_of(line) == labels)
        top += (above := next(begun, 0))
        lines[top:] = without_labels(lines[top:], lines[-1], source, top + 1, is_damaged=drop_damaged)
    marks = _marks(lines[-1], decimal_comma)
    comments = reversed(range(max(top - MOST_ABOVE, 0), top))
    commented = next((row for row in comments if _names_all(lines[row], marks, stated)), None)
    if columns is None and commented is None:
        above, rows_begin = _lines_above_names(lines[top : top + MOST_ABOVE], marks, stated)
    elif columns is not None and labels is None:
        above = rows_begin = _lines_above_rows(lines[top:], drop, marks, columns.count(",") + 1)
    top += rows_begin
    if columns is None:
        names, first, delimiter = _above_names(lines, top, marks, commented, source)
    else:
        top, drop = min(top + drop, len(lines)), 0
        names, first, delimiter = _stated_names(lines, top, marks, columns, source)
    check_names(names, source, first, "put names above them, or state --columns")
    first += drop
    if first >= len(lines):
        raise RecordingError(f"{source}: {NOTHING}")
    rows, numbers = _rows(lines, first, delimiter, len(names), source, drop_damaged)
    cells = {name: list(column) for name, column in zip(names, zip(*rows, strict=True), strict=True) if name}
    damaged = len(lines) - first - len(rows)
    table = Table(source, numbers, cells, lines_above=above, is_cut=is_cut, damaged=damaged)
    return _with_points(table) if decimal_comma else table


def _lines_of(path: Path, is_damaged: bool) -> tuple[list[str], bool]:
    """Up to the last row, without what programs put around each line; and whether one that is cut is left out."""
    source = str(path)
    text = text_of(load(path), source, is_damaged=is_damaged)
    limit_rows(text.count("\n"), source)
    lines = without_row_ends(without_brackets(without_arrival(text.rstrip().split("\n")), MOST_ABOVE))
    if not lines:
        raise RecordingError(f"{source}: {NOTHING}")
    # Below the rows comments and blank lines say nothing of them.
    rows_end = next((row for row in range(len(lines), 0, -1) if _is_content(lines[row - 1])), len(lines))
    is_cut = rows_end == len(lines) and _is_cut(text, lines)
    return lines[: rows_end - is_cut], is_cut


def _marks(row: str, decimal_comma: bool) -> list[str]:
    """What may separate columns: where numbers have commas, one does only quotes, and nothing else does."""
    by_comma = not decimal_comma or ('"' in row and not any(mark in row for mark in DELIMITERS.keys() - ","))
    return [mark for mark in DELIMITERS if mark != "," or by_comma]


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
    begins = [{f"{cell}:" for cell in cells if cell} for cells in rows]
    return bool(stated) and any(all(f"{one}:".startswith(tuple(names)) for one in stated) for names in begins)


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


def _rows(
    lines: list[str], first: int, delimiter: str, width: int, source: str, is_damaged: bool
) -> tuple[list[list[str]], Sequence[int]]:
    """Those of `lines` from the `first` on as `width` cells, without what separates the last one from nothing, and
    their numbers; where the log `is_damaged` those that have as many.

    **Raises:** `RecordingError`.
    """
    rows = _split(lines[first:], delimiter, source, first + 1, is_damaged=is_damaged)
    plain = [row[:width] if len(row) == width + 1 and not row[width].strip() else row for row in rows]
    whole, numbers = [len(row) == width for row in plain], range(first + 1, len(lines) + 1)
    if all(whole):
        return plain, numbers
    if not is_damaged:
        raise _width_fault(rows, lines[first:], width, source, first + 1)
    if not any(whole):
        raise RecordingError(f"{source}: no line has the {_counted(width)} of its columns; check their names")
    return list(itertools.compress(plain, whole)), list(itertools.compress(numbers, whole))


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


def _width_fault(rows: list[list[str]], lines: list[str], width: int, source: str, first: int) -> RecordingError:
    """The error about the first of `rows` that has not `width` cells."""
    at = next(at for at, row in enumerate(rows) if len(row) != width)
    line, size = lines[at], len(rows[at])
    what = "a comment or blank line" if not line.strip() or line.startswith(COMMENTS) else _counted(size)
    hint = "correct or delete it"
    if all(len(row) == size for row in rows):
        hint = "all rows are so: name their columns with --columns"
    elif size > width:
        hint = "if commas are decimal marks, export with another separator"
    elif at == 0:
        hint = "correct it, or leave it out with --drop-first"
    return fault(source, first + at, f"{what} where the columns are {width}; {hint}")


def _counted(fields: int) -> str:
    return f"{fields} fields" if fields != 1 else "1 field"
