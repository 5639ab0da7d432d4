"""Writes recordings, so that reading them gives the same bit for bit, in the first format that can hold them."""

import os
import re
from typing import Any

import numpy as np

from jaxmotor._arguments import path_of, taken
from jaxmotor._files import write_text
from jaxmotor.recording._columns import FLOATS, INTEGERS
from jaxmotor.recording._header import FORMAT, OWN_KEYS, OWN_SEGMENT_KEYS, SPARSE_SUPPLY
from jaxmotor.recording._read import parse
from jaxmotor.recording._recording import Recording, RecordingError, Segment
from jaxmotor.recording._toml import header_lines

_UNSAFE = re.compile("[,\r\n\0]")


def write(recording: Recording, path: str | os.PathLike[str]) -> None:
    """Write `recording` to `path`, whole or not at all; an existing file is replaced.

    Where ticks or duty are given, they are what is written: seconds and volts follow from them when read.

    **Raises:** `RecordingError` for a recording that could not be read back, `JaxmotorError` where the folder
    cannot be written.
    """
    path = path_of(path, "a path to write to")
    text = to_text(taken(recording, Recording, "a Recording"))
    _check_same(recording, parse(text.encode("utf-8"), str(path)), str(path))
    write_text(path, text)


def to_text(recording: Recording) -> str:
    """The recording as a file. Its values are not checked; `write` does that.

    **Raises:** `RecordingError` for what the format has no place for.
    """
    if not recording.segments:
        raise RecordingError(f"{recording.source}: the recording has no segments; nothing can be written")
    tables = [_columns(index, segment) for index, segment in enumerate(recording.segments)]
    names = list(tables[0])
    for index, table in enumerate(tables):
        if list(table) != names:
            raise RecordingError(
                f"{recording.source}: segment {index} has the columns {', '.join(table)} where segment 0 has "
                f"{', '.join(names)}; log the same ones throughout"
            )
    header = (f"# {line}" for line in header_lines(values_of(recording)))
    lines = [f"# jaxmotor recording {_version(recording)}", *header, _names(recording, names)]
    for table in tables:
        lines += map(",".join, zip(*table.values(), strict=True))
    return "\n".join(lines) + "\n"


def values_of(recording: Recording) -> dict[str, Any]:
    """The header of `recording`: its keys, and the key `segment` with a table for each segment.

    **Raises:** `RecordingError` for a key that is the format's own.
    """
    clash = {"segment", *OWN_KEYS} & set(recording.header)
    if clash:
        raise RecordingError(f"{recording.source}: header key {min(clash)!r} is the format's own; rename it")
    own = {key: getattr(recording, key) for key in OWN_KEYS}
    own = {key: value for key, value in own.items() if value is not None and value is not False}
    tables = [_segment_values(recording, index, segment) for index, segment in enumerate(recording.segments)]
    return {**own, **recording.header, "segment": tables}


def columns_of(segment: Segment) -> dict[str, np.ndarray]:
    """The columns that hold `segment`, but for its number and for those that the format does not know."""
    columns = {
        "tick": segment.tick,
        "time_s": segment.time_s if segment.tick is None else None,
        "duty": segment.duty,
        "volts": segment.volts if segment.duty is None else None,
        "count": segment.count,
        "angle_rad": _as_read(segment, segment.angle_rad),
        "speed_rad_s": _as_read(segment, segment.speed_rad_s),
        "supply_mV": None if segment.supply_V is None else _milli(segment.supply_V),
        "current_A": segment.current_A,
    }
    return {name: column for name, column in columns.items() if column is not None}


def _as_read(segment: Segment, column: np.ndarray | None) -> np.ndarray | None:
    """`column`, NaN where nothing was read."""
    return column if column is None or segment.unread is None else np.where(segment.unread, np.nan, column)


def _version(recording: Recording) -> int:
    """The first format that can hold `recording`."""
    unread = any(segment.unread is not None and segment.unread.any() for segment in recording.segments)
    if unread or recording.speed_window_rows == 0:
        return FORMAT
    supplies = [segment.supply_V for segment in recording.segments if segment.supply_V is not None]
    return SPARSE_SUPPLY if any(np.isnan(supply).any() for supply in supplies) else 1


def _segment_values(recording: Recording, index: int, segment: Segment) -> dict[str, Any]:
    clash = set(OWN_SEGMENT_KEYS) & set(segment.parameters)
    if clash:
        raise RecordingError(f"{recording.source}: segment {index} has {min(clash)!r} as a parameter; rename it")
    rest = {} if segment.at_rest else {"at_rest": False}
    return {"kind": segment.kind, "start_s": segment.start_s, **rest, **segment.parameters}


def _names(recording: Recording, names: list[str]) -> str:
    for name in names:
        if _UNSAFE.search(name) or name != name.strip() or not name or name.startswith("#"):
            raise RecordingError(f"{recording.source}: a column cannot be called {name!r}; rename it")
    return ",".join(names)


def _columns(index: int, segment: Segment) -> dict[str, list[str]]:
    """Cells by column."""
    clash = set(segment.extra) & (set(INTEGERS) | set(FLOATS))
    if clash:
        raise RecordingError(f"segment {index}: the extra column {min(clash)!r} is the format's own; rename it")
    table = {"segment": [str(index)] * len(segment)}
    table |= {name: _cells(name, column) for name, column in columns_of(segment).items()}
    table |= {name: _text_cells(name, column) for name, column in segment.extra.items()}
    if len({len(cells) for cells in table.values()}) > 1:
        lengths = ", ".join(f"{name} {len(cells)}" for name, cells in table.items())
        raise RecordingError(f"segment {index}: the columns differ in length ({lengths}); give one value per row")
    return table


def _cells(name: str, column: np.ndarray) -> list[str]:
    if name in INTEGERS and not np.issubdtype(column.dtype, np.integer):
        raise RecordingError(f"column {name!r} holds {column.dtype}; give whole numbers")
    return list(map(str if name in INTEGERS else repr, column.tolist()))


def _text_cells(name: str, column: np.ndarray) -> list[str]:
    cells = list(map(str, column.tolist()))
    for cell in cells:
        if _UNSAFE.search(cell):
            raise RecordingError(f"column {name!r} holds {cell[:40]!r}; a cell has no comma and no line end")
    return cells


def _milli(values: np.ndarray) -> np.ndarray:
    """Thousandfold in as few digits as give `values` again when divided by 1000.

    Where no number does (2 % of those that never were millivolts), it is the nearest.
    """
    milli = np.asarray(values * 1000.0)
    candidates = [*(np.round(milli, digits) for digits in range(12)), milli]
    candidates += [np.nextafter(milli, -np.inf), np.nextafter(milli, np.inf)]
    return np.select([candidate / 1000 == values for candidate in candidates], candidates, milli)


def _check_same(given: Recording, again: Recording, source: str) -> None:
    """Seconds and volts beside ticks and duty are not written; they must follow from them."""
    for index, (segment, copy) in enumerate(zip(given.segments, again.segments, strict=True)):
        for name in ("time_s", "volts"):
            if not np.allclose(getattr(segment, name), getattr(copy, name), rtol=1e-9, atol=1e-12):
                logged = "tick and period_s" if name == "time_s" else "duty, duty_full_scale and the supply"
                raise RecordingError(f"{source}: {name} of segment {index} does not follow from {logged}; correct one")
