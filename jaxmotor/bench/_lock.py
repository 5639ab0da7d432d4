"""Locks of files, which Windows does not have: there all but recording works."""

from typing import IO

from jaxmotor.bench._protocol import RecorderError


def lock(file: int | IO[str], wait: bool) -> None:
    """Lock an open `file` until it is closed; where another program holds it, `wait` for that.

    **Raises:** `OSError` where another program holds it and is not to be waited for, `RecorderError` where the system
    has no such locks.
    """
    try:
        import fcntl
    except ImportError as error:
        raise RecorderError(
            "recording needs the file locks of Linux or macOS; on Windows use the Windows Subsystem for Linux"
        ) from error
    fcntl.flock(file, fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB))
