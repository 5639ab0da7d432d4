"""A diagnosis as a short story: what is wrong, why, how sure that is, what it costs, and what to do about it."""

import math
import textwrap
from collections.abc import Sequence
from pathlib import Path

from jaxmotor._sentences import LINE
from jaxmotor.diagnosis import BeforeAfter, Diagnosis, FoundEffect
from jaxmotor.estimate import STAMPS
from jaxmotor.recording import AT_ZERO, NO_SUPPLY, NO_WINDOW
from jaxmotor.text import (
    LOOP,
    allowing,
    bracket,
    cause,
    if_determined,
    level_words,
    looks_like,
    loop_of,
    may_be,
    nothing_left,
    of_rounding,
    printable,
    scored,
    seen_in,
    sentence,
    unlikely,
    voltage,
)
from jaxmotor.validation import Interval

INDENT = 17
MOST = 3
"""Looks, and experiments, that are told."""
MOST_LOOPS = 2


def diagnosis_text(diagnosis: Diagnosis, written: Sequence[Path] = ()) -> str:
    """What `jaxmotor diagnose` prints of one recording; `written` are the files made of it, in one folder."""
    parts = [
        *textwrap.wrap(f"{printable(diagnosis.recording)}: {diagnosis.outcome}", LINE),
        *_part("what is wrong", _wrong(diagnosis)),
        *_part("why", _why(diagnosis)),
        *_part("how sure", _sure(diagnosis)),
        *_part("what it costs", _costs(diagnosis)),
        *_part("the motor", [text for text in (_motor(diagnosis), allowing(diagnosis)) if text]),
        *_part("what to do", _advice(diagnosis)),
        *_part("note", _notes(diagnosis)),
        *_part("wrote", [_wrote(written)] if written else []),
    ]
    return "\n".join(parts)


def _part(title: str, sentences: list[str]) -> list[str]:
    rows = [
        row
        for text in sentences
        for row in textwrap.wrap(text, LINE - INDENT, subsequent_indent="  ", break_on_hyphens=False)
    ]
    return [f"  {title if number == 0 else '':<{INDENT - 2}}{row}" for number, row in enumerate(rows)]


def _wrong(diagnosis: Diagnosis) -> list[str]:
    residual = diagnosis.residual_voltage
    if not math.isfinite(residual.rms_V):
        return []
    size = f"{voltage(residual.rms_V)} rms at the motor"
    told = f"the residual voltage of the linear model is {size}{of_rounding(residual)}"
    if diagnosis.verdict == "complete" or diagnosis.undecided:
        return [told, nothing_left()]
    most = MOST if diagnosis.verdict == "unexplained" else MOST - 1
    return [told, *(seen_in(one) for one in diagnosis.dependences[:most] if one.beyond_chance)]


def _why(diagnosis: Diagnosis) -> list[str]:
    lines: list[str] = []
    families: set[str] = set()
    for found in (found for found in diagnosis.named if found.is_told):
        lines.append(f"{cause(found, again=found.effect.family in families)}: {sentence(found)}")
        if not (found.is_named or found.is_one_of_several):
            families.add(found.effect.family)
    if others := [found for found in diagnosis.named if not found.is_told]:
        stays = 100 * max(max(found.unexplained_share, found.held_out_share) for found in others)
        # An effect that is plain to see has no probability beside something that nobody has explained.
        rest = f" while {stays:.0f} % of what it should explain stays unexplained" if stays > 0.5 else ""
        instead = "; and with ".join(f"{unlikely(found)}: {sentence(found)}" for found in others)
        lines.append(
            f"no {'further ' if lines else ''}cause that is likely{rest}; the motor fits better with {instead}"
        )
    left = looks_like(diagnosis)
    return lines if left is None else [*lines, left]


def _sure(diagnosis: Diagnosis) -> list[str]:
    if not diagnosis.named:
        return []
    held_out = diagnosis.held_out
    known = diagnosis.fit.floor_known
    floor = "rounding alone" if known else f"noise alone, {level_words(diagnosis.fit.noise)}"
    drift = f"{held_out.drift_before:.3g}, extended {held_out.drift_after:.3g}"
    scale = f"{'drift chi2' if diagnosis.adds_up else 'chi2'} of held-out data (1 = {floor}): linear {drift}"
    return [scale, *(line for found in diagnosis.named for line in _alternatives(found, held_out))]


