"""The rows of format 1 as arrays by column, and the line of the first cell that does not fit."""

import io
import re
import warnings

import numpy as np

from jaxmotor._sentences import shown
from jaxmotor.recording._recording import RecordingError
from jaxmotor.recording._text import NUMBER, check_names, fault

MAX_TICK = 20_000_000
"""Ticks of a recording at most."""
INTEGERS = {"segment": 10**6, "tick": MAX_TICK, "duty": 10**12, "count": 2**62}
"""Integer columns and the greatest magnitude that can be meant; differences of counts stay in 64 bits."""
FLOATS = {"time_s": 1e9, "volts": 1e6, "angle_rad": 1e12, "speed_rad_s": 1e9, "supply_mV": 1e9, "current_A": 1e6}
"""Real columns and the greatest magnitude that can be meant."""
SHAFT = ("angle_rad", "speed_rad_s")
SPARSE = ("supply_mV", *SHAFT)
"""Real columns in which `nan` says that nothing was read at that row."""
CHOICES = (("tick", "time_s"), ("duty", "volts"), ("count", "angle_rad", "speed_rad_s"))

_INTEGER = re.compile(r"[+-]?[0-9]+")


def parse_names(line: str, source: str, number: int) -> list[str]:
    """The column names in `line`, the `number`-th of the file.

    **Raises:** `RecordingError` where one is missing, doubled, or excludes another.
    """
    names = [name.strip() for name in line.split(",")]
    check_names(names, source, number, "put a line such as segment,tick,...")
    if "" in names:
        raise fault(source, number, "a column has no name; name each column once")
    if wrong := wrong_names(names):
        raise fault(source, number, wrong)
    return names


def wrong_names(names: list[str]) -> str:
    """What is missing among the column `names`, or excludes each other; empty where nothing does."""
    if "segment" not in names:
        return f"column 'segment' is missing; columns are {', '.join(map(shown, names))}"
    for choice in CHOICES:
        given = [name for name in choice if name in names]
        if not given:
            return f"one of the columns {', '.join(choice)} is needed; none is there"
        if len(given) > 1:
            return f"the columns {' and '.join(given)} exclude each other; keep one"
    return ""


def parse_rows(body: str, names: list[str], source: str, first: int) -> dict[str, np.ndarray]:
    """Columns by name: int64, float64, or text where the format does not know the name.

    `first` is the number of the first line of `body` in the file.

    **Raises:** `RecordingError` for the first line that does not fit.
    """
    try:
        if body.startswith("\n") or "\n\n" in body:
            raise ValueError("a blank line")
        columns = _parse_fast(body, names)
    except (ValueError, OverflowError, Warning):
        raise _first_fault(body, names, source, first) from None
    for name in INTEGERS | FLOATS:
        if name in columns and (bad := beyond(name, columns[name])).any():
            row = int(np.argmax(bad))
            raise fault(source, first + row, _beyond(name, str(columns[name][row])))
    return columns


def beyond(name: str, column: np.ndarray) -> np.ndarray:
    """(n,) whether a cell of the column `name` is more than can be meant, or no number."""
    limit = (INTEGERS | FLOATS)[name]
    # `abs` of the least integer is itself
    bad = ~((column <= limit) & (column >= -limit))
    return bad & ~np.isnan(column) if name in SPARSE else bad


def _parse_fast(body: str, names: list[str]) -> dict[str, np.ndarray]:
    known = [name for name in names if name in INTEGERS or name in FLOATS]
    if known == names:
        return _numbers(io.StringIO(body), known)
    rows = [line.split(",") for line in body.removesuffix("\n").split("\n")]
    cells = dict(zip(names, zip(*rows, strict=True), strict=True))
    numbers = _numbers(io.StringIO("\n".join(map(",".join, zip(*(cells[name] for name in known), strict=True)))), known)
    return {name: numbers[name] if name in numbers else np.array(cells[name], dtype=str) for name in names}


def _numbers(lines: io.StringIO, names: list[str]) -> dict[str, np.ndarray]:
    dtype = np.dtype([(name, np.int64 if name in INTEGERS else np.float64) for name in names])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        table = np.loadtxt(lines, dtype=dtype, delimiter=",", comments=None, ndmin=1)
    return {name: np.ascontiguousarray(table[name]) for name in names}


def _first_fault(body: str, names: list[str], source: str, first: int) -> RecordingError:
    for offset, line in enumerate(body.removesuffix("\n").split("\n")):
        sentence = _line_fault(line, names)
        if sentence:
            return fault(source, first + offset, sentence)
    return RecordingError(f"{source}: the rows are not numbers separated by commas; record or export it again")


def _line_fault(line: str, names: list[str]) -> str:
    if not line.strip():
        return "a blank line between the rows; delete it if no row is missing"
    if line.startswith("#"):
        return "a comment between the rows; move it into the header"
    cells = line.split(",")
    if len(cells) != len(names):
        return f"{len(cells)} fields where the columns are {len(names)} ({', '.join(names)}); correct or delete the row"
    for name, cell in zip(names, cells, strict=True):
        sentence = _cell_fault(name, cell.strip())
        if sentence:
            return sentence
    return ""


def _cell_fault(name: str, cell: str) -> str:
    if name in INTEGERS and not _INTEGER.fullmatch(cell):
        return f"{name} is {shown(cell)}, not a whole number; correct or delete the row"
    if name in INTEGERS and (len(cell) > 25 or abs(int(cell)) > INTEGERS[name]):
        return _beyond(name, cell)
    if name in SPARSE and cell == "nan":
        return ""
    if name in FLOATS and not NUMBER.fullmatch(cell):
        return f"{name} is {shown(cell)}, not a finite number; correct or delete the row"
    return ""


def _beyond(name: str, cell: str) -> str:
    if cell in ("nan", "inf", "-inf"):
        return f"{name} is {cell}, not a finite number; correct or delete the row"
    limit = (INTEGERS | FLOATS)[name]
    return f"{name} is {shown(cell)[1:-1]}, beyond the {limit:g} that can be meant; correct or delete the row"
