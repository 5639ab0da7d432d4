"""Writes TOML, one line per key: the standard library only reads it."""

import datetime
import re
from collections.abc import Mapping
from typing import Any

import numpy as np

from jaxmotor.recording._recording import RecordingError

_BARE = re.compile(r"[A-Za-z0-9_-]+")
# Control characters, line ends of any kind, marks that editors hide, quotes and backslash.
_ESCAPED = re.compile('[\x00-\x1f"\\\\\x7f-\x9f\u2028\u2029\ufeff]')
_SHORT = {"\b": "\\b", "\t": "\\t", "\n": "\\n", "\f": "\\f", "\r": "\\r", '"': '\\"', "\\": "\\\\"}


def toml_lines(values: Mapping[str, Any]) -> list[str]:
    """`key = value` for each of `values`, none of them with a line end; tables are written inline.

    **Raises:** `RecordingError` for a value that TOML cannot hold, naming the key.
    """
    lines = []
    for key, value in values.items():
        try:
            lines.append(f"{_key(key)} = {_value(value)}")
            lines[-1].encode("utf-8")
        except (TypeError, ValueError, RecursionError) as error:
            raise RecordingError(f"header key {key!r}: {error}; give text, a number, true, false or a list") from error
    return lines


def header_lines(values: Mapping[str, Any]) -> list[str]:
    """`values` as the lines of a header; each table of the key `segment` stands under a [[segment]] of its own.

    **Raises:** `RecordingError`, as `toml_lines`.
    """
    tables = values.get("segment", [])
    if not isinstance(tables, list) or not all(isinstance(table, dict) for table in tables):
        return toml_lines(values)
    lines = toml_lines({key: value for key, value in values.items() if key != "segment"})
    return lines + [line for table in tables for line in ("[[segment]]", *toml_lines(table))]


def _key(key: Any) -> str:
    if not isinstance(key, str):
        raise TypeError(f"the key {key!r} is not text")
    return key if _BARE.fullmatch(key) else _string(key)


def _value(value: Any) -> str:
    if isinstance(value, np.generic | np.ndarray):
        value = value.tolist()
    match value:
        case bool():
            return "true" if value else "false"
        case str():
            return _string(value)
        case int() | float():
            return repr(value)
        case datetime.datetime() | datetime.date() | datetime.time():
            return _moment(value)
        case list() | tuple():
            return f"[{', '.join(map(_value, value))}]"
        case Mapping():
            return f"{{{', '.join(f'{_key(key)} = {_value(item)}' for key, item in value.items())}}}"
    raise TypeError(f"a {type(value).__name__} has no TOML form")


def _moment(value: datetime.date | datetime.time) -> str:
    if isinstance(value, datetime.time) and value.tzinfo is not None:
        raise TypeError("a time of day with a time zone has no TOML form")
    return value.isoformat()


def _string(text: str) -> str:
    return '"' + _ESCAPED.sub(_escape, text) + '"'


def _escape(match: re.Match[str]) -> str:
    return _SHORT.get(match[0], f"\\u{ord(match[0]):04x}")
