"""A diagnosis as a short story: what is wrong, why, how sure that is, what it costs, and what to do about it."""

import math
import textwrap
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from jaxmotor.cli._text import printable, with_error
from jaxmotor.diagnosis import Diagnosis, FoundEffect, Look, Worth
from jaxmotor.motor.effects import parameters
from jaxmotor.recording import ranges

WIDTH, INDENT = 110, 17
MOST = 3
"""Looks, and experiments, that are told."""
FRIENDLY = {
    "V": (1e3, "mV"),
    "s": (1e3, "ms"),
    "rad": (1e3, "mrad"),
    "1": (1e2, "%"),
    "1/s": (6e3, "% per minute"),
    "V s²/rad²": (1e5, "mV"),  # at 10 rad/s, as QuadraticDrag says it
}
"""What a parameter's unit becomes: factor and name."""
ONE_IS_LARGE = {"V", "s"}
"""Units in which larger values stay."""


def diagnosis_text(diagnosis: Diagnosis, written: Sequence[Path] = ()) -> str:
    """What `jaxmotor diagnose` prints of one recording; `written` are the files made of it, in one folder."""
    parts = [
        *textwrap.wrap(f"{printable(diagnosis.recording)}: {diagnosis.verdict}", WIDTH),
        *_part("what is wrong", _wrong(diagnosis)),
        *_part("why", _why(diagnosis)),
        *_part("how sure", _sure(diagnosis)),
        *_part("what it costs", _costs(diagnosis)),
        *_part("the motor", [_motor(diagnosis)]),
        *_part("what to do", _advice(diagnosis)),
        *_part("note", _notes(diagnosis)),
        *_part("wrote", [_wrote(written)] if written else []),
    ]
    return "\n".join(parts)


def friendly(value: float, error: float, about: dict[str, Any]) -> str:
    """A parameter ± 95 % in a unit for people, from SI and what `parameters` says of it."""
    unit = about["unit"]
    if about["kind"] == "fixed" and unit == "1":
        return f"{value:g}"
    factor, shown = (1.0, unit) if unit in ONE_IS_LARGE and abs(value) >= 1 else FRIENDLY.get(unit, (1.0, unit))
    return with_error(factor * value, factor * error, shown)


def sentence(found: FoundEffect) -> str:
    """What the effect does, with its parameters."""
    values, about = found.parameters, parameters(found.effect)
    return found.effect.says.format(
        **{name: friendly(values[name], found.standard_error[name], about[name]) for name in values}
    )


def _part(title: str, sentences: list[str]) -> list[str]:
    rows = [
        row
        for text in sentences
        for row in textwrap.wrap(text, WIDTH - INDENT, subsequent_indent="  ", break_on_hyphens=False)
    ]
    return [f"  {title if number == 0 else '':<{INDENT - 2}}{row}" for number, row in enumerate(rows)]


def _wrong(diagnosis: Diagnosis) -> list[str]:
    missing = diagnosis.missing
    if not math.isfinite(missing.rms_V):
        return []
    known = math.isfinite(missing.noise_V)
    rounding = f", of which the encoder's rounding makes {1e3 * missing.noise_V:.3g} mV" if known else ""
    lacks = f"the linear model lacks {1e3 * missing.rms_V:.3g} mV rms at the motor{rounding}"
    if diagnosis.verdict == "complete":
        return [lacks, "nothing that this recording shows: the linear model reaches the floor"]
    most = MOST if diagnosis.verdict == "unexplained" else MOST - 1
    return [lacks, *(_look(look) for look in diagnosis.looks[:most] if look.beyond_chance)]


def _look(look: Look) -> str:
    return f"{100 * look.share:.0f} % of that: {look.text} (by chance {100 * max(look.chance, 0.01):.0f} %)"


def _why(diagnosis: Diagnosis) -> list[str]:
    lines = [f"{found.name}: {sentence(found)}" for found in diagnosis.effects]
    look = diagnosis.looks_like
    if look is None:
        return lines
    also = "beside that, what is left" if lines else "it"
    more = "no further cause is named" if lines else "no cause is named"
    return [*lines, f"{also} looks like {look.text}; {more}: this says where to look, not why"]