def _alternatives(found: FoundEffect, held_out: BeforeAfter) -> list[str]:
    same = may_be(found, str)
    other = [one for one in found.alternatives if not one.inseparable]
    lines = []
    if same is not None:
        lines.append(f"{found.name}: {same}")
    if other:
        instead = ", ".join(f"{one.name} {held_out.drift_after + one.chi2_excess:.3g}" for one in other[:MOST])
        lines.append(f"alternatives to {found.name}: {instead}")
    return lines


def _costs(diagnosis: Diagnosis) -> list[str]:
    scores = diagnosis.held_out
    lines = []
    for name, unit in (("fit_percent", "%"), ("rmse_rad_s", "rad/s"), ("chi2_per_sample", "")):
        title = {"fit_percent": "fit", "rmse_rad_s": "RMSE"}.get(name, "chi2 per sample")
        told = _told(getattr(scores.before_intervals, name), unit)
        if diagnosis.named:
            told = f"{told} -> {_told(getattr(scores.after_intervals, name), unit)}"
        lines.append(f"{title} {told}")
    if not math.isfinite(scores.before.fit_percent):
        lines[0] = "fit not defined, since the speed does not change"
    lines = [f"{lines[0]}, {lines[1]}", lines[2] + (" (brackets: 95 %)" if "[" in lines[2] else "")]
    if not diagnosis.fit.floor_known:  # a log of angles or speeds, not of counts: compare with what others publish
        before, after = scores.angle_fit_percent_before, scores.angle_fit_percent_after
        if math.isfinite(before):
            lines.append(f"of the angle turned: fit {before:.3g} %" + (f" -> {after:.3g} %" if diagnosis.named else ""))
    return [*lines, scored(diagnosis), *_loops(diagnosis)]


def _loops(diagnosis: Diagnosis) -> list[str]:
    lines = []
    for gain in diagnosis.closed_loop[:MOST_LOOPS]:
        lines.append(loop_of(gain))
        for name, title, factor, unit in LOOP:
            before, after = getattr(gain.before, name), getattr(gain.after, name)
            if not math.isfinite(before.measured.value):
                continue
            measured = f"{title} measured {factor * before.measured.value:.3g} {unit}"
            told = f"{measured}, linear {_told(before.predicted, '', factor)}"
            lines.append(f"{told} -> {_told(after.predicted, '', factor)}" if diagnosis.named else told)
    return lines


def _told(interval: Interval, unit: str, factor: float = 1.0) -> str:
    value, low, high = (factor * number for number in (interval.value, interval.low, interval.high))
    return f"{value:.3g}{f' {unit}' if unit else ''}{bracket((value, low, high))}"


def _motor(diagnosis: Diagnosis) -> str:
    linear, error = diagnosis.motor.linear, diagnosis.standard_error
    gain = if_determined(float(linear.gain), error["gain_rad_s_V"], "rad/s/V")
    pole = if_determined(float(linear.pole), error["pole_rad_s"], "rad/s")
    return f"gain {gain}, pole {pole}{' beside these effects' if diagnosis.named else ''}; ± is 95 %"


def _advice(diagnosis: Diagnosis) -> list[str]:
    lines = [f"{_if_named(found)}: {found.effect.advice}" for found in diagnosis.named if found.is_told]
    # Those that have a plan are numbered as their files are.
    planned = [one for one in diagnosis.experiments if one.plan is not None]
    lines += [f"record next ({number}): {one.text}" for number, one in enumerate(planned[:MOST], 1)]
    return lines + [one.text for one in diagnosis.experiments if one.plan is None][:MOST]


def _if_named(found: FoundEffect) -> str:
    return found.name if found.is_sure else f"if it is {found.name}"


def _notes(diagnosis: Diagnosis) -> list[str]:
    """Those on the linear fit say how wrong that may be; the story has told it where it knows better."""
    # What the linear motor lacks is explained; how the log was made is not.
    told = set(diagnosis.fit.notes if diagnosis.verdict != "unexplained" else ())
    told -= {one.sentence for one in (diagnosis.average, diagnosis.timing) if one is not None}
    told = {note for note in told if not note.startswith((STAMPS, AT_ZERO))}
    if diagnosis.named:
        # One of the effects that were left out may be the cause.
        told -= {NO_SUPPLY}
    if any(found.effect.family == "lag" for found in diagnosis.named):
        told -= {NO_WINDOW}
    return [printable(note) for note in diagnosis.notes if note not in told]


def _wrote(written: Sequence[Path]) -> str:
    return printable(f"in {written[0].parent}: {', '.join(path.name for path in written)}")
