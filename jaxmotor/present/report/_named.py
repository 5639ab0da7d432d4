"""The causes that were named: what each does, how sure it is, what it might be instead, and what to do about it."""

import math

import numpy as np

from jaxmotor.diagnosis import Diagnosis, FoundEffect
from jaxmotor.motor.effects import parameters
from jaxmotor.present.report._html import Content, Html, element, number, paragraph, table
from jaxmotor.present.report._page import figure
from jaxmotor.present.report._plot import WIDTH, legend
from jaxmotor.present.report._scale import Scale, tick_text
from jaxmotor.present.report._story import Story
from jaxmotor.words import as_known, between, capital, floor, likely, looks_like, named, plainly, scaled, sentence

NAMES, ROW = 250.0, 24.0
"""Room for the bars' names, and the height of a bar's row, in the drawing."""


def named_section(story: Story) -> Content:
    """Effects in order of their gain, or why none is named."""
    diagnosis = story.diagnosis
    content: list[Content] = [_effect(found, place, diagnosis) for place, found in enumerate(diagnosis.effects)]
    if diagnosis.effects:
        alt = "Left over in data not fitted: " + "; ".join(f"{name} {value:.3g}" for name, value, _ in _rows(diagnosis))
        added = " of residuals that add up over twenty ticks (of angles: a second)" if diagnosis.adds_up else ""
        caption = (
            f"{'Drift left' if diagnosis.adds_up else 'Left'} over in data that were not fitted "
            f"(chi2 per sample{added}, "
            f"1 = {floor(diagnosis.fit.floor_known)}). A star is a rival that this recording cannot tell apart."
        )
        key = legend([("bar grey", "linear"), ("bar blue", "what is named"), ("bar red", "a rival in its place")])
        content.append(figure(_bars(diagnosis, alt), caption, key))
    left = looks_like(diagnosis)
    if left is not None:
        content.append(paragraph(f"{capital(left)}."))
    elif not diagnosis.effects:
        content.append(paragraph("No cause is needed: the linear model leaves nothing that this recording shows."))
    return content


def _effect(found: FoundEffect, place: int, diagnosis: Diagnosis) -> Html:
    """The effect in this place."""
    end = ", beside the other causes." if len(diagnosis.effects) > 1 else "."
    drift = _drift(diagnosis)
    gain = number(
        found.held_out_gain_percent, f"effects.{place}.held_out_gain_percent", f"{found.held_out_gain_percent:.3g} %"
    )
    rows = [_parameter(found, name, place) for name in found.parameters]
    return element(
        "div",
        element("h3", capital(named(found.name))),
        paragraph(capital(sentence(found)) + likely(found) + "."),
        paragraph(f"It lowers the {drift} of data that were not fitted by ", gain, end),
        paragraph(element("strong", "What to do: "), found.effect.advice),
        table(f"Parameters of {named(found.name)}", ("parameter", "value", "95 % interval"), rows) if rows else None,
        _rivals(found, place, drift),
    )


def _drift(diagnosis: Diagnosis) -> str:
    """What models are compared by. Residuals of speeds are not added up over some ticks, to see a drift."""
    return "drift chi2" if diagnosis.adds_up else "chi2 per sample"


def _parameter(found: FoundEffect, name: str, place: int) -> list[Content]:
    value, error = found.parameters[name], found.standard_error[name]
    factor, unit = scaled(parameters(found.effect)[name], value)
    shown = number(value, f"effects.{place}.parameters.{name}", as_known(factor * value, factor * error, unit))
    doubt = ", not determined by this recording" if name in found.unknown else ""
    return [element("code", name), shown, between(factor * value, factor * error, unit) + doubt]


def _rivals(found: FoundEffect, place: int, drift: str) -> Content:
    if not found.rivals:
        return None
    rows = []
    for k, rival in enumerate(found.rivals):
        excess = number(rival.chi2_excess, f"effects.{place}.rivals.{k}.chi2_excess", f"{plainly(rival.chi2_excess)}")
        told = "no: it may as well be this" if rival.inseparable else "yes"
        rows.append((named(rival.name), excess, told))
    head = ("instead", f"{drift} above the named one's", "told apart by this recording")
    return table(f"Rivals of {named(found.name)}, the nearest first", head, rows)


def _rows(diagnosis: Diagnosis) -> list[tuple[str, float, str]]:
    """Name, value and look of each bar, from above."""
    worth, several = diagnosis.held_out, len(diagnosis.effects) > 1
    rows = [("linear", worth.drift_before, "bar grey")]
    rows.append((" + ".join(named(found.name) for found in diagnosis.effects), worth.drift_after, "bar blue"))
    for found in diagnosis.effects:
        for rival in found.rivals:
            star = " *" if rival.inseparable else ""
            instead = f" for {named(found.name)}" if several else ""
            rows.append((f"{named(rival.name)}{instead}{star}", worth.drift_after + rival.chi2_excess, "bar red"))
    return [row for row in rows if math.isfinite(row[1])]


def _bars(diagnosis: Diagnosis, alt: str) -> Html:
    """Bars from the floor, 1, on a logarithmic axis, each with its name and its value."""
    rows = _rows(diagnosis)
    scale = Scale.of(np.array([0.9, 1.5, *(max(value, 0.5) for _, value, _ in rows)]), "", log=True)
    left, right, bottom = NAMES, WIDTH - 60.0, 10.0 + ROW * len(rows)
    parts = []
    for tick in scale.ticks():
        x = scale.spot(tick, left, right)
        parts.append(element("path", d=f"M{x:.1f} 6V{bottom:g}", class_="grid"))
        parts.append(element("text", tick_text(tick), x=f"{x:.1f}", y=bottom + 14, text_anchor="middle"))
    for k, (name, value, look) in enumerate(rows):
        begin, end = sorted(scale.place(np.array([1.0, max(value, 0.5)]), left, right))
        top = 10.0 + ROW * k
        parts.append(element("text", _short(name), x=left - 8, y=top + 14, text_anchor="end"))
        size = {"x": f"{begin:.1f}", "y": top + 3, "width": f"{end - begin:.1f}", "height": ROW - 9}
        parts.append(element("rect", class_=look, **size))
        parts.append(element("text", plainly(value), x=f"{end + 5:.1f}", y=top + 14))
    floor = scale.spot(1.0, left, right)
    parts.append(element("path", d=f"M{floor:.1f} 6V{bottom:g}", class_="axis"))
    return element("svg", parts, viewBox=f"0 0 {WIDTH:g} {bottom + 20:g}", role="img", aria_label=alt, class_="plot")


def _short(name: str) -> str:
    return name if len(name) <= 38 else name[:37] + "…"
