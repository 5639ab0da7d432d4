"""`jaxmotor diagnose`: what the linear model of each recording gets wrong."""

import json as json_module
import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from jaxmotor.cli._each import for_each
from jaxmotor.cli._folder import check_names, make_folder

if TYPE_CHECKING:
    from jaxmotor.diagnosis import Diagnosis


def diagnose_command(
    recordings: Annotated[list[Path], typer.Argument(metavar="REC.csv...", help="Recordings to diagnose.")],
    json: Annotated[bool, typer.Option("--json", help="One JSON object per recording, one per line.")] = False,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="DIR", help="Write the figures here.")
    ] = None,
    seed: Annotated[int, typer.Option(min=0, metavar="N", help="Draws the shuffles that chance is told by.")] = 0,
) -> None:
    """Show what the linear model of each recording gets wrong, and what that depends on."""
    if output is not None:
        check_names(recordings)
        make_folder(output)
    for_each(recordings, lambda path: _one(path, json, output, seed))


def _one(path: Path, json: bool, output: Path | None, seed: int) -> None:
    from jaxmotor.cli._runtime import use_compilation_cache
    from jaxmotor.recording import read

    recording = read(path)
    use_compilation_cache()
    from jaxmotor.diagnosis import diagnose, to_json

    diagnosis = diagnose(recording, seed=seed)
    written = []
    if output is not None:
        from jaxmotor.present import write_diagnosis

        written = write_diagnosis(diagnosis, recording, output)
    typer.echo(json_module.dumps(to_json(diagnosis)) if json else diagnosis_text(diagnosis, written))


def diagnosis_text(diagnosis: "Diagnosis", written: list[Path]) -> str:
    """What `jaxmotor diagnose` prints of one recording."""
    from jaxmotor.cli._text import with_error
    from jaxmotor.recording import ranges

    fit, score, missing = diagnosis.whole, diagnosis.held_out, diagnosis.missing
    held_out = diagnosis.fit.held_out
    scored = f"segments {ranges(held_out)}" if held_out else "nothing is, so of the fit itself"
    lines = [
        f"{Path(fit.source).name}: {diagnosis.verdict}",
        f"  linear model   gain {with_error(float(fit.motor.gain), float(fit.standard_error.gain), 'rad/s/V')}, "
        f"pole {with_error(float(fit.motor.pole), float(fit.standard_error.pole), 'rad/s')}",
        f"  held out       fit {score.fit_percent:.1f} %, chi2 {score.chi2_per_sample:.3g} per sample ({scored})",
    ]
    if math.isfinite(missing.rms_V):
        known = math.isfinite(missing.noise_V)
        rounding = f"; rounding alone would give {1e3 * missing.noise_V:.3g} mV" if known else ""
        lines.append(f"  it lacks       {1e3 * missing.rms_V:.3g} mV rms at the motor{rounding}")
    lines += _looks(diagnosis)
    lines += [f"  note: {note}" for note in diagnosis.notes]
    return "\n".join([*lines, *(f"  wrote {path}" for path in written)])


def _looks(diagnosis: "Diagnosis") -> list[str]:
    if diagnosis.verdict == "complete":
        return ["  Nothing else is left: the linear model reaches the floor."]
    telling = [look for look in diagnosis.looks if look.beyond_chance]
    lines = ["  What that depends on (part of it explained; by chance less than):"]
    lines += [f"    {100 * look.share:3.0f} %  ({100 * look.chance:.0f} %)  {look.text}" for look in telling]
    look = diagnosis.looks_like
    if look is not None:
        lines.append(f"  Looks like: {look.text}. No cause is named: this says where to look, not why.")
    return lines
