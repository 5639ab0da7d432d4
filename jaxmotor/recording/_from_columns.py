"""A recording from columns of numbers and header values, checked as a file's are."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from jaxmotor.recording._columns import FLOATS, INTEGERS, beyond, wrong_names
from jaxmotor.recording._header import FORMAT, Header, parse_header
from jaxmotor.recording._read import assemble, check_needs
from jaxmotor.recording._recording import Recording, RecordingError
from jaxmotor.recording._text import fault, limit_rows
from jaxmotor.recording._toml import header_lines


def header_of(values: Mapping[str, Any], source: str) -> Header:
    """The header keys `values` (with the key `segment`, a list of tables) as a checked header.

    **Raises:** `RecordingError`.
    """
    lines = (f"# {line}" for line in header_lines(values))
    return parse_header([f"# jaxmotor recording {FORMAT}", *lines], source)


def from_columns(header: Header, columns: Mapping[str, np.ndarray], source: str) -> Recording:
    """The recording whose rows are `columns`, of those segments of `header` that have rows.

    Lines in messages are rows, counted from 1.

    **Raises:** `RecordingError`, as `read`.
    """
    names = list(columns)
    if wrong := wrong_names(names):
        raise RecordingError(f"{source}: {wrong}")
    limit_rows(len(columns["segment"]), source)
    known = {name: _numbers(name, column, source) for name, column in columns.items() if name in INTEGERS | FLOATS}
    own, known["segment"] = _own_segments(header, known["segment"], source)
    check_needs(own, names)
    try:
        return assemble(own, known, 1)
    except RecordingError as error:
        raise RecordingError(str(error).replace(f"{source}, line ", f"{source}, row ", 1)) from None


def _numbers(name: str, column: np.ndarray, source: str) -> np.ndarray:
    """`column` as int64 or float64. A missing cell is no number."""
    if column.dtype.kind not in "iuf":
        raise RecordingError(f"{source}: column {name!r} holds {column.dtype}, not numbers; export it again")
    bad = beyond(name, column.astype(float))
    if name in INTEGERS and column.dtype.kind == "f":
        bad |= column != np.round(column)
    if bad.any():
        row = int(np.argmax(bad))
        what = f"a {'whole' if name in INTEGERS else 'finite'} number of at most {(INTEGERS | FLOATS)[name]:g}"
        raise fault(source, row + 1, f"{name} is {column[row]}, not {what}; correct it", "row")
    return np.ascontiguousarray(column, np.int64 if name in INTEGERS else np.float64)


def _own_segments(header: Header, segment: np.ndarray, source: str) -> tuple[Header, np.ndarray]:
    """`header` with those segments only that have rows, and `segment` numbered anew."""
    if not segment.size:
        raise RecordingError(f"{source}: there are no rows; record it again")
    used = np.unique(segment)
    if used[0] < 0 or used[-1] >= len(header.segments):
        wrong = int(used[0] if used[0] < 0 else used[-1])
        row = int(np.argmax(segment == wrong))
        sentence = f"segment {wrong} is not in the header ({len(header.segments)} there); add it"
        raise fault(source, row + 1, sentence, "row")
    tables = [header.segments[index] for index in used]
    own = Header(source, [], {**header.values, "segment": tables})
    return own, np.searchsorted(used, segment)
