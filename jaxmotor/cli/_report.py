"""`jaxmotor report`: all that is found out of a motor, or of a fleet, as one HTML page."""

from pathlib import Path
from typing import Annotated

import typer

from jaxmotor._sentences import printable
from jaxmotor.cli._recordings import LONGER, opened, stage


def report_command(
    source: Annotated[
        Path, typer.Argument(metavar="REC.csv|RESULTS.parquet", help="A recording, or the results of a fleet.")
    ],
    output: Annotated[Path, typer.Option("-o", "--output", metavar="DIR", help="Write NAME.html here.")],
    seed: Annotated[int, typer.Option(min=0, metavar="N", help="Draws shuffles, parameters and encoder offsets.")] = 0,
    anew: Annotated[
        bool, typer.Option("--anew", help="Diagnose again, also what jaxmotor diagnose has just diagnosed.")
    ] = False,
) -> None:
    """Tell the story of a recording, or of a fleet's results, in one HTML page that needs nothing else."""
    from jaxmotor.cli._folder import made_folder

    if source.suffix == ".parquet":
        from jaxmotor.present.report import write_fleet_page

        with made_folder(output):
            typer.echo(printable(f"wrote {write_fleet_page(source, output)}"))
        return
    with made_folder(output), opened(source, threads=True, lasts=LONGER) as (recording, tell):
        from jaxmotor.cli._kept import DEFAULT, kept_diagnosis
        from jaxmotor.present.report import story, write_report

        kept = None if anew else kept_diagnosis(recording, {"seed": seed, **DEFAULT})
        diagnosis = None if kept is None else kept[0]
        found = story(recording, seed=seed, diagnosis=diagnosis, on_progress=lambda now: tell(stage(now)))
        tell("drawing the page")
        path = write_report(found, source, output)
    if kept is not None:
        typer.echo(printable(f"the diagnosis is that of jaxmotor diagnose, kept in {kept[1]}; --anew makes it again"))
    typer.echo(f"{found.diagnosis}\n{printable(f'wrote {path}')}")
