"""What serial monitors and plotters add to the lines of a log.

A monitor puts the time at which a line came before it (`12:34:56.789 -> 10,200,35`), a program that prints for a
plotter puts a name before each number (`pwm:200,rpm:35`).
"""

import re
from collections.abc import Sequence

from jaxmotor.recording._text import NUMBER, fault

_CAME = re.compile(r"\s*[0-9]{1,2}:[0-9]{2}:[0-9]{2}(?:\.[0-9]+)? -> ?")
_BETWEEN = re.compile(r"\s*[,;\t]\s*|\s+")


def without_arrival(lines: list[str]) -> list[str]:
    """`lines` without the time of day at which each came: later than it was measured, by nobody knows how much."""
    return [_CAME.sub("", line, count=1) for line in lines] if _CAME.match(lines[-1]) else lines


def labels_of(line: str) -> list[str] | None:
    """The names in a `line` in which one stands before each number; None where that is not so."""
    cells = [cell.rpartition(":") for cell in _cells(line)]
    if all(name and NUMBER.fullmatch(number) for name, _, number in cells):
        return [name for name, _, _ in cells]
    return None


def without_labels(lines: Sequence[str], names: list[str], source: str, first: int) -> list[str]:
    """`lines`, of which the first one is line `first` of the log, with commas and without the `names`.

    **Raises:** `RecordingError` for a line that has other names.
    """
    plain = []
    for number, line in enumerate(lines, first):
        found = [cell.rpartition(":") for cell in _cells(line)]
        if [name for name, _, _ in found] != names:
            raise fault(source, number, f"the names {', '.join(names)} do not stand before its numbers; correct it")
        plain.append(",".join(cell for _, _, cell in found))
    return plain


def _cells(line: str) -> list[str]:
    return _BETWEEN.split(line.strip().rstrip(",;"))
