"""Files as text: what a spreadsheet, an editor or a crash may have done to them."""

import contextlib
import re
from collections.abc import Iterator
from pathlib import Path

from jaxmotor._files import read_bytes
from jaxmotor._sentences import shown
from jaxmotor.recording._recording import RecordingError

MAX_BYTES = 400_000_000
"""Larger files are refused unread [byte]."""
MAX_ROWS = 2_000_000
"""Longer files are refused unparsed."""

WORKBOOKS = (b"PK\x03\x04", b"\xd0\xcf\x11\xe0")
"""How Excel's files begin, today's and those of before."""
NUMBER = re.compile(r"[+-]?([0-9]+(\.[0-9]*)?|\.[0-9]+)([eE][+-]?[0-9]+)?")
"""A finite number as text; written so that a cell of any length is read once, whatever follows its digits."""
NO_TEXT = "\N{REPLACEMENT CHARACTER}"
"""In the place of bytes that are no text."""

_SPLIT = "split it into several files or log at a lower rate"


def fault(source: str, line: int, sentence: str, place: str = "line") -> RecordingError:
    """The error for `sentence` about `line` (counted from 1) of the file, or another such `place`."""
    return RecordingError(f"{source}, {place} {line}: {sentence}")


@contextlib.contextmanager
def about_log(source: str) -> Iterator[None]:
    """Errors inside say which log they are about."""
    try:
        yield
    except RecordingError as error:
        if str(error).startswith(source):
            raise
        raise RecordingError(f"{source}: {error}") from error


def load(path: Path, *, limit: int = MAX_BYTES) -> bytes:
    """The bytes of a file.

    **Raises:** `RecordingError` where it is missing, no plain file, empty, or larger than `limit` [byte].
    """
    data = read_bytes(path, limit, "a recording or log", _SPLIT, RecordingError)
    if not data.strip():
        raise RecordingError(f"{path}: the file is empty; record or export it again")
    return data


def text_of(data: bytes, source: str, *, is_damaged: bool = False) -> str:
    """UTF-8 text with line ends as `\\n`; a byte order mark is dropped. Where it `is_damaged` bytes that are no text
    become one character that no number has.

    **Raises:** `RecordingError` for binary data, other encodings, and more than `MAX_ROWS` lines of rows.
    """
    if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        raise RecordingError(f"{source}: the file is UTF-16; save it as UTF-8 text")
    if data.startswith(WORKBOOKS):
        raise RecordingError(f"{source}: an Excel workbook, or another archive; save its sheet as CSV")
    data = data.removeprefix(b"\xef\xbb\xbf")
    if is_damaged:
        text = data.decode("utf-8", errors="replace").replace("\r\r\n", "\n").replace("\r\n", "\n")
        return text.replace("\0", NO_TEXT).replace("\r", NO_TEXT)
    if (zero := data.find(b"\0")) >= 0:
        raise fault(source, _line_at(data, zero), "binary data; give a text file, this one is damaged or another kind")
    try:
        text = data.decode("utf-8")
    except UnicodeDecodeError as error:
        raise fault(
            source, _line_at(data, error.start), "not UTF-8 text; save it as UTF-8, or it is damaged or another kind"
        ) from error
    # A file that was written as text with line ends of its own, and copied as text, has two returns.
    text = text.replace("\r\r\n", "\n").replace("\r\n", "\n")
    if (stray := text.find("\r")) >= 0:
        raise fault(source, text.count("\n", 0, stray) + 1, "a stray carriage return; end lines with a newline")
    return text


def check_names(names: list[str], source: str, line: int, remedy: str) -> None:
    """**Raises:** `RecordingError` where column `names` are numbers, and what the `remedy` is, or one stands twice."""
    doubled = [name for name in names if name and names.count(name) > 1]
    if all(NUMBER.fullmatch(name) for name in names) or any(map(NUMBER.fullmatch, doubled)):
        raise fault(source, line, f"numbers where the column names are expected; {remedy}")
    if doubled:
        raise fault(source, line, f"column {shown(doubled[0])} stands twice; name each column once")


def limit_rows(rows: int, source: str) -> None:
    """**Raises:** `RecordingError` for more than `MAX_ROWS` rows."""
    if rows > MAX_ROWS:
        raise RecordingError(f"{source}: {rows} rows are more than the {MAX_ROWS} that are read; {_SPLIT}")


def _line_at(data: bytes, offset: int) -> int:
    return data.count(b"\n", 0, offset) + 1
