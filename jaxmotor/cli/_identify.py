"""`jaxmotor identify`: gain and pole of each recording."""

import json as json_module
from pathlib import Path
from typing import Annotated, Literal

import typer

from jaxmotor.cli._folder import check_names, made_folder
from jaxmotor.cli._recordings import for_each, opened

Method = Literal["exact", "paper"]
Order = Literal["first", "second"]


def identify_command(
    recordings: Annotated[list[Path], typer.Argument(metavar="REC.csv...", help="Recordings to identify.")],
    method: Annotated[Method, typer.Option(help="exact, or as the paper published it.")] = "exact",
    model: Annotated[Order, typer.Option(help="second adds the electrical time constant.")] = "first",
    hold_out: Annotated[
        str | None,
        typer.Option(metavar="WHICH", help="Segments to leave for validation: numbers, ranges or kinds (3,7-9,step)."),
    ] = None,
    resistance: Annotated[float | None, typer.Option(metavar="OHM", help="Measured, for the check of eq. 10.")] = None,
    inductance: Annotated[
        float | None, typer.Option(metavar="HENRY", help="Measured, for the check of eq. 10.")
    ] = None,
    json: Annotated[bool, typer.Option("--json", help="One JSON object per recording, one per line.")] = False,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="DIR", help="Write the model and figures here.")
    ] = None,
) -> None:
    """Identify the linear motor behind each recording: gain, pole, and how sure."""
    if (resistance is None) != (inductance is None):
        raise typer.BadParameter("--resistance and --inductance belong together")
    from jaxmotor.recording import names_segments

    if hold_out is not None and not names_segments(hold_out):
        raise typer.BadParameter(f"{hold_out!r} names no segments; write numbers, ranges or kinds, such as 3,7-9,step")
    if output is not None:
        check_names(recordings)
    with made_folder(output):
        for_each(recordings, lambda path: _one(path, method, model, hold_out, resistance, inductance, json, output))


def _one(
    path: Path,
    method: Method,
    model: Order,
    hold_out: str | None,
    resistance: float | None,
    inductance: float | None,
    json: bool,
    output: Path | None,
) -> None:
    with opened(path) as (recording, tell):
        from jaxmotor.estimate import electrical_check, identify, to_json
        from jaxmotor.recording import chosen_segments

        tell("linear fit")
        held_out = chosen_segments(recording, hold_out)
        fit = identify(recording, method=method, model=model, hold_out=held_out)
        extra = []
        if resistance is not None and inductance is not None:
            extra.append(electrical_check(recording, resistance, inductance))
        written = []
        if output is not None:
            from jaxmotor.present import write_fit

            tell("writing figures")
            written = write_fit(fit, recording, output)
    if json:
        typer.echo(json_module.dumps(to_json(fit) | {"notes": [*fit.notes, *extra]}))
        return
    from jaxmotor.cli._text import fit_text

    typer.echo(fit_text(fit, extra, written))
