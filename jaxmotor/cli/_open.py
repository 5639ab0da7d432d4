"""A recording read and JAX loaded, while the command says what it does."""

import contextlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from jaxmotor._sentences import printable
from jaxmotor.cli._progress import progress

if TYPE_CHECKING:
    from jaxmotor.recording import Recording


@contextlib.contextmanager
def opened(path: Path, threads: bool = False) -> "Iterator[tuple[Recording, Callable[[str], None]]]":
    """The recording at `path`, and the function that says what is done next; `threads` as for `prepare_jax`."""
    with progress(f"reading {printable(path.name)}") as tell:
        from jaxmotor.cli._runtime import prepare_jax
        from jaxmotor.recording import read

        recording = read(path)
        tell("loading JAX")
        prepare_jax(threads=threads)
        yield recording, tell
