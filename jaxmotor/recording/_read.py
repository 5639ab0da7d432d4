"""Reads formats 1 to 3: all of the file, or one sentence that says what is wrong in which line."""

import itertools
import os
from typing import Any

import numpy as np

from jaxmotor._arguments import path_of, taken
from jaxmotor._sentences import shown
from jaxmotor.recording._columns import FLOATS, INTEGERS, SHAFT, parse_names, parse_rows
from jaxmotor.recording._header import NUMBERS, OWN_KEYS, OWN_SEGMENT_KEYS, Header, is_recording, parse_header
from jaxmotor.recording._recording import Recording, RecordingError, Segment
from jaxmotor.recording._supply import supplied
from jaxmotor.recording._text import fault, limit_rows, load, text_of
from jaxmotor.recording._unread import filled

_FIELDS = ("tick", "time_s", "duty", "volts", "count", "angle_rad", "speed_rad_s", "current_A")
_NEEDS = {
    "tick": (("period_s", "the time from one tick to the next [s]"),),
    "count": (("counts_per_rev", "the encoder counts per turn of the output shaft"),),
    "duty": (("duty_full_scale", "the duty that means the whole supply"), ("supply_V", "the supply voltage [V]")),
}


def read(path: str | os.PathLike[str]) -> Recording:
    """The recording in the file at `path`.

    **Raises:** `RecordingError` with file, line and remedy for anything that does not fit the format.
    """
    path = path_of(path, "the path of a recording")
    return parse(load(path), str(path))


def recording_of(given: Recording | str | os.PathLike[str]) -> Recording:
    """`given`, or what stands in the file of that path. **Raises:** `JaxmotorError`, also for anything else."""
    return taken(given, Recording, "a recording (a Recording, or the path of its file)", read)


def parse(data: bytes, source: str) -> Recording:
    """The recording in `data`, the bytes of a file named `source`.

    **Raises:** `RecordingError`, as `read`.
    """
    start = data.removeprefix(b"\xef\xbb\xbf")[:200].decode("utf-8", "replace")
    text = text_of(data, source)
    if not is_recording(start):
        raise RecordingError(
            f"{source}: not a recording (line 1 is {shown(text.split(chr(10), 1)[0])}); "
            "bring a log from elsewhere in with `jaxmotor import`"
        )
    limit_rows(text.count("\n"), source)
    lines, rest = _split_header(text)
    header = parse_header(lines, source)
    _check_end(text, source)
    line = len(lines) + 1
    names_line, _, body = rest.partition("\n")
    if not names_line.strip():
        raise fault(source, line, "no line of column names after the header; the file is cut off or was edited")
    names = parse_names(names_line, source, line)
    check_needs(header, names)
    body = _without_trailing_blanks(body)
    if not body:
        raise fault(source, line, "no rows after the column names; record it again")
    columns = parse_rows(body, names, source, line + 1)
    return assemble(header, columns, line + 1)


def _split_header(text: str) -> tuple[list[str], str]:
    lines, position = [], 0
    while text.startswith("#", position):
        end = text.find("\n", position)
        end = len(text) if end < 0 else end
        lines.append(text[position:end])
        position = end + 1
    return lines, text[position:]


def _check_end(text: str, source: str) -> None:
    if not text.endswith("\n"):
        sentence = "the last line is cut off (it does not end); delete it, or end it with a newline if it is whole"
        raise fault(source, text.count("\n") + 1, sentence)


def _without_trailing_blanks(body: str) -> str:
    filled = len(body.rstrip())
    return body[: body.find("\n", filled) + 1] if filled else ""


def check_needs(header: Header, names: list[str]) -> None:
    """**Raises:** `RecordingError` where a column in `names` needs a header key that is not there."""
    for column, keys in _NEEDS.items():
        for key, meaning in keys:
            if column in names and key not in header.values:
                raise RecordingError(
                    f"{header.source}: column {column!r} needs the header key {key}; add '# {key} = ...', {meaning}"
                )
    if "time_s" in names and "period_s" in header.values:
        raise header.fault("period_s", "period_s belongs to the column 'tick', but 'time_s' is there; remove one")


def assemble(header: Header, columns: dict[str, np.ndarray], first: int) -> Recording:
    """The recording of checked `columns`, whose first row is line `first` of the file."""
    bounds = _bounds(header, columns["segment"], first)
    _check_time(header, columns, bounds, first)
    _check_duty(header, columns, first)
    own = {key: header.values[key] for key in OWN_KEYS if key in header.values}
    own |= {key: float(own[key]) for key in NUMBERS if key in own}
    rest = {key: value for key, value in header.values.items() if key not in OWN_KEYS and key != "segment"}
    fields = {name: columns[name] for name in _FIELDS if name in columns} | _si(own, columns)
    fields |= _as_filled(header, columns, bounds, first)
    extra = {name: columns[name] for name in columns if name not in INTEGERS | FLOATS}
    segments = tuple(
        _segment(table, fields, extra, slice(bounds[index], bounds[index + 1]))
        for index, table in enumerate(header.segments)
    )
    return supplied(Recording(segments=segments, source=header.source, header=rest, **own))


