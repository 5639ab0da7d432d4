"""`jaxmotor validate`: a model against segments that it was not fitted to."""

from __future__ import annotations

import json as json_module
import math
import textwrap
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from jaxmotor._sentences import LINE
from jaxmotor.cli._recordings import opened

if TYPE_CHECKING:
    from jaxmotor.estimate import Model
    from jaxmotor.validation import ClosedLoop, OpenLoop, Score, StepTrials, Validation

MOST_SEGMENTS = 20
"""Segments of which the open-loop scores are printed one by one."""


def validate_command(
    model: Annotated[Path, typer.Argument(metavar="MODEL.json", help="Model that identify or diagnose wrote.")],
    recording: Annotated[Path, typer.Argument(metavar="REC.csv", help="Recording to hold it against.")],
    json: Annotated[bool, typer.Option("--json", help="One JSON object on one line.")] = False,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", metavar="DIR", help="Write the figures here.")
    ] = None,
    seed: Annotated[int, typer.Option(min=0, metavar="N", help="Draws parameters and encoder offsets.")] = 0,
) -> None:
    """Hold a model against data that it was not fitted to: open loop, mean of step trials, closed loop."""
    with opened(recording) as (measured, tell):
        from jaxmotor.validation import to_json, validate

        tell("simulating the held-out segments")
        validation = validate(model, measured, seed=seed)
        written = []
        if output is not None:
            from jaxmotor.cli._folder import make_folder
            from jaxmotor.present import write_validation

            tell("writing figures")
            make_folder(output)
            written = write_validation(validation, measured, output)
    if json:
        typer.echo(json_module.dumps(to_json(validation)))
        return
    typer.echo(validation_text(validation, written))


def validation_text(validation: Validation, written: list[Path]) -> str:
    """What `jaxmotor validate` prints."""
    head = f"{validation.recording} against {Path(validation.model.source).name}"
    lines = [head, *_effects(validation.model), *_segments(validation)]
    if validation.open_loop is not None:
        lines += _open_loop(validation.open_loop)
    for steps in validation.steps:
        lines += _steps(steps)
    for loop in validation.closed_loop:
        lines += _closed_loop(loop, " of the linear part" if validation.model.effects else "")
    notes = [*validation.notes, *(note for loop in validation.closed_loop for note in loop.notes)]
    lines += [f"  note: {note}" for note in notes]
    lines += [f"  wrote {path}" for path in written]
    return "\n".join(lines)


def _effects(model: Model) -> list[str]:
    from jaxmotor.text import law

    errors = {effect.name: error for effect, error in zip(model.effects, model.effect_errors, strict=False)}
    laws = [f"with {effect.name}: {law(effect, errors.get(effect.name, {}))}" for effect in model.effects]
    return [row for text in laws for row in textwrap.wrap(text, LINE, initial_indent="  ", subsequent_indent="    ")]


def _segments(validation: Validation) -> list[str]:
    from jaxmotor.recording import ranges

    fitted = ranges(validation.fitted) if validation.fitted else "none"
    lines = [f"  segments scored: {ranges(validation.scored)}; fitted, so not scored: {fitted}"]
    reasons: dict[str, list[int]] = {}
    for skipped in validation.skipped:
        reasons.setdefault(skipped.reason, []).append(skipped.segment)
    return lines + [f"  not scored: {ranges(tuple(indices))}, {reason}" for reason, indices in reasons.items()]


def _open_loop(open_loop: OpenLoop) -> list[str]:
    from jaxmotor.text import floor

    lines = [
        "",
        f"  open loop (free simulation; chi2 per sample, 1 = {floor(open_loop.floor_known)})",
        f"    all         {_score(open_loop.pooled)}",
    ]
    if 1 < len(open_loop.segments) <= MOST_SEGMENTS:
        lines += [f"    segment {index:<3d} {_score(score)}" for index, score in open_loop.segments.items()]
    if open_loop.initial_speed_estimated:
        from jaxmotor.recording import ranges

        lines.append(f"    initial speed estimated in {ranges(open_loop.initial_speed_estimated)}")
    return lines


def _score(score: Score) -> str:
    fit = f"fit {score.fit_percent:5.1f} %" if math.isfinite(score.fit_percent) else "fit     -  "
    counts = f", {score.rmse_counts:.3g} counts" if math.isfinite(score.rmse_counts) else ""
    return f"{fit}  RMSE {score.rmse_rad_s:.3g} rad/s{counts}  chi2 {score.chi2_per_sample:.3g}"


def _steps(steps: StepTrials) -> list[str]:
    from jaxmotor.recording import ranges

    trials = f"mean of {steps.trials} trials" if steps.trials > 1 else "one trial"
    return [
        "",
        f"  step to {steps.amplitude_V:.3g} V, {trials} (segments {ranges(steps.segments)})",
        f"    model inside the measured band in {steps.inside_percent:.1f} % of {len(steps.time_s)} rows",
        *_table(steps),
    ]


def _closed_loop(loop: ClosedLoop, whose: str) -> list[str]:
    return [
        "",
        f"  closed loop, segment {loop.segment}: {loop.gains}, reference {loop.reference_rad_s:.4g} rad/s",
        f"    measured inside the predicted band: speed in {loop.speed_inside_percent:.1f} %, voltage in "
        f"{loop.volts_inside_percent:.1f} % of {len(loop.time_s)} ticks",
        *_table(loop),
        f"    theory (eq. 21) gives {_theory(loop, whose)}",
    ]


def _theory(loop: ClosedLoop, whose: str) -> str:
    from jaxmotor.text import with_bracket

    theory, offset = loop.theory_error_rad_s, loop.theory_error_with_offset_rad_s
    if not math.isfinite(theory.value):
        return "no steady error: the loop has no balance"
    beside = f", {offset:.4g} with the voltage offset" if abs(offset - theory.value) > 1e-3 * abs(offset) else ""
    return f"a steady error{whose} of {with_bracket(theory)} rad/s{beside}"


def _table(found: StepTrials | ClosedLoop) -> list[str]:
    from jaxmotor.text import compared, with_bracket

    lines = [f"    {'':24}{'measured':28}predicted"]
    for name, unit, comparison, factor in compared(found):
        mark = {True: "", False: "  outside", None: ""}[comparison.inside]
        measured, predicted = (with_bracket(one, factor) for one in (comparison.measured, comparison.predicted))
        lines.append(f"    {f'{name} [{unit}]':24}{measured:28}{predicted}{mark}")
    return lines
