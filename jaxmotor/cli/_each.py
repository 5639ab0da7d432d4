"""Several recordings in one command."""

from collections.abc import Callable
from pathlib import Path

import typer

from jaxmotor._errors import JaxmotorError


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
