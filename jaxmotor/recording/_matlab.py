"""Reads the variables of a MATLAB file as the columns of a log.

Columns are the vectors of numbers, in variables, in the fields of structures, and in the rows or columns of a matrix,
as scripts, Simulink's "To File" and its structures with time save them. SciPy reads the file. Nothing in it is run.
"""

import io
import warnings
import zlib
from collections import Counter
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from jaxmotor._sentences import sentence
from jaxmotor.recording._recording import RecordingError
from jaxmotor.recording._table import Table
from jaxmotor.recording._text import MAX_BYTES, limit_rows, load

HEADER = 128
"""Bytes before the first variable."""
COMPRESSED = 15
"""Type of a variable that is compressed."""
MOST_NAMES = 1000
"""Columns that a file may have."""
CHUNK = 1 << 20
"""Bytes that are expanded at a time."""
SAVE = "save vectors of one length, such as with save('log.mat', 't', 'u', 'y', '-v7')"


def is_matlab(path: Path) -> bool:
    """By its name."""
    return path.suffix.lower() == ".mat"


def read_matlab(path: Path, *, drop: int = 0, stated: Iterable[str] = ()) -> Table:
    """The vectors of one length of the file at `path`, without their first `drop` rows: as long as those that are
    `stated` (`COL` or `COL:UNIT`), or else as most are.

    A column is named as its variable or field, where several fields have one name with the structures that they are in
    (`left.speed`), and in a matrix by its number (`ans(2)`).

    **Raises:** `RecordingError` where it is no such file, is damaged, too large, or has no such vectors.
    """
    source = str(path)
    found = list(_vectors(_variables(load(path), source), ""))
    if not found:
        raise RecordingError(f"{source}: there is no vector of numbers (timeseries and tables are objects); {SAVE}")
    wanted = _stated(dict(found) | _named(found), stated)
    lengths = {len(vector): name for name, vector in wanted.items()}
    if len(lengths) > 1:
        each = ", ".join(f"{name} has {length}" for length, name in lengths.items())
        raise RecordingError(f"{source}: of the columns {each} rows; {SAVE}")
    [(rows, _)] = Counter(list(lengths) or [len(vector) for _, vector in found]).most_common(1)
    columns = _named([one for one in found if len(one[1]) == rows]) | wanted
    limit_rows(rows, source)
    if rows <= drop:
        raise RecordingError(f"{source}: of its {rows} rows none is left; {SAVE}")
    cells = {name: vector[drop:].astype(str).tolist() for name, vector in columns.items()}
    return Table(source, range(drop + 1, rows + 1), cells, "row")


def _variables(data: bytes, source: str) -> dict[str, Any]:
    """By name; structures as dicts."""
    from scipy.io import loadmat

    if data.startswith(b"MATLAB 7.3"):
        raise RecordingError(f"{source}: version 7.3 of MATLAB's files is not read; {SAVE}")
    if data.startswith(b"MATLAB") and _expands_beyond(data, MAX_BYTES):
        raise RecordingError(f"{source}: its variables are more than {MAX_BYTES} bytes; {SAVE}")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            found = loadmat(io.BytesIO(data), simplify_cells=True)
    except Exception as error:  # SciPy raises what it meets in a damaged file
        raise RecordingError(f"{source}: no file of MATLAB, or damaged ({sentence(str(error), 80)}); {SAVE}") from error
    return {name: value for name, value in found.items() if not name.startswith("__")}


def _expands_beyond(data: bytes, limit: int) -> bool:
    """What is compressed in a file of version 5 is longer than `limit` [byte]."""
    order = "big" if data[HEADER - 2 : HEADER] == b"MI" else "little"
    at, total = HEADER, 0
    while at + 8 <= len(data) and total <= limit:
        kind, size = (int.from_bytes(data[at + k : at + k + 4], order) for k in (0, 4))
        at += 8
        total += _expanded(data[at : at + size], limit - total) if kind == COMPRESSED else size
        at += size
    return total > limit


def _expanded(data: bytes, most: int) -> int:
    """Bytes that `data` expands to; counted no further than `most`."""
    expand, total, rest = zlib.decompressobj(), 0, data
    try:
        while rest and total <= most and not expand.eof:
            total += len(expand.decompress(rest, CHUNK))
            rest = expand.unconsumed_tail
    except zlib.error:  # whoever reads it says so
        return total
    return total


def _vectors(value: Any, name: str) -> Iterator[tuple[str, np.ndarray]]:
    """Each vector of two numbers or more in `value`, with its path from `name` on."""
    if isinstance(value, dict):
        for key, inner in value.items():
            yield from _vectors(inner, f"{name}.{key}" if name else key)
    elif isinstance(value, list | np.ndarray) and getattr(value, "dtype", np.dtype(object)).kind == "O":
        for number, inner in enumerate(list(value)[:MOST_NAMES], 1):
            if isinstance(inner, dict):
                yield from _vectors(inner, f"{name}({number})")
    elif isinstance(value, np.ndarray) and value.dtype.kind in "iufb" and value.size > 1:
        yield from _columns(value, name)


def _columns(value: np.ndarray, name: str) -> Iterator[tuple[str, np.ndarray]]:
    value = value.squeeze()
    value = value.astype(int) if value.dtype.kind == "b" else value
    if value.ndim == 1:
        yield name, value
    elif value.ndim == 2 and min(value.shape) <= MOST_NAMES:
        rows = value if value.shape[0] < value.shape[1] else value.T
        yield from ((f"{name}({number})", row) for number, row in enumerate(rows, 1))


def _stated(vectors: dict[str, np.ndarray], stated: Iterable[str]) -> dict[str, np.ndarray]:
    """Those of `vectors` that are `stated`, as `COL` or `COL:UNIT`."""
    return {name: one for name, one in vectors.items() if any(f"{text}:".startswith(f"{name}:") for text in stated)}


def _named(found: list[tuple[str, np.ndarray]]) -> dict[str, np.ndarray]:
    """By the last part of each name, where no other ends so."""
    last = Counter(name.rpartition(".")[2] for name, _ in found)
    return {short if last[short := name.rpartition(".")[2]] == 1 else name: vector for name, vector in found}
