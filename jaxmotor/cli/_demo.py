"""`jaxmotor demo`: the bundled recording through everything."""

from pathlib import Path
from typing import Annotated

import typer


def demo_command(
    output: Annotated[Path, typer.Option("-o", "--output", metavar="DIR", help="Where the figures go.")] = Path("demo"),
) -> None:
    """Identify, diagnose and validate the bundled recording, exactly and as the paper did, and draw it."""
    from jaxmotor.cli._folder import made_folder

    with made_folder(output):
        _demo(output)


def _demo(output: Path) -> None:
    from jaxmotor._runtime import keep_programs
    from jaxmotor.recording import bundled

    recording = bundled("paper")
    keep_programs(threads=True)
    from jaxmotor.cli._story import diagnosis_text
    from jaxmotor.cli._text import fit_text
    from jaxmotor.cli._validate import validation_text
    from jaxmotor.diagnosis import diagnose
    from jaxmotor.estimate import identify
    from jaxmotor.present import bode_models, save, write_diagnosis, write_fit, write_validation, zoh_bode
    from jaxmotor.present.report import Story, held_out_runs, write_report
    from jaxmotor.validation import validate

    typer.echo(f"The paper's plan on {recording.header['motor']}\n  {recording.header['notes']}\n")
    held_out = held_out_runs(recording)
    exact = identify(recording, hold_out=held_out)
    typer.echo("1. identify\n" + fit_text(exact, [], []))
    paper = identify(recording, method="paper", hold_out=held_out)
    typer.echo("\n   the same by the paper's method\n" + fit_text(paper, [], []).partition("\n")[2])
    diagnosis = diagnose(recording)
    typer.echo("\n2. diagnose\n" + diagnosis_text(diagnosis))
    validation = validate(exact, recording)
    typer.echo("\n3. validate\n" + validation_text(validation, []) + "\n")
    written = [
        *write_fit(exact, recording, output),
        *write_diagnosis(diagnosis, recording, output),
        *write_validation(validation, recording, output),
    ]
    assert exact.frequency_response is not None and recording.period_s is not None
    figures = {"models": bode_models(exact.frequency_response, [exact, paper]), "zoh": zoh_bode(recording.period_s)}
    for name, figure in figures.items():
        save(figure, output / f"paper-{name}.png")
        written.append(output / f"paper-{name}.png")
    report = write_report(Story(recording, diagnosis, validation, "", 0), Path(recording.source), output)
    drawn = sum(path.suffix == ".png" for path in set(written))
    typer.echo(f"the models and {drawn} figures are in {output.resolve()}")
    typer.echo(f"all of it on one page: {output.resolve() / report.name}")
