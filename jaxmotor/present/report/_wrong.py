"""What the linear model gets wrong: the voltage it lacks, and what that depends on."""

import math

import numpy as np

from jaxmotor.diagnosis import Diagnosis, Look, MissingVolts
from jaxmotor.present._missing import BINS, COORDINATES
from jaxmotor.present.report._html import Content, Html, bullets, details, element, number, paragraph, table
from jaxmotor.present.report._page import figure
from jaxmotor.present.report._plot import Mark, Panel, dots, legend, level, line, plot
from jaxmotor.present.report._scale import Scale
from jaxmotor.present.report._story import Story
from jaxmotor.words import capital, nothing_left, of_rounding, plainly, seen_in

MOST_DOTS = 1_500
"""In a panel; windows beyond that are left out evenly."""


def wrong_section(story: Story) -> Content:
    """The missing volts, in words, as pictures and as numbers."""
    diagnosis = story.diagnosis
    missing = diagnosis.missing
    if not math.isfinite(missing.rms_V):
        return paragraph("The recording is too short, or its ticks too uneven, to say what the linear model lacks.")
    content: list[Content] = [paragraph(_lacks(diagnosis)), _seen(diagnosis)]
    content.append(figure(_drawing(diagnosis), _caption(diagnosis), _key(diagnosis)))
    content.append(details("The numbers", _table(diagnosis)))
    return content


def _lacks(diagnosis: Diagnosis) -> Html:
    missing = diagnosis.missing
    rms = number(missing.rms_V, "missing_volts.before.rms_V", f"{1e3 * missing.rms_V:.3g} mV")
    return element(
        "span",
        "Simulated freely, the linear motor drifts away from the measured shaft. The voltage that would have kept it "
        "there is ",
        rms,
        f" rms{of_rounding(missing)}.",
    )


def _seen(diagnosis: Diagnosis) -> Content:
    telling = [look for look in diagnosis.looks if look.beyond_chance]
    if diagnosis.verdict == "complete":
        return paragraph(f"{capital(nothing_left())}.")
    if not telling:
        return paragraph("None of the coordinates explains more of it than chance.")
    return bullets(seen_in(look) for look in telling[:3])


def _drawing(diagnosis: Diagnosis) -> Html:
    volts = np.concatenate([diagnosis.missing.volts, diagnosis.left.volts])
    # A few windows far out would press all others flat.
    shown = volts[np.abs(volts) <= 1.3 * np.quantile(np.abs(volts), 0.995)]
    up = Scale.of(1e3 * shown, "Missing (mV)")
    panels = [_panel(diagnosis, coordinate, label, up) for coordinate, label in COORDINATES.items()]
    alt = (
        "Missing voltage against speed, applied voltage, shaft angle and time: "
        + "; ".join(f"{name} explains {_share(diagnosis.looks, name)}" for name in COORDINATES)
        + " of what the linear model lacks."
    )
    return plot(panels, alt=alt, columns=2)


def _panel(diagnosis: Diagnosis, coordinate: str, label: str, up: Scale) -> Panel:
    at = _at(diagnosis.missing, coordinate)
    if not np.isfinite(at).any():
        return Panel(Scale(0.0, 1.0, f"{label}: not known"), up, [], height=150.0)
    across = Scale.of(at, label)
    marks: list[Mark] = []
    if math.isfinite(diagnosis.missing.noise_V):
        marks += [level(across, sign * 2e3 * diagnosis.missing.noise_V, "purple dotted") for sign in (-1, 1)]
    marks += _marks(diagnosis.missing, coordinate, up, ("dot small grey faint", "ink", "linear"))
    if diagnosis.effects:
        marks += _marks(diagnosis.left, coordinate, up, ("dot small blue faint", "blue", "extended"))
    share = _share(diagnosis.looks, coordinate)
    return Panel(across, up, marks, height=150.0, title=f"explains {share}")


def _marks(volts: MissingVolts, coordinate: str, up: Scale, look: tuple[str, str, str]) -> list[Mark]:
    """A dot for each window, and the means of bins."""
    at, missing_mV = _at(volts, coordinate), 1e3 * volts.volts
    known = np.isfinite(at)
    at, missing_mV = at[known], missing_mV[known]
    if not len(at):
        return []
    edges = np.unique(np.quantile(at, np.linspace(0, 1, BINS + 1)))
    bins = np.clip(np.searchsorted(edges, at, side="right") - 1, 0, max(len(edges) - 2, 0))
    means = np.array([(at[bins == k].mean(), missing_mV[bins == k].mean()) for k in np.unique(bins)]).T
    every = 1 + len(at) // MOST_DOTS
    inside = (missing_mV >= up.low) & (missing_mV <= up.high)
    return [
        dots(at[inside][::every], missing_mV[inside][::every], look[0]),
        line(means[0], means[1], look[1], f"{look[2]}, mean"),
    ]


def _at(volts: MissingVolts, coordinate: str) -> np.ndarray:
    return {
        "speed": volts.speed_rad_s,
        "voltage": volts.input_V,
        "angle": np.mod(volts.angle_rad, 2 * np.pi),
        "time": volts.time_s,
    }[coordinate]


def _share(looks: tuple[Look, ...], coordinate: str) -> str:
    shares = [look.share for look in looks if look.coordinate == coordinate and look.beyond_chance]
    return f"{100 * max(shares):.0f} %" if shares else "no more than chance"


def _key(diagnosis: Diagnosis) -> Html:
    entries = [("dot grey", "linear, a window of 60 ms"), ("ink", "linear, mean")]
    if diagnosis.effects:
        entries += [("dot blue", "extended, a window"), ("blue", "extended, mean")]
    if math.isfinite(diagnosis.missing.noise_V):
        entries.append(("purple dotted", "± 2 sd of the encoder's rounding"))
    return legend(entries)


def _caption(diagnosis: Diagnosis) -> str:
    text = "The voltage that the model lacks, window by window, against everything it may depend on."
    if diagnosis.effects:
        text += " What the extended model lacks should have no shape."
    return text


def _table(diagnosis: Diagnosis) -> Content:
    head = ("what it looks like", "coordinate", "share of the variance (%)", "chance stays below (%)")
    tables = [_looks("What the linear model lacks depends on", head, diagnosis.looks)]
    if diagnosis.effects:
        tables.append(_looks("What the extended model lacks depends on", head, diagnosis.left_looks))
        left = diagnosis.left
        rms = number(left.rms_V, "missing_volts.after.rms_V", f"{1e3 * left.rms_V:.3g} mV")
        tables.append(paragraph("The extended model lacks ", rms, " rms."))
    return tables


def _looks(caption: str, head: tuple[str, ...], looks: tuple[Look, ...]) -> Html:
    rows = [(look.text, look.coordinate, plainly(100 * look.share), plainly(100 * look.chance)) for look in looks]
    return table(caption, head, rows or [("nothing: the recording is too short to say", "", "", "")])
