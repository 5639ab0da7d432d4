"""What the linear model gets wrong: its residual voltage, and what that depends on."""

import math

import numpy as np

from jaxmotor.diagnosis import Diagnosis, Look, MissingVolts
from jaxmotor.present._missing import COORDINATES, along, bin_means, explained_percent
from jaxmotor.present.report._html import Content, Html, bullets, details, number, paragraph, table
from jaxmotor.present.report._motor import spacing
from jaxmotor.present.report._page import figure
from jaxmotor.present.report._plot import Mark, Panel, dots, legend, level, line, plot
from jaxmotor.present.report._scale import Scale
from jaxmotor.present.report._story import Story
from jaxmotor.recording import Recording
from jaxmotor.words import capital, named, nothing_left, of_rounding, plainly, seen_in

MOST_DOTS = 1_500
"""In a panel; windows beyond that are left out evenly."""


def wrong_section(story: Story) -> Content:
    """The residual voltage, in words, as pictures and as numbers."""
    diagnosis = story.diagnosis
    missing = diagnosis.missing
    if not math.isfinite(missing.rms_V):
        return paragraph(_not_seen(story.recording))
    rms = number(missing.rms_V, "missing_volts.before.rms_V", f"{1e3 * missing.rms_V:.3g} mV")
    text = (
        "In free simulation the linear motor drifts away from the measured shaft. The voltage that would have kept it "
        "there, the residual voltage, is "
    )
    return [
        paragraph(text, rms, f" rms{of_rounding(missing)}."),
        _seen(diagnosis),
        figure(_drawing(diagnosis), _caption(diagnosis), _key(diagnosis)),
        details("The numbers", _table(diagnosis)),
    ]


def _not_seen(recording: Recording) -> str:
    """Why there is no residual voltage to show."""
    if recording.measured != "count":
        needs = f"an encoder's counts, and the recording has {named(recording.measured)}s"
    elif recording.period_s is None:
        needs = f"ticks, and the recording has uneven time stamps (rows are {spacing(recording)})"
    else:
        return "The recording is too short to show the residual voltage of the linear model."
    return (
        f"The residual voltage of the linear model is computed from {needs}. Effects are found without it: see below."
    )


def _seen(diagnosis: Diagnosis) -> Content:
    telling = [look for look in diagnosis.looks if look.beyond_chance]
    if diagnosis.verdict == "complete" or diagnosis.undecided:
        return paragraph(f"{capital(nothing_left())}.")
    if not telling:
        return paragraph("It depends on speed, voltage, angle and time no more than by chance.")
    overlap = "Shares overlap where coordinates are correlated, as voltage and speed are."
    return [bullets(seen_in(look) for look in telling[:3]), paragraph(overlap) if len(telling) > 1 else None]


def _drawing(diagnosis: Diagnosis) -> Html:
    volts = np.concatenate([diagnosis.missing.volts, diagnosis.left.volts])
    # A few windows far out would press all others flat.
    shown = volts[np.abs(volts) <= 1.3 * np.quantile(np.abs(volts), 0.995)]
    up = Scale.of(1e3 * shown, "Residual (mV)")
    panels = [_panel(diagnosis, coordinate, label, up) for coordinate, label in COORDINATES.items()]
    alt = (
        "Residual voltage against speed, applied voltage, shaft angle and time: "
        + "; ".join(f"{name} explains {_share(diagnosis.looks, name)}" for name in COORDINATES)
        + " of its variance."
    )
    return plot(panels, alt=alt, columns=2)


def _panel(diagnosis: Diagnosis, coordinate: str, label: str, up: Scale) -> Panel:
    at = along(diagnosis.missing, coordinate)
    if not np.isfinite(at).any():
        return Panel(Scale(0.0, 1.0, f"{label}: not known"), up, [], height=150.0)
    across = Scale.of(at, label)
    marks: list[Mark] = []
    if math.isfinite(diagnosis.missing.noise_V):
        marks += [level(across, sign * 2e3 * diagnosis.missing.noise_V, "purple dotted") for sign in (-1, 1)]
    marks += _marks(diagnosis.missing, coordinate, up, ("dot small grey faint", "ink", "linear"))
    if diagnosis.named:
        marks += _marks(diagnosis.left, coordinate, up, ("dot small blue faint", "blue", "extended"))
    share = _share(diagnosis.looks, coordinate)
    return Panel(across, up, marks, height=150.0, title=f"explains {share}")


def _marks(volts: MissingVolts, coordinate: str, up: Scale, look: tuple[str, str, str]) -> list[Mark]:
    """A dot for each window, and the means of bins."""
    at, missing_mV = along(volts, coordinate), 1e3 * volts.volts
    known = np.isfinite(at)
    at, missing_mV = at[known], missing_mV[known]
    if not len(at):
        return []
    every = 1 + len(at) // MOST_DOTS
    inside = (missing_mV >= up.low) & (missing_mV <= up.high)
    return [
        dots(at[inside][::every], missing_mV[inside][::every], look[0]),
        line(*bin_means(at, missing_mV), look[1], f"{look[2]}, mean"),
    ]


def _share(looks: tuple[Look, ...], coordinate: str) -> str:
    percent = explained_percent(looks, coordinate)
    return f"{percent:.0f} %" if percent else "no more than chance"


def _key(diagnosis: Diagnosis) -> Html:
    entries = [("dot grey", "linear, one window"), ("ink", "linear, mean")]
    if diagnosis.named:
        entries += [("dot blue", "extended, one window"), ("blue", "extended, mean")]
    if math.isfinite(diagnosis.missing.noise_V):
        entries.append(("purple dotted", "± 2 sd of the encoder's rounding"))
    return legend(entries)


def _caption(diagnosis: Diagnosis) -> str:
    text = "The residual voltage in windows of 60 ms, against speed, voltage, angle and time."
    if diagnosis.named:
        text += " That of the extended model should show no trend."
    return text


def _table(diagnosis: Diagnosis) -> Content:
    head = ("what it looks like", "coordinate", "share of the variance (%)", "by chance below (%)")
    tables = [_looks("Residual voltage of the linear model", head, diagnosis.looks)]
    if diagnosis.named:
        tables.append(_looks("Residual voltage of the extended model", head, diagnosis.left_looks))
        left = diagnosis.left
        rms = number(left.rms_V, "missing_volts.after.rms_V", f"{1e3 * left.rms_V:.3g} mV")
        tables.append(paragraph("The residual voltage of the extended model is ", rms, " rms."))
    return tables


def _looks(caption: str, head: tuple[str, ...], looks: tuple[Look, ...]) -> Html:
    rows = [(look.text, look.coordinate, plainly(100 * look.share), plainly(100 * look.chance)) for look in looks]
    return table(caption, head, rows or [("nothing: the recording is too short to say", "", "", "")])
