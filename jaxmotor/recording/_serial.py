"""What serial monitors and plotters add to the lines of a log.

A monitor puts the time at which a line came before it (`12:34:56.789 -> 10,200,35`), a program that prints for a
plotter puts a name before each number (`pwm:200,rpm:35`), one for people its unit behind it, too
(`PWM: 20 %, Speed: 35rpm`).
"""

import re
from collections.abc import Sequence

from jaxmotor._sentences import shown
from jaxmotor.recording._text import NUMBER, fault

_CAME = re.compile(r"\s*[0-9]{1,2}:[0-9]{2}:[0-9]{2}(?:\.[0-9]+)? -> ?")
_BETWEEN = re.compile(r"\s*[,;\t]\s*|\s+")
_PAIR = re.compile(
    rf"\s*(?P<name>[^\W\d_][^:=,;\t]{{0,60}}?)\s*[:=]\s*(?P<number>{NUMBER.pattern})"
    r"(?:\s?(?P<unit>[^\s\d:=,;|]{1,12})(?=[\s,;|]|$))?(?:\s*[,;\t|]\s*|\s+|$)"
)
"""As people read it: a name of any words, a number, and its unit."""


def without_arrival(lines: list[str]) -> list[str]:
    """`lines` without the time of day at which each came: later than it was measured, by nobody knows how much."""
    return [_CAME.sub("", line, count=1) for line in lines] if _CAME.match(lines[-1]) else lines


def labels_of(line: str) -> list[str] | None:
    """The names in a `line` in which one stands before each number; None where that is not so."""
    pairs = _pairs(line)
    return None if pairs is None else [name for name, _, _ in pairs]


def without_labels(lines: Sequence[str], like: str, source: str, first: int, *, is_damaged: bool = False) -> list[str]:
    """`lines`, of which the first one is line `first` of the log, with commas and without names and units, which are
    those of the line `like`. Nothing of a line that has others, where the log `is_damaged`.

    **Raises:** `RecordingError` for such a line elsewhere.
    """
    known = [(name, unit) for name, _, unit in _pairs(like) or []]
    plain = []
    for number, line in enumerate(lines, first):
        # What is no number is told of where numbers are read.
        found = _pairs(line) or [(*_named(cell), "") for cell in _cells(line)]
        if is_damaged and [(name, unit) for name, _, unit in found] != known:
            plain.append("")
            continue
        names = [name for name, _, _ in found]
        if names != [name for name, _ in known]:
            listed = ", ".join(name for name, _ in known)
            raise fault(source, number, f"the names {listed} do not stand before its numbers; correct it")
        for (name, _, unit), (_, usual) in zip(found, known, strict=True):
            if unit != usual:
                raise fault(
                    source, number, f"{name} has the unit {shown(unit)}, and {shown(usual)} elsewhere; correct it"
                )
        plain.append(",".join(cell for _, cell, _ in found))
    return plain


def _pairs(line: str) -> list[tuple[str, str, str]] | None:
    """Names, numbers and the units that are stuck to these; None where a `line` is anything else."""
    found = [_named(cell) for cell in _cells(line)]
    if all(name and NUMBER.fullmatch(number) for name, number in found):
        return [(name, number, "") for name, number in found]
    pairs, at = [], 0
    while at < len(line):
        pair = _PAIR.match(line, at)
        if pair is None:
            return None
        pairs.append((pair["name"], pair["number"], pair["unit"] or ""))
        at = pair.end()
    return pairs or None


def _named(cell: str) -> tuple[str, str]:
    name, _, number = cell.rpartition(":")
    return name, number


def _cells(line: str) -> list[str]:
    return _BETWEEN.split(line.strip().rstrip(",;"))
