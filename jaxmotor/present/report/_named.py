"""The effects that were named: what each does, how large it is, and which alternatives there are."""

import math

from jaxmotor.diagnosis import Diagnosis, FoundEffect
from jaxmotor.motor.effects import parameters, told_parameters
from jaxmotor.present.report._html import Content, Html, bar, element, number, paragraph, table
from jaxmotor.present.report._story import Story
from jaxmotor.text import (
    as_known,
    between,
    capital,
    floor,
    looks_like,
    named,
    parameter_title,
    plainly,
    scaled,
    sentence,
)


def named_section(story: Story) -> Content:
    """Effects in order of their gain, and the alternatives to them; or why none is named."""
    diagnosis = story.diagnosis
    content: list[Content] = [_effect(found, path, diagnosis) for path, found in named_in(diagnosis)]
    if diagnosis.named:
        content.append(_models(diagnosis))
    left = looks_like(diagnosis)
    if left is not None:
        content.append(paragraph(f"{capital(left)}."))
    elif not diagnosis.named:
        content.append(paragraph("No effect is needed: the residual of the linear model is no more than noise."))
    return content


def named_in(diagnosis: Diagnosis) -> list[tuple[str, FoundEffect]]:
    """Effects and disturbances, each with its place in the JSON of `diagnosis`."""
    parts = {"effects": diagnosis.effects, "disturbances": diagnosis.disturbances}
    return [(f"{part}.{place}", found) for part, every in parts.items() for place, found in enumerate(every)]


def _effect(found: FoundEffect, path: str, diagnosis: Diagnosis) -> Html:
    """The effect at this place of the JSON."""
    end = ", beside the other effects." if len(diagnosis.named) > 1 else "."
    percent = found.held_out_gain_percent
    gain = number(percent, f"{path}.held_out_gain_percent", f"{percent:.3g} %")
    rows = [_parameter(found, name, path) for name in told_parameters(found.effect)]
    return element(
        "div",
        element("h3", capital(f"{'' if found.is_sure else 'perhaps '}{named(found.name)}")),
        paragraph(f"{capital(sentence(found))}. It lowers the {_drift(diagnosis)} of held-out data by ", gain, end),
        table(f"Parameters of {named(found.name)}", ("parameter", "value", "95 % interval"), rows) if rows else None,
    )


def _drift(diagnosis: Diagnosis) -> str:
    """What models are compared by: residuals of speeds are not summed over ticks."""
    return "drift chi2" if diagnosis.adds_up else "chi2 per sample"


def _parameter(found: FoundEffect, name: str, path: str) -> list[Content]:
    value, error = found.parameters[name], found.standard_error[name]
    factor, unit = scaled(parameters(found.effect)[name], value)
    shown = number(value, f"{path}.parameters.{name}", as_known(factor * value, factor * error, unit))
    doubt = ", not determined by this recording" if name in found.unknown else ""
    return [parameter_title(name), shown, between(factor * value, factor * error, unit) + doubt]


def _models(diagnosis: Diagnosis) -> Content:
    """Each model on held-out data: linear, extended, and with an alternative in an effect's place."""
    scores, several = diagnosis.held_out, len(diagnosis.named) > 1
    extended = " + ".join(named(found.name) for found in diagnosis.named)
    models: list[tuple[str, float, str, Content, str]] = [
        ("linear", scores.drift_before, "grey", "", ""),
        (extended, scores.drift_after, "blue", "", ""),
    ]
    for path, found in named_in(diagnosis):
        for k, one in enumerate(found.alternatives):
            name = f"{named(one.name)} instead{f' of {named(found.name)}' if several else ''}"
            key, excess = f"{path}.rivals.{k}.chi2_excess", one.chi2_excess
            shown = number(excess, key, plainly(excess))
            models.append((name, scores.drift_after + excess, "red", shown, "no" if one.inseparable else "yes"))
    most = math.log(max([2.0, *(value for _, value, *_ in models if math.isfinite(value))]))
    rows = [
        (name, bar(math.log(max(value, 1.0)) / most, style), plainly(value), more, told)
        for name, value, style, more, told in models
        if math.isfinite(value)
    ]
    summed = ", of residuals summed over twenty ticks (of angles: over a second)" if diagnosis.adds_up else ""
    caption = (
        f"Alternatives: chi2 per sample of held-out data{summed}; "
        f"1 = {floor(diagnosis.fit.floor_known)}, bars are logarithmic"
    )
    return table(caption, ("model", "", _drift(diagnosis), "above the extended one's", "distinguishable"), rows)
