"""Files that are written whole or not at all, and read only where they are plain files of a sensible size."""

import contextlib
import os
import tempfile
from collections.abc import Iterator
from pathlib import Path

from jaxmotor._errors import JaxmotorError


@contextlib.contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """A temporary path in the folder of `path`, renamed to `path` when the block ends without an error.

    **Raises:** `JaxmotorError` where the folder is missing or cannot be written.
    """
    try:
        handle, name = tempfile.mkstemp(prefix=f".{path.name}.", suffix=".part", dir=path.parent)
        os.close(handle)
    except OSError as error:
        raise JaxmotorError(f"{path}: cannot be written ({error.strerror})") from error
    part = Path(name)
    try:
        yield part
        part.chmod(0o666 & ~_umask())
        part.replace(path)
    except OSError as error:
        raise JaxmotorError(f"{path}: cannot be written ({error.strerror})") from error
    finally:
        part.unlink(missing_ok=True)


def read_bytes(path: Path, limit: int, kind: str, remedy: str, error: type[JaxmotorError] = JaxmotorError) -> bytes:
    """The bytes of a file that should be `kind`, such as "a plan"; `remedy` says what to do about a large one.

    **Raises:** `error` where it is missing, no plain file (a folder, a pipe, a device), or larger than `limit` [byte].
    """
    try:
        if path.exists() and not path.is_file():
            raise error(f"{path}: is not a file; give the path of {kind}")
        with path.open("rb") as file:
            size = os.fstat(file.fileno()).st_size
            data = file.read(limit + 1) if size <= limit else b""
    except (OSError, ValueError) as fault:
        reason = fault.strerror if isinstance(fault, OSError) else str(fault)
        raise error(f"{path}: cannot be read ({reason}); check the path and its permissions") from fault
    if max(size, len(data)) > limit:
        much = f"{max(size, len(data)) / 1e6:.3g} MB are more than the {limit / 1e6:.3g} MB that are read"
        raise error(f"{path}: {much}; {remedy}")
    return data


def write_text(path: Path, text: str) -> Path:
    """Write `text` to `path` as UTF-8, whole or not at all; returns `path`."""
    with replacing(path) as part:
        part.write_text(text, encoding="utf-8", newline="\n")
    return path


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
