"""The extended motor with its intervals, and how well both motors predict held-out segments."""

import math

import numpy as np

from jaxmotor.diagnosis import BeforeAfter, Diagnosis, FoundEffect, LoopGain
from jaxmotor.estimate import Trace, fit_percent
from jaxmotor.motor.effects import told_parameters
from jaxmotor.present._autocorrelation import autocorrelation
from jaxmotor.present._before_after import before_after, best_gain, loop_before_after, squared_error_fall
from jaxmotor.present.report._drawing import drawing
from jaxmotor.present.report._html import Content, Html, details, element, number, paragraph, table
from jaxmotor.present.report._page import figure, runs
from jaxmotor.present.report._story import Story
from jaxmotor.recording import Recording
from jaxmotor.text import (
    LOOP,
    as_known,
    between,
    bracket,
    capital,
    floor,
    loop_of,
    named,
    parameter_title,
    percent,
    plainly,
    scaled,
    scored,
)

MOST_LOOPS = 2
MOST_SEGMENTS = 200
LINEAR = {
    "gain_rad_s_V": ("gain", "gain", 1.0, "rad/s/V", -math.inf),
    "pole_rad_s": ("pole", "pole", 1.0, "rad/s", -math.inf),
    "electrical_time_constant_s": ("electrical time constant", "electrical_time_constant", 1e3, "ms", 1e-7),
    "viscous_share": ("viscous share", "viscous_share", 1e2, "%", 0.0),
}
"""Name, attribute, factor and unit for people of the linear part's parameters, and the value of one that is absent."""


def model_section(story: Story) -> Content:
    """The linear motor and the extended one, parameter by parameter."""
    diagnosis = story.diagnosis
    rows = []
    for key, (name, attribute, _, _, none) in LINEAR.items():
        motor = diagnosis.motor if key == "viscous_share" else diagnosis.motor.linear
        alone, beside = (float(getattr(one, attribute, 0.0)) for one in (diagnosis.fit.motor, motor))
        if max(alone, beside) > none:
            error = float(getattr(diagnosis.fit.standard_error, attribute, math.nan))
            extended = _cells("model", key, beside, diagnosis.standard_error.get(key, math.nan))
            rows.append([name, *_cells("fit", key, alone, error), *(extended if diagnosis.named else [])])
    head, correlation = ["", "linear motor", "95 % interval"], _correlation(diagnosis)
    if not diagnosis.named:
        return [table("The linear motor", head, rows), correlation]
    rows += _effects(diagnosis)
    text = (
        "Fitted to the whole recording. Gain and pole of the linear motor alone compensate for the effects that it "
        "lacks, so they depend on the experiment; those of the extended motor depend on it less."
    )
    return [paragraph(text), table("Both motors", [*head, "extended motor", "95 % interval"], rows), correlation]


def _correlation(diagnosis: Diagnosis) -> Content:
    """Between the estimates of the parameters of the extended motor, or of the linear one."""
    titles = {key: about[0] for key, about in LINEAR.items()} | {
        f"{found.name}.{name}": _title(found, name)
        for found in diagnosis.named
        for name in told_parameters(found.effect)
    }
    joint = diagnosis.joint.of(tuple(titles))
    error = np.sqrt(np.diag(joint.covariance))
    known = np.flatnonzero(error > 0).tolist()
    correlation = joint.covariance[np.ix_(known, known)] / np.outer(error[known], error[known])
    names = [titles[joint.names[k]] for k in known]
    rows = [
        [name, *(f"{one:+.2f}" if place <= k else "" for place, one in enumerate(row))]
        for k, (name, row) in enumerate(zip(names, correlation, strict=True))
    ]
    caption = "Near ±1 the recording determines a combination of the two better than either"
    return details("Correlation of the estimates", table(caption, ["", *names], rows)) if len(known) > 1 else None


def _cells(motor: str, key: str, value: float, error: float) -> list[Content]:
    """Value and interval."""
    _, _, factor, unit, _ = LINEAR[key]
    if not value and not math.isfinite(error):
        return ["not fitted", ""]
    known = factor * value, factor * error, unit
    return [number(value, f"{motor}.{key}", as_known(*known)), between(*known)]


def _effects(diagnosis: Diagnosis) -> list[list[Content]]:
    rows: list[list[Content]] = []
    for found in diagnosis.effects:
        for name, about in told_parameters(found.effect).items():
            factor, unit = scaled(about, found.parameters[name])
            known = (factor * found.parameters[name], factor * found.standard_error[name], unit)
            rows.append([_title(found, name), "none", "", as_known(*known), between(*known)])
    return rows


def _title(found: FoundEffect, parameter: str) -> str:
    return f"{named(found.name)}, {parameter_title(parameter)}"


def gain_section(story: Story) -> Content:
    """The verdict, scores of both motors, each held-out segment, and closed loops."""
    diagnosis = story.diagnosis
    verdict = element("strong", diagnosis.outcome, id="verdict")
    content: list[Content] = [
        paragraph("Verdict: ", verdict, f". The scores are of {scored(diagnosis)}."),
        _scores(diagnosis),
    ]
    if diagnosis.held_out.traces_before:
        content.append(details("Each held-out segment", _runs(diagnosis, story.recording)))
    content.append(details("Autocorrelation of the residual", _white(diagnosis)))
    loops = [_loop(place, gain, diagnosis) for place, gain in enumerate(diagnosis.closed_loop[:MOST_LOOPS])]
    return [*content, runs(loops)]


