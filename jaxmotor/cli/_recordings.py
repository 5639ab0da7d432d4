"""The recordings that a command is given: each read with JAX loaded, while the command says what it does."""

import contextlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from jaxmotor._errors import JaxmotorError
from jaxmotor._sentences import printable
from jaxmotor.cli._progress import progress

if TYPE_CHECKING:
    from jaxmotor.diagnosis import Progress
    from jaxmotor.recording import Recording

LONGER = "seconds to a minute; the first time up to two"
"""How long a diagnosis lasts on two cores, measured on logs of 3 000 to 18 000 rows."""


def for_each(recordings: list[Path], action: Callable[[Path], None]) -> None:
    """Run `action` on each recording: one that fails does not stop the others, and the exit code is then 1."""
    failed = False
    for path in recordings:
        try:
            action(path)
        except JaxmotorError as error:
            if len(recordings) == 1:
                raise
            typer.echo(f"jaxmotor: {error}", err=True)
            failed = True
    if failed:
        raise typer.Exit(1)


@contextlib.contextmanager
def opened(
    path: Path, threads: bool = False, lasts: str = "seconds; the first time half a minute"
) -> "Iterator[tuple[Recording, Callable[[str], None]]]":
    """The recording at `path`, and the function that says what is done next; `threads` as for `keep_programs`."""
    with progress(f"reading {printable(path.name)}", lasts) as tell:
        from jaxmotor._runtime import keep_programs
        from jaxmotor.recording import read

        recording = read(path)
        tell("loading JAX")
        keep_programs(threads=threads)
        yield recording, tell


def stage(now: "Progress") -> str:
    """How far a diagnosis is, for people."""
    return now.stage if now.done >= now.of else f"{now.done + 1} of {now.of}, {now.stage}"
