"""What the linear model gets wrong: its residual voltage, and what that depends on."""

import math

from jaxmotor.diagnosis import Dependence, Diagnosis
from jaxmotor.present._residual_voltage import COORDINATES, explained_percent, residual_voltage
from jaxmotor.present.report._drawing import drawing
from jaxmotor.present.report._html import Content, Html, bullets, details, number, paragraph, table
from jaxmotor.present.report._page import figure
from jaxmotor.present.report._story import Story
from jaxmotor.text import capital, nothing_left, of_rounding, plainly, seen_in, voltage


def wrong_section(story: Story) -> Content:
    """The residual voltage, in words, as pictures and as numbers."""
    diagnosis = story.diagnosis
    volts = diagnosis.residual_voltage
    if not math.isfinite(volts.rms_V):
        return paragraph(
            "The recording is too short to show the residual voltage of the linear model. Effects are found without "
            "it: see below."
        )
    rms = number(volts.rms_V, "missing_volts.before.rms_V", voltage(volts.rms_V))
    text = (
        "In free simulation the linear motor drifts away from the measured shaft. The voltage that would have kept it "
        "there, the residual voltage, is "
    )
    return [
        paragraph(text, rms, f" rms{of_rounding(volts)}."),
        _seen(diagnosis),
        figure(_drawing(diagnosis), _caption(diagnosis)),
        details("The numbers", _table(diagnosis)),
    ]


def _seen(diagnosis: Diagnosis) -> Content:
    telling = [one for one in diagnosis.dependences if one.beyond_chance]
    if diagnosis.verdict == "complete" or diagnosis.undecided:
        return paragraph(f"{capital(nothing_left())}.")
    if not telling:
        return paragraph("It depends on speed, voltage, angle and time no more than by chance.")
    overlap = "Shares overlap where coordinates are correlated, as voltage and speed are."
    return [bullets(seen_in(one) for one in telling[:3]), paragraph(overlap) if len(telling) > 1 else None]


def _drawing(diagnosis: Diagnosis) -> Html:
    alt = (
        "Residual voltage against speed, applied voltage, shaft angle and time: "
        + "; ".join(f"{name} explains {_share(diagnosis.dependences, name)}" for name in COORDINATES)
        + " of its variance."
    )
    return drawing(residual_voltage(diagnosis), "missing", alt=alt)


def _share(dependences: tuple[Dependence, ...], coordinate: str) -> str:
    percent = explained_percent(dependences, coordinate)
    return f"{percent:.0f} %" if percent else "no more than chance"


def _caption(diagnosis: Diagnosis) -> str:
    text = "The residual voltage: a dot for each window of 60 ms, and means, against speed, voltage, angle and time."
    if diagnosis.named:
        text += " That of the extended model should show no trend."
    return text


def _table(diagnosis: Diagnosis) -> Content:
    head = ("what it looks like", "coordinate", "share of the variance (%)", "by chance below (%)")
    tables = [_dependences("Residual voltage of the linear model", head, diagnosis.dependences)]
    if diagnosis.named:
        tables.append(_dependences("Residual voltage of the extended model", head, diagnosis.unexplained_dependences))
        left = diagnosis.unexplained_voltage
        rms = number(left.rms_V, "missing_volts.after.rms_V", voltage(left.rms_V))
        tables.append(paragraph("The residual voltage of the extended model is ", rms, " rms."))
    return tables


def _dependences(caption: str, head: tuple[str, ...], dependences: tuple[Dependence, ...]) -> Html:
    rows = [(one.text, one.coordinate, plainly(100 * one.share), plainly(100 * one.chance)) for one in dependences]
    return table(caption, head, rows or [("nothing: the recording is too short to say", "", "", "")])
