"""The header of format 1: TOML in `#` lines, its keys checked, every complaint with its line."""

import dataclasses
import datetime
import math
import re
from collections.abc import Mapping
from typing import Any

from jaxmotor._sentences import shown
from jaxmotor.recording._parse_toml import parse_toml
from jaxmotor.recording._recording import KINDS, RecordingError
from jaxmotor.recording._text import fault

FORMAT, SPARSE_SUPPLY = 3, 2
"""The newest, which adds `nan` in `angle_rad` and `speed_rad_s`, where the shaft was not read, and 0 as
`speed_window_rows`; and the one that adds `nan` in `supply_mV`. A file is written in the first format that can hold it.
"""
MAX_SEGMENTS = 10_000
"""Segments of a file at most."""
MAX_HEADER = 4_000_000
"""Longer headers are refused unparsed [character]."""

RANGES = {
    "period_s": (1e-8, 1e4),
    "counts_per_rev": (1e-3, 1e12),
    "duty_full_scale": (1e-6, 1e12),
    "supply_V": (1e-6, 1e6),
    "speed_window_s": (0.0, 1e4),
    "speed_pulses_per_rev": (1e-3, 1e12),
    "duty_delay_s": (0.0, 1e4),
    "start_s": (0.0, 1e10),
}
"""The numbers of the header, with the least and the greatest value that can be meant."""
TEXTS = ("motor", "rig", "firmware", "created", "notes")
NUMBERS = (
    *("period_s", "counts_per_rev", "duty_full_scale", "supply_V"),
    *("speed_window_s", "speed_pulses_per_rev", "duty_delay_s"),
)
OWN_KEYS = (*NUMBERS, "speed_window_rows", "drive", "count_resets")
MOST_WINDOW_ROWS = 1000
"""Rows that a speed may be a mean over."""
OWN_SEGMENT_KEYS = ("kind", "start_s", "at_rest")

_FIRST = re.compile(r"# jaxmotor recording ([0-9]{1,9})[ \t]*")
_SEGMENT = re.compile(r"\s*\[\[\s*[\"']?segment[\"']?\s*\]\]")


@dataclasses.dataclass(frozen=True)
class Header:
    """The parsed header, able to say in which line a key stands."""

    source: str
    lines: list[str]
    """TOML text by line; the first, which names the format, is blank."""
    values: Mapping[str, Any]

    @property
    def segments(self) -> list[dict[str, Any]]:
        """One table per `[[segment]]`."""
        return self.values.get("segment", [])

    def fault(self, key: str, sentence: str, segment: int | None = None) -> RecordingError:
        """The error about `key`, at its line."""
        return fault(self.source, self.line_of(key, segment), sentence)

    def line_of(self, key: str, segment: int | None = None) -> int:
        """Line of `key`, else of its `[[segment]]`, else 1."""
        wanted = re.compile(rf"\s*[\"']?{re.escape(key)}[\"']?\s*=")
        index, found = -1, 1
        for number, line in enumerate(self.lines, 1):
            if _SEGMENT.match(line):
                index += 1
                found = number if index == segment else found
            elif index == (-1 if segment is None else segment) and wanted.match(line):
                return number
        return found


def is_recording(text: str) -> bool:
    """The first line says that this is a recording, of whatever version."""
    return text.startswith("# jaxmotor recording")


def parse_header(lines: list[str], source: str) -> Header:
    """The header in `lines`, each with its `#`; all values checked that need no columns.

    **Raises:** `RecordingError`.
    """
    _check_version(lines[0], source)
    toml = ["", *(line.removeprefix("#").removeprefix(" ") for line in lines[1:])]
    if sum(map(len, toml)) > MAX_HEADER:
        raise RecordingError(f"{source}: the header is longer than {MAX_HEADER} characters; shorten its texts")
    header = Header(source, toml, parse_toml("\n".join(toml), source, "the header"))
    _check_segments(header)
    _check_recording(header)
    return header


def _check_version(first: str, source: str) -> None:
    match = _FIRST.fullmatch(first)
    if match is None:
        raise fault(source, 1, f"{shown(first)} names no format; the line is '# jaxmotor recording 1'")
    version = int(match.group(1))
    if version > FORMAT:
        raise fault(source, 1, f"format {version} is newer than format {FORMAT}, which this jaxmotor reads; update it")
    if version < 1:
        raise fault(source, 1, f"there is no format {version}; the first is format 1")


