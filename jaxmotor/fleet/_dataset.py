"""A data set of many motors as parts that can be read one by one, here or by a worker elsewhere."""

import hashlib
import os
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from jaxmotor._errors import JaxmotorError
from jaxmotor.fleet._parquet import Cut, cuts_of, read_cut
from jaxmotor.recording import Recording, read

FILES_PER_PART = 32
"""Unless told."""
DIAGNOSED_PER_PART = 4
"""Where motors are diagnosed, which takes seconds each."""
TEXT, PARQUET = ".csv", ".parquet"


class Part(NamedTuple):
    """A piece of the data set, small enough to be done at once and lost with little harm."""

    files: tuple[str, ...]
    """Recordings of format 1, one motor each."""
    cut: Cut | None
    """Or the motors that begin in these row groups of a Parquet file."""


class Entry(NamedTuple):
    """One motor of a data set: its recording, or why there is none."""

    motor: str
    source: str
    recording: Recording | None
    problem: str
    """A sentence where `recording` is None, else empty."""


class Dataset(NamedTuple):
    """All parts, in an order that is the same each time."""

    path: str
    parts: tuple[Part, ...]
    identity: str
    """Digest of the files' names, sizes and times of change."""
    files: int
    skipped: tuple[str, ...] = ()
    """What is named like a recording and is none: what it is, in brackets."""


def open_dataset(path: str | os.PathLike[str], files_per_part: int | None = None) -> Dataset:
    """The data set at `path`: a Parquet file, or a folder (with those below it) of .csv and .parquet files.

    A part has `files_per_part` .csv files, `FILES_PER_PART` unless told, or some row groups of a .parquet file.

    **Raises:** `JaxmotorError` where there is nothing to read.
    """
    root = Path(path)
    files, skipped = _files(root)
    parts: list[Part] = []
    texts = [str(file) for file in files if file.suffix == TEXT]
    size = files_per_part or FILES_PER_PART
    for first in range(0, len(texts), size):
        parts.append(Part(tuple(texts[first : first + size]), None))
    for file in files:
        if file.suffix == PARQUET:
            parts += [Part((), cut) for cut in cuts_of(str(file))]
    return Dataset(str(root), tuple(parts), _identity(root, files), len(files), skipped)


def read_part(part: Part) -> Iterator[Entry]:
    """The motors of `part`, each read when it is asked for. What cannot be read is an entry with a sentence."""
    if part.cut is not None:
        yield from (_entry(*found) for found in read_cut(part.cut))
        return
    for file in part.files:
        try:
            recording = read(file)
        except JaxmotorError as error:
            yield Entry(Path(file).stem, file, None, str(error))
        else:
            yield Entry(_name(recording, Path(file).stem), file, recording, "")


def _entry(motor: str, source: str, recording: Recording | str) -> Entry:
    if isinstance(recording, str):
        return Entry(motor, source, None, recording)
    return Entry(motor, source, recording, "")


def _name(recording: Recording, otherwise: str) -> str:
    name = recording.header.get("motor")
    return name if isinstance(name, str) and name.strip() else otherwise


def _files(root: Path) -> tuple[list[Path], tuple[str, ...]]:
    """The recordings below `root`, and what is named like one but is none."""
    try:
        if root.is_file():
            named = [root] if root.suffix in (TEXT, PARQUET) else []
        else:
            # Names that begin with a dot or an underscore are what other programs leave in such folders.
            named = [
                file
                for file in sorted(root.rglob("*"))
                if file.suffix in (TEXT, PARQUET)
                and not any(part.startswith((".", "_")) for part in file.relative_to(root).parts)
            ]
        found = [file for file in named if file.is_file()]
        skipped = tuple(f"{file} ({_what(file)})" for file in named if not file.is_file())
    except OSError as error:
        raise JaxmotorError(f"{root}: cannot be read ({error.strerror}); check the path and its permissions") from error
    if not root.exists():
        raise JaxmotorError(f"{root}: there is no such file or folder; give a data set of recordings")
    if not found:
        raise JaxmotorError(f"{root}: no recordings; a data set is a folder of .csv or .parquet files, or one of them")
    return found, skipped


def _what(file: Path) -> str:
    if file.is_symlink() and not file.exists():
        return "a link to nothing"
    return "a folder" if file.is_dir() else "not a plain file"


def _identity(root: Path, files: list[Path]) -> str:
    digest = hashlib.sha256()
    for file in files:
        about = file.stat()
        name = file.relative_to(root) if file != root else file.name
        digest.update(f"{name}\0{about.st_size}\0{about.st_mtime_ns}\n".encode())
    return digest.hexdigest()[:32]
