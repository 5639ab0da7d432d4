"""A log that was saved as a matrix in MATLAB's words (`data = [0 0.1; 1 0.2];`), one row in each line, or as the lines
of one."""

import re

_BEGIN = re.compile(r"(?:[A-Za-z]\w*\s*=\s*)?\[")


def without_brackets(lines: list[str], most_above: int) -> list[str]:
    """`lines` without the brackets about the last ones, the name before them and what ends each row.

    As many lines as before but for empty last ones, so that they keep their numbers; at most `most_above` of them stand
    above the matrix.
    """
    begin = next((row for row, line in enumerate(lines[: most_above + 1]) if _BEGIN.match(line.lstrip())), None)
    if begin is None or not _without_end(lines[-1]).endswith("]") or _has_more(lines[begin:]):
        return lines
    rows = [_without_end(line) for line in lines[begin:]]
    rows[0] = rows[0][rows[0].index("[") + 1 :]
    rows[-1] = _without_end(rows[-1].removesuffix("]"))
    while rows and not rows[-1].strip():
        rows.pop()
    return lines[:begin] + rows


def without_row_ends(lines: list[str]) -> list[str]:
    """`lines` without the semicolon behind each, where something else stands between their numbers (`0,3.2,17;`)."""
    rows = [line for line in lines if not line.startswith(("#", "%"))]
    if not any(map(_is_ended, rows[-2:])) or any(mark in line for line in rows for mark in "[]"):
        return lines
    return [_without_end(line) if _is_ended(line) else line for line in lines]


def _is_ended(line: str) -> bool:
    line = line.rstrip()
    return line.endswith(";") and line.count(";") == 1 and any(mark in line for mark in ",\t ")


def _without_end(line: str) -> str:
    return line.rstrip().removesuffix(";").rstrip()


def _has_more(rows: list[str]) -> bool:
    """Other brackets than the first and the last one: it is something else, such as a list in each line."""
    text = "\n".join(rows)
    return text.count("[") != 1 or text.count("]") != 1