def _check_recording(header: Header) -> None:
    for key in NUMBERS:
        _check_number(header, header.values, key)
    late, period = header.values.get("duty_delay_s", 0.0), header.values.get("period_s", RANGES["period_s"][1])
    if late >= period:
        sentence = f"duty_delay_s = {late:g} is not below the period of {period:g} s; shift the duties by whole ticks"
        raise header.fault("duty_delay_s", sentence)
    _check_window_rows(header)
    _check_pulses(header)
    if header.values.get("drive", "brake") not in ("brake", "coast"):
        value = shown(str(header.values["drive"]))
        raise header.fault("drive", f"drive = {value} is not known; it is 'brake', 'coast', or left out")
    if not isinstance(header.values.get("count_resets", False), bool):
        raise header.fault("count_resets", "count_resets is true or false")
    for key in TEXTS:
        value = header.values.get(key, "")
        if not isinstance(value, str) and not (key == "created" and isinstance(value, datetime.date)):
            raise header.fault(key, f"{key} is text; put it in quotes")


def _check_window_rows(header: Header) -> None:
    rows = header.values.get("speed_window_rows")
    if rows is None:
        return
    if type(rows) is not int or not 0 <= rows <= MOST_WINDOW_ROWS:
        sentence = f"speed_window_rows is a whole number of rows up to {MOST_WINDOW_ROWS}"
        raise header.fault("speed_window_rows", sentence)
    if not header.values.get("speed_window_s"):
        sentence = "speed_window_rows needs speed_window_s, how long so many rows usually take"
        raise header.fault("speed_window_rows", sentence)


def _check_pulses(header: Header) -> None:
    if "speed_pulses_per_rev" not in header.values:
        return
    if not header.values.get("speed_window_s") or "speed_window_rows" in header.values:
        sentence = (
            "speed_pulses_per_rev needs speed_window_s, over how long speeds usually are, and no speed_window_rows"
        )
        raise header.fault("speed_pulses_per_rev", sentence)


def _check_segments(header: Header) -> None:
    segments = header.values.get("segment", [])
    if not isinstance(segments, list) or not all(isinstance(table, dict) for table in segments):
        raise header.fault("segment", "'segment' is a list of tables; write [[segment]] before each one's keys")
    if len(segments) > MAX_SEGMENTS:
        raise RecordingError(f"{header.source}: {len(segments)} segments are more than {MAX_SEGMENTS}; split the file")
    for index in range(len(segments)):
        _check_segment(header, index)


def _check_segment(header: Header, index: int) -> None:
    table = header.segments[index]
    kind = table.get("kind")
    if kind is None:
        raise header.fault("kind", f"segment {index} has no kind; add one of {', '.join(KINDS)}", index)
    if not isinstance(kind, str) or kind not in KINDS:
        raise header.fault("kind", f"kind = {shown(str(kind))} is not known; it is one of {', '.join(KINDS)}", index)
    if not isinstance(table.get("at_rest", True), bool):
        raise header.fault("at_rest", "at_rest is true or false", index)
    if index > 0 and "start_s" not in table:
        raise header.fault("start_s", f"segment {index} has no start_s; add the time of its first row [s]", index)
    _check_number(header, table, "start_s", index)
    _check_frequency(header, table, index)
    amplitude = table.get("amplitude_V", 0.0)
    if _is_number(amplitude) and not math.isfinite(amplitude):
        raise header.fault("amplitude_V", f"amplitude_V = {amplitude} is not finite; give volts", index)


def _check_number(header: Header, table: Mapping[str, Any], key: str, segment: int | None = None) -> None:
    low, high = RANGES[key]
    value = table.get(key, high)
    if not _is_number(value):
        raise header.fault(key, f"{key} = {shown(str(value))} is not a number", segment)
    if not low <= value <= high:
        sign = "not negative" if low == 0 else "positive"
        raise header.fault(key, f"{key} = {value:.6g} is out of range; it is {sign} and at most {high:g}", segment)


def _check_frequency(header: Header, table: Mapping[str, Any], index: int) -> None:
    frequency = table.get("frequency_Hz", 1.0)
    for value in frequency if isinstance(frequency, list) else [frequency]:
        if not _is_number(value) or not 0 < value <= 1e9:
            raise header.fault("frequency_Hz", f"frequency_Hz = {shown(str(value))} is no frequency; give Hz", index)


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)