def _bounds(header: Header, segment: np.ndarray, first: int) -> np.ndarray:
    """(segments + 1,) rows at which the segments begin, and the end."""
    changes = np.flatnonzero(np.diff(segment)) + 1
    found = segment[np.concatenate([[0], changes])]
    starts = np.concatenate([[0], changes])
    for expected, (index, row) in enumerate(zip(found.tolist(), starts.tolist(), strict=True)):
        if not 0 <= index < len(header.segments):
            sentence = f"segment {index} has no [[segment]] in the header ({len(header.segments)} there); add it"
            raise fault(header.source, first + row, sentence)
        if index > expected:
            raise header.fault("", f"segment {expected} has no rows; delete its [[segment]] or find them", expected)
        if index < expected:
            sentence = f"segment {index} comes after segment {found[expected - 1]}; keep each segment's rows together"
            raise fault(header.source, first + row, f"{sentence}, in order")
    if len(found) < len(header.segments):
        raise header.fault("", f"segment {len(found)} has no rows; delete its [[segment]] or find them", len(found))
    return np.concatenate([starts, [len(segment)]])


def _check_time(header: Header, columns: dict[str, np.ndarray], bounds: np.ndarray, first: int) -> None:
    name = "tick" if "tick" in columns else "time_s"
    time = columns[name]
    if (time[bounds[:-1]] < 0).any():
        row = int(bounds[:-1][time[bounds[:-1]] < 0][0])
        raise fault(header.source, first + row, f"{name} is {time[row]}; it counts up from the segment's start, 0")
    step = np.diff(time)
    step[bounds[1:-1] - 1] = 1
    if (step <= 0).any():
        row = int(np.argmax(step <= 0)) + 1
        what = "stands twice" if step[row - 1] == 0 else f"runs backwards, from {time[row - 1]} to {time[row]}"
        raise fault(header.source, first + row, f"{name} {time[row]} {what}; correct or delete the row")


def _check_duty(header: Header, columns: dict[str, np.ndarray], first: int) -> None:
    if "duty" in columns:
        full = header.values["duty_full_scale"]
        beyond = np.abs(columns["duty"]) > full
        if beyond.any():
            row = int(np.argmax(beyond))
            sentence = f"duty is {columns['duty'][row]}, beyond the full scale of {full}; correct it or duty_full_scale"
            raise fault(header.source, first + row, sentence)


def _as_filled(header: Header, columns: dict[str, np.ndarray], bounds: np.ndarray, first: int) -> dict[str, np.ndarray]:
    """The shaft's column without NaN, and in `unread` where it had them; empty where nothing is missing."""
    name = next((name for name in SHAFT if name in columns and np.isnan(columns[name]).any()), None)
    if name is None:
        return {}
    column, unread = columns[name].copy(), np.isnan(columns[name])
    time = columns["tick" if "tick" in columns else "time_s"]
    for index, (begin, end) in enumerate(itertools.pairwise(bounds.tolist())):
        if unread[begin:end].all():
            raise fault(header.source, first + begin, f"segment {index} has no {name} at all; leave the segment out")
        column[begin:end] = filled(column[begin:end], time[begin:end], unread[begin:end])
    return {name: column, "unread": unread}


def _si(own: dict[str, Any], columns: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    si = {}
    if "tick" in columns:
        si["time_s"] = columns["tick"] * own["period_s"]
    if "duty" in columns:
        si["volts"] = columns["duty"] / own["duty_full_scale"] * own["supply_V"]
    if "supply_mV" in columns:
        si["supply_V"] = columns["supply_mV"] / 1000
    return si


def _segment(
    table: dict[str, Any], fields: dict[str, np.ndarray], extra: dict[str, np.ndarray], rows: slice
) -> Segment:
    return Segment(
        kind=table["kind"],
        start_s=float(table.get("start_s", 0.0)),
        at_rest=table.get("at_rest", True),
        parameters={key: value for key, value in table.items() if key not in OWN_SEGMENT_KEYS},
        extra={name: column[rows] for name, column in extra.items()},
        **{name: column[rows] for name, column in fields.items()},  # pyright: ignore[reportArgumentType]
    )
