"""A log that was saved as a matrix in MATLAB's words (`data = [0 0.1; 1 0.2];`), one row in each line."""

import re

_BEGIN = re.compile(r"\s*(?:[A-Za-z]\w*\s*=)?\s*\[")
_END = re.compile(r"\]\s*;?\s*$")
_ROW_END = re.compile(r"\s*;\s*$")


def without_brackets(lines: list[str], most_above: int) -> list[str]:
    """`lines` without the brackets about the last ones, the name before them and what ends each row.

    As many lines as before but for empty last ones, so that they keep their numbers; at most `most_above` of them stand
    above the matrix.
    """
    begin = next((row for row, line in enumerate(lines[: most_above + 1]) if _BEGIN.match(line)), None)
    if begin is None or not _END.search(lines[-1]) or _has_more(lines[begin:]):
        return lines
    rows = [_ROW_END.sub("", line) for line in lines[begin:]]
    rows[0] = _BEGIN.sub("", rows[0], count=1)
    rows[-1] = _ROW_END.sub("", _END.sub("", rows[-1]))
    while rows and not rows[-1].strip():
        rows.pop()
    return lines[:begin] + rows


def _has_more(rows: list[str]) -> bool:
    """Other brackets than the first and the last one: it is something else, such as a list in each line."""
    text = "\n".join(rows)
    return text.count("[") != 1 or text.count("]") != 1
