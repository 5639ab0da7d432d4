"""`jaxmotor demo`: the bundled recording through everything."""

from pathlib import Path
from typing import Annotated

import typer

HELD_OUT = "16-20,closed_loop"
"""Half of the steps, and the loops: what the models are then held against."""


def demo_command(
    output: Annotated[Path, typer.Option("-o", "--output", metavar="DIR", help="Where the figures go.")] = Path("demo"),
) -> None:
    """Identify and validate the bundled recording, exactly and as the paper did, and draw it."""
    from jaxmotor.cli._folder import make_folder
    from jaxmotor.cli._runtime import use_compilation_cache
    from jaxmotor.cli._segments import chosen_segments
    from jaxmotor.recording import bundled

    make_folder(output)
    recording = bundled()
    use_compilation_cache()
    from jaxmotor.cli._text import fit_text
    from jaxmotor.cli._validate import validation_text
    from jaxmotor.estimate import identify, read_model
    from jaxmotor.present import bode_models, save, write_fit, write_validation, zoh_bode
    from jaxmotor.validation import validate

    typer.echo(f"{recording.header['motor']}; {recording.header['notes']}\n")
    held_out = chosen_segments(recording, HELD_OUT)
    exact = identify(recording, hold_out=held_out)
    written = write_fit(exact, recording, output)
    typer.echo(fit_text(exact, [], []) + "\n")
    paper = identify(recording, method="paper", hold_out=held_out)
    typer.echo("the same by the paper's method\n" + fit_text(paper, [], []).partition("\n")[2] + "\n")
    validation = validate(read_model(written[0]), recording)
    typer.echo(validation_text(validation, []) + "\n")
    written += write_validation(validation, recording, output)
    assert exact.frequency_response is not None and recording.period_s is not None
    figures = {"models": bode_models(exact.frequency_response, [exact, paper]), "zoh": zoh_bode(recording.period_s)}
    for name, figure in figures.items():
        save(figure, output / f"paper-{name}.png")
        written.append(output / f"paper-{name}.png")
    typer.echo(f"model and {len(set(written)) - 1} figures are in {output.resolve()}")