def _sure(diagnosis: Diagnosis) -> list[str]:
    if not diagnosis.effects:
        return []
    held_out = diagnosis.held_out
    floor = "rounding" if diagnosis.fit.floor_known else "noise"
    drift = f"{held_out.drift_before:.3g}, with what is named {held_out.drift_after:.3g}"
    scale = f"left over in data not fitted (drift, 1 = {floor} alone): linear {drift}"
    return [scale, *(line for found in diagnosis.effects for line in _rivals(found, held_out))]


def _rivals(found: FoundEffect, held_out: Worth) -> list[str]:
    same = [rival.name for rival in found.rivals if rival.inseparable]
    other = [rival for rival in found.rivals if not rival.inseparable]
    lines = []
    if same:
        lines.append(f"{found.name}: may as well be {' or '.join(same)}; this recording cannot tell them apart")
    if other:
        instead = ", ".join(f"{rival.name} {held_out.drift_after + rival.chi2_excess:.3g}" for rival in other[:MOST])
        lines.append(f"instead of {found.name}: {instead}")
    return lines


def _costs(diagnosis: Diagnosis) -> list[str]:
    worth = diagnosis.held_out
    before, after = worth.before, worth.after
    fit, rmse = f"fit {before.fit_percent:.1f} %", f"RMSE {before.rmse_rad_s:.3g}"
    chi2 = f"chi2 per sample {_interval(worth.before_interval)}"
    if diagnosis.effects:
        fit, rmse = f"{fit} -> {after.fit_percent:.1f} %", f"{rmse} -> {after.rmse_rad_s:.3g}"
        chi2 = f"{chi2} -> {_interval(worth.after_interval)}"
    return [f"{fit}, {rmse} rad/s", f"{chi2} (brackets: 95 %)", _scored(diagnosis)]


def _scored(diagnosis: Diagnosis) -> str:
    """Which data the scores are of. Segments of a recording that was cut have numbers that say nothing to people."""
    held_out, whole = set(diagnosis.held_out.segments), set(diagnosis.whole.segments)
    if held_out >= whole:
        return "all of the data that were fitted: there are too few to hold any out"
    if held_out < whole:
        return f"all of segments {ranges(diagnosis.held_out.segments)}, with the models fitted to the others"
    return "all of a part of the recording, with the models fitted to the rest"


def _interval(interval: tuple[float, float, float]) -> str:
    value, low, high = interval
    return f"{value:.3g} [{low:.3g}, {high:.3g}]"


def _motor(diagnosis: Diagnosis) -> str:
    linear, error = diagnosis.motor.linear, diagnosis.standard_error
    gain = with_error(float(linear.gain), error["gain_rad_s_V"], "rad/s/V")
    pole = with_error(float(linear.pole), error["pole_rad_s"], "rad/s")
    return f"gain {gain}, pole {pole}{' beside these effects' if diagnosis.effects else ''}; ± is 95 %"


def _advice(diagnosis: Diagnosis) -> list[str]:
    lines = [f"{found.name}: {found.effect.advice}" for found in diagnosis.effects]
    # Those that have a plan are numbered as their files are.
    planned = [one for one in diagnosis.experiments if one.plan is not None]
    lines += [f"record next ({number}): {one.text}" for number, one in enumerate(planned[:MOST], 1)]
    return lines + [one.text for one in diagnosis.experiments if one.plan is None][:MOST]


def _notes(diagnosis: Diagnosis) -> list[str]:
    """Those on the linear fit say how wrong that may be; the story has told it where it knows better."""
    told = diagnosis.fit.notes if diagnosis.verdict != "unexplained" else ()
    return [printable(note) for note in diagnosis.notes if note not in told]


def _wrote(written: Sequence[Path]) -> str:
    return printable(f"in {written[0].parent}: {', '.join(path.name for path in written)}")
