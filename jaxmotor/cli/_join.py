"""`jaxmotor join`: several recordings of one motor become one."""

from pathlib import Path
from typing import Annotated

import typer

from jaxmotor.cli._folder import check_free


def join_command(
    recordings: Annotated[list[Path], typer.Argument(metavar="REC.csv...", help="Recordings of one motor.")],
    output: Annotated[Path, typer.Option("-o", "--output", help="Recording to write.")],
    force: Annotated[bool, typer.Option("--force", help="Replace an existing output.")] = False,
) -> None:
    """Put recordings of one motor on one rig end to end, to explain them together."""
    check_free(output, force)

    from jaxmotor.recording import join, read, write

    joined = join([read(path) for path in recordings])
    write(joined, output)
    rows = sum(map(len, joined.segments))
    typer.echo(f"{output}: {rows} rows in {len(joined.segments)} segments of {len(recordings)} recordings")
