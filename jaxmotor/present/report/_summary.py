"""The first screen: the motor in plain words, one picture, its numbers, how sure they are, and what to do next."""

import math
from collections.abc import Iterator

from jaxmotor.diagnosis import Diagnosis, FoundEffect
from jaxmotor.present.report._gain import traces
from jaxmotor.present.report._html import Content, Html, bar, bullets, element, number, paragraph, table
from jaxmotor.present.report._named import named_in
from jaxmotor.present.report._page import cards
from jaxmotor.present.report._story import Story
from jaxmotor.text import (
    RPM,
    bracket,
    capital,
    either,
    equals,
    family_of,
    if_determined,
    looks_like,
    named,
    odds,
    percent,
    spoken,
    with_error,
)

SENTENCES = {
    "complete": "This is a linear motor: its speed follows the voltage in proportion, and the recording shows no more.",
    "extended": "This is a linear motor with {names}; that explains all that the recording shows.",
    "undecided": "A linear motor explains all that the recording shows, but {names} would not show under this input.",
    "unexplained": "A linear motor{names} explains a part of what this motor does; no known effect explains the "
    "residual.",
    "useless": "No known effect explains what this motor does{names}. The model predicts {data} {how} better than "
    "their mean does ({score}): do not use its numbers.",
}
LITTLE_FIT = 5.0
"""Fit [%], below which nine tenths of the variance of the measured speed are left: 0.95² of it."""
SURE, LIKELY = 0.9, 0.5
"""Probabilities from which an effect is told without doubt, and without its alternatives."""


def summary(story: Story) -> Content:
    """What somebody who reads no further should know."""
    diagnosis = story.diagnosis
    return [
        paragraph(capital(f"{_file(story)}fit of {_scores(diagnosis)}"), class_="quiet"),
        element("div", paragraph(_sentence(diagnosis)), cards(_numbers(story)), class_="verdict"),
        traces(diagnosis, story.recording),
        element(
            "div", element("div", _sure(diagnosis), class_="odds"), element("div", _next(diagnosis)), class_="beside"
        ),
    ]


def motor_name(story: Story) -> str:
    """As the header states it; else the file's name."""
    return str(story.recording.header.get("motor") or story.recording.name)


def _file(story: Story) -> str:
    """Its name where that is not the title."""
    name = story.recording.name
    return "" if motor_name(story) == name else f"Recording {name}; "


def is_useless(diagnosis: Diagnosis) -> bool:
    """The residual is not explained, and the held-out data may be predicted no better than by their mean."""
    score = diagnosis.held_out.after_intervals.fit_percent
    return _is_unexplained(diagnosis) and (score.low <= 0 or score.value < LITTLE_FIT)


def _is_unexplained(diagnosis: Diagnosis) -> bool:
    return diagnosis.verdict == "unexplained" and not diagnosis.undecided


def _sure(diagnosis: Diagnosis) -> Content:
    text = "± is a 95 % interval"
    if is_useless(diagnosis):
        text += " as if the model were right, which it is not"
    if diagnosis.open_hypotheses and diagnosis.allowed is not None:
        (low, high), (slow, fast) = diagnosis.allowed
        most = f"to {1e3 / slow:.4g} ms" if slow > 0 else "ms or more"
        text += (
            f"; with what the input leaves open, {RPM * low:.4g} to {RPM * high:.4g} rpm/V and {1e3 / fast:.4g} {most}"
        )
    return [
        element("h2", "How sure"),
        paragraph(f"{text}."),
        [_odds(found, path) for path, found in named_in(diagnosis)],
        None if diagnosis.named else paragraph("No effect was named, so none has a probability."),
    ]


def _scores(diagnosis: Diagnosis) -> str:
    before, after = diagnosis.held_out.before.fit_percent, diagnosis.held_out.after.fit_percent
    return f"{_data(diagnosis)}: linear {before:.1f} %" + (f", extended {after:.1f} %" if diagnosis.named else "")


def _sentence(diagnosis: Diagnosis) -> str:
    if diagnosis.undecided:
        return SENTENCES["undecided"].format(names=" or ".join(one.phrase for one in diagnosis.open_hypotheses))
    names = _causes(diagnosis)
    if is_useless(diagnosis):
        score = diagnosis.held_out.after_intervals.fit_percent
        shown = f"fit {score.value:.1f} %{bracket(score)}, that of the mean is 0 %"
        how = "hardly" if score.value < LITTLE_FIT else "not surely"
        part = f"; likely, but not enough: {names}" if names else ""
        return SENTENCES["useless"].format(names=part, data=_data(diagnosis), how=how, score=shown)
    if diagnosis.verdict == "unexplained" and names:
        names = f" with {names}"
    return SENTENCES[diagnosis.verdict].format(names=names)