def _loop(place: int, gain: LoopGain, diagnosis: Diagnosis) -> Html:
    """A closed loop as both motors would have run it, with the numbers that a controller is judged by."""
    before, after, extended = gain.before, gain.after, bool(diagnosis.named)
    rows = []
    for name, title, factor, unit in (*LOOP, ("rmse_rad_s", "RMSE of the speed", 1.0, "rad/s")):
        one, other = getattr(before, name), getattr(after, name)
        measured = "" if name == "rmse_rad_s" else plainly(factor * one.measured.value)
        key = f"closed_loop.{place}.{name}"
        row: list[Content] = [f"{title} ({unit})", measured]
        for when, value in (("before", one), ("after", other))[: 2 if extended else 1]:
            predicted = value if name == "rmse_rad_s" else value.predicted
            limits = tuple(factor * number for number in predicted)
            row.append([number(predicted.value, f"{key}_{when}", plainly(limits[0])), bracket(limits)])
        rows.append(row)
    head = ["", "measured", "linear", *(["extended"] if extended else [])]
    caption = capital(loop_of(gain))
    drawn = drawing(loop_before_after(gain), f"gain-{place}", alt=f"Speed in the {loop_of(gain)}")
    told = table("The header's controller on both motors, with 95 % intervals", head, rows)
    return element("div", figure(drawn, caption), told, class_="run")


def _scores(diagnosis: Diagnosis) -> Content:
    caption = "Held-out data: free simulation under the logged voltage"
    held_out = _score_table(caption, "held_out", diagnosis.held_out, diagnosis)
    whole = _score_table("Fitted to all segments, and scored on all", "whole", diagnosis.whole, diagnosis)
    return [held_out, details("The same on the whole recording", whole)]


def _score_table(caption: str, key: str, compared: BeforeAfter, diagnosis: Diagnosis) -> Html:
    scores = {
        "fit_percent": ("fit (%)", "fit_percent"),
        "chi2": (f"chi2 per sample (1 = {floor(diagnosis.fit.floor_known)})", "chi2_per_sample"),
        "drift_chi2": ("drift chi2 per sample", ""),
        "rmse_rad_s": ("RMSE (rad/s)", "rmse_rad_s"),
        "rmse_counts": ("RMSE (counts)", "rmse_counts"),
    }
    if not diagnosis.fit.floor_known:
        # Without counts residuals are not summed over ticks, and the drift is chi2 again.
        del scores["drift_chi2"], scores["rmse_counts"]
    whens = ("before", "after")[: 2 if diagnosis.named else 1]
    rows = []
    for name, (title, attribute) in scores.items():
        row: list[Content] = [title]
        for when in whens:
            value = getattr(getattr(compared, when), attribute) if attribute else getattr(compared, f"drift_{when}")
            interval = getattr(getattr(compared, f"{when}_intervals"), attribute, None)
            shown = number(value, f"{key}.{name}_{when}", plainly(value, 4))
            row.append([shown, "" if interval is None else bracket(interval)])
        rows.append(row)
    return table(caption, ["", *("linear", "extended")[: len(whens)]], rows)


def traces(diagnosis: Diagnosis, recording: Recording) -> Html:
    """Measured speed and both motors in the segment in which the extension shows most."""
    before, after = best_gain(diagnosis)
    motors = {"linear": before, **({"extended": after} if diagnosis.named else {})}
    kind = _kind(diagnosis, recording, before)
    scores = ", ".join(f"{name} {fit_percent((trace,)):.1f} %" for name, trace in motors.items())
    held_out = "held out" if diagnosis.held_out.traces_before else "fitted"
    text = f"{_why_shown(diagnosis, before, after)}: {kind}, {held_out}; fit {scores}. "
    text += "Below, the residual (measured minus simulated)."
    return figure(drawing(before_after(diagnosis), "gain", alt=f"Measured and simulated speed. {text}"), text)


def _why_shown(diagnosis: Diagnosis, before: Trace, after: Trace) -> str:
    fall = squared_error_fall(before, after)
    if not diagnosis.named or fall <= 0:
        return "Shown"
    return f"Where the effects lower the squared error most, by {percent(fall)}"


def _white(diagnosis: Diagnosis) -> Content:
    """The autocorrelation of both motors' residuals."""
    whole = diagnosis.whole
    models = {"linear": whole.traces_before, **({"extended": whole.traces_after} if diagnosis.named else {})}
    text = (
        "Autocorrelation of the residual of the speed in free simulation, whole recording: within the band it is white."
    )
    if diagnosis.fit.floor_known:
        text += " Neighbouring speeds share a rounded position: the encoder alone gives minus 0.5 at lag 1."
    return figure(drawing(autocorrelation(models), "autocorrelation", alt=f"{text} Up to 25 rows."), text)


def _kind(diagnosis: Diagnosis, recording: Recording, trace: Trace) -> str:
    kind = recording.segments[trace.segment].kind
    part = "a third of " if trace.segment in diagnosis.held_out.in_part else ""
    return f"{part}a {'segment' if kind == 'other' else named(kind)} (segment {trace.segment})"


def _runs(diagnosis: Diagnosis, recording: Recording) -> Content:
    rows = []
    pairs = zip(diagnosis.held_out.traces_before, diagnosis.held_out.traces_after, strict=True)
    for before, after in list(pairs)[:MOST_SEGMENTS]:
        kind = _kind(diagnosis, recording, before)
        cells = [f"{fit_percent((trace,)):.2f}" for trace in (before, after)]
        rows.append((kind, *cells[: 2 if diagnosis.named else 1]))
    head = ("segment", "linear, fit (%)", *(["extended, fit (%)"] if diagnosis.named else []))
    return table("Free simulation of each held-out segment", head, rows)
