"""`jaxmotor diagnose`: what the linear model of each recording gets wrong, why, and what to do about it."""

import json as json_module
from pathlib import Path
from typing import Annotated, Any

import typer

from jaxmotor.cli._folder import check_names, made_folder
from jaxmotor.cli._recordings import LONGER, for_each, opened, stage


def diagnose_command(
    recordings: Annotated[list[Path], typer.Argument(metavar="REC.csv...", help="Recordings to diagnose.")],
    json: Annotated[bool, typer.Option("--json", help="One JSON object per recording, one per line.")] = False,
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", metavar="DIR", help="Write figures, the extended model and plans here."),
    ] = None,
    effects: Annotated[
        str | None, typer.Option(metavar="NAMES", help="Look for no others (coulomb_friction,transport_delay).")
    ] = None,
    exclude: Annotated[str | None, typer.Option(metavar="NAMES", help="Effects that are not looked for.")] = None,
    seed: Annotated[int, typer.Option(min=0, metavar="N", help="Draws the shuffles that chance is told by.")] = 0,
) -> None:
    """Show what the linear model of each recording gets wrong, name the cause, extend the model, measure the gain."""
    if effects is not None and not _names(effects):
        raise typer.BadParameter("--effects names no effect; write names, such as coulomb_friction,transport_delay")
    if output is not None:
        check_names(recordings)
    chosen = {"effects": None if effects is None else _names(effects), "exclude": _names(exclude or "")}
    with made_folder(output):
        for_each(recordings, lambda path: _one(path, json, output, {"seed": seed, **chosen}))


def _names(text: str) -> list[str]:
    return [name.strip() for name in text.split(",") if name.strip()]


def _one(path: Path, json: bool, output: Path | None, options: dict[str, Any]) -> None:
    with opened(path, threads=True, lasts=LONGER) as (recording, tell):
        from jaxmotor.cli._kept import keep_diagnosis
        from jaxmotor.cli._story import diagnosis_text
        from jaxmotor.diagnosis import diagnose, to_json

        diagnosis = diagnose(recording, **options, on_progress=lambda now: tell(stage(now)))
        keep_diagnosis(diagnosis, recording, options)
        written = []
        if output is not None:
            from jaxmotor.present import write_diagnosis

            tell("writing figures")
            written = write_diagnosis(diagnosis, recording, output)
    typer.echo(json_module.dumps(to_json(diagnosis)) if json else diagnosis_text(diagnosis, written))