def _data(diagnosis: Diagnosis) -> str:
    return "held-out data" if diagnosis.held_out.traces_before else "the data"


def _causes(diagnosis: Diagnosis) -> str:
    """Effects that are more likely than not; where the model needs others to explain all, that it has them."""
    told = [_cause(found) for found in diagnosis.effects if found.is_told]
    if diagnosis.verdict == "extended" and len(told) < len(diagnosis.effects):
        told.append("an effect that this recording does not determine")
    return " and ".join(told)


def _cause(found: FoundEffect) -> str:
    """The effect as surely as its probability allows: with its alternatives where it is not the likelier, as one of
    its family where it may only imitate another one."""
    if not found.is_named:
        return f"{family_of(found.effect)} (most like {named(found.name)})"
    if equals(found) and (found.is_one_of_several or found.probability < LIKELY):
        return f"{either([found.name, *equals(found)])} (indistinguishable in this recording)"
    return named(found.name) if found.probability >= SURE else f"{named(found.name)} (probably)"


def _numbers(story: Story) -> Iterator[tuple[str, Content]]:
    linear, error = story.diagnosis.motor.linear, story.diagnosis.standard_error
    gain, gain_error = float(linear.gain), error["gain_rad_s_V"]
    pole, pole_error = float(linear.pole), error["pole_rad_s"]
    # Where nobody knows the supply, 1 V stands for all of it.
    of, per = ("at full duty", "") if story.recording.header.get("supply_unknown") is True else ("per volt", "/V")
    told = with_error if is_useless(story.diagnosis) else if_determined
    rpm = told(RPM * gain, RPM * gain_error, f"rpm{per}")
    tau_ms = told(1e3 / pole, 1e3 * pole_error / pole**2, "ms")
    if is_useless(story.diagnosis):
        yield f"speed {of}", _unusable(rpm)
        yield "time constant", _unusable(tau_ms)
        yield "friction", "not known"
        return
    yield f"speed {of}", [rpm, element("br"), with_error(gain, gain_error, f"rad/s{per}")]
    yield "time constant", [tau_ms, element("br"), element("small", "until 63 % of a new speed")]
    yield "friction", [_friction(story.diagnosis)]


def _unusable(fitted: str) -> Content:
    return ["not known", element("br"), element("small", f"fitted: {fitted}, not to be used")]


def _friction(diagnosis: Diagnosis) -> Content:
    """The voltage below which the motor stays at rest, and what that means."""
    unexplained = _is_unexplained(diagnosis)
    holding = [found for found in diagnosis.effects if found.effect.holds_by and (found.is_told or not unexplained)]
    if holding:
        volts = sum(found.parameters[found.effect.holds_by] for found in holding)
        errors = [found.standard_error[found.effect.holds_by] for found in holding]
        doubt = "if it is that, " if min(found.probability for found in holding) < LIKELY else ""
        meaning = f"{doubt}below {volts:.2g} V it does not move"
        return [with_error(volts, math.hypot(*errors), "V"), element("br"), element("small", meaning)]
    hidden = [one.largest for one in diagnosis.open_hypotheses if one.name in ("friction", "dead zone")]
    if hidden:
        return f"not known: up to {max(hidden):.2g} V would not show"
    return "not known" if unexplained else "none found"


def _odds(found: FoundEffect, path: str) -> Html:
    """The probabilities of an effect, of its alternatives and of none of them, as bars."""
    rows: list[list[Content]] = []
    for name, share in odds(found):
        shown = number(share, f"{path}.probability", percent(share)) if not rows else percent(share)
        rows.append([name, bar(share, "grey" if rows else "blue"), shown])
    return table(f"Probability of {named(found.name)}", ("cause", "", ""), rows)


def _next(diagnosis: Diagnosis) -> Content:
    told: list[Content] = []
    for found in (one for one in diagnosis.named if one.is_told):
        is_likely = found.probability >= LIKELY and not found.is_one_of_several
        name = capital(named(found.name)) if is_likely else f"If it is {named(found.name)}"
        told.append(f"{name}: {found.effect.advice}")
    left = looks_like(diagnosis)
    told += [] if left is None else [f"{capital(left)}."]
    told += [f"{capital(one.note)}." for one in diagnosis.open_hypotheses if diagnosis.undecided]
    plans = [one for one in diagnosis.experiments if one.plan is not None]
    told += [f"{capital(spoken(one.text))}." for one in diagnosis.experiments if one.plan is None][:1]
    told += [
        [f"Record next: {spoken(one.text)} (", element("a", "the plan", href="#limits"), ")."] for one in plans[:1]
    ]
    told = told or ["Use the model: simulate it, or export it to a controller (jaxmotor export)."]
    return [element("h2", "What to do next"), bullets(told)]
