"""Held-out steps and closed loops: predicted beside measured."""

import numpy as np

from jaxmotor.present.report._html import Content, Html, details, element, number, paragraph, table
from jaxmotor.present.report._page import figure
from jaxmotor.present.report._plot import Mark, Panel, band, dots, legend, level, line, plot
from jaxmotor.present.report._scale import Scale
from jaxmotor.present.report._story import Story
from jaxmotor.recording import ranges
from jaxmotor.validation import Band, ClosedLoop, Comparison, StepTrials
from jaxmotor.words import with_bracket

MOST = 2
"""Steps, and closed loops, that are drawn at once; the others are folded."""
MOST_ROWS = 600
NUMBERS = (
    ("rise time (ms)", "rise_time_s", 1e3),
    ("final speed (rad/s)", "final_speed_rad_s", 1.0),
    ("overshoot (%)", "overshoot_percent", 1.0),
    ("steady speed (rad/s)", "steady_speed_rad_s", 1.0),
    ("steady error (rad/s)", "steady_error_rad_s", 1.0),
    ("saturated (% of ticks)", "saturated_percent", 1.0),
)
"""Of a step or a closed loop: name, attribute and factor."""


def checks_section(story: Story) -> Content:
    """The paper's own checks, where the recording has the runs."""
    validation = story.validation
    if validation is None:
        return paragraph(f"Not done: {story.not_validated}.")
    text = (
        "The linear motor, identified without the segments below, predicts them: steps in open loop, and speed "
        "controllers with the header's gains. Bands are 95 % intervals of the prediction. Where effects were named "
        "above, the linear motor is expected to fail here."
    )
    content: list[Content] = [paragraph(text)]
    if validation.open_loop is not None:
        score = validation.open_loop.pooled
        fit = _percent(score.fit_percent, "open_loop.pooled.fit_percent")
        chi2 = f", chi2 {score.chi2_per_sample:.3g} per sample."
        content.append(paragraph("Open loop, all these segments together: fit ", fit, chi2))
    drawn: list[Content] = [_steps(k, steps) for k, steps in enumerate(validation.steps)]
    loops: list[Content] = [_loop(k, loop) for k, loop in enumerate(validation.closed_loop)]
    for title, items in (("steps", drawn), ("closed loops", loops)):
        content += items[:MOST]
        if items[MOST:]:
            content.append(details(f"More {title} ({len(items) - MOST})", items[MOST:]))
    return content


def _steps(place: int, steps: StepTrials) -> Html:
    title = f"Step to {steps.amplitude_V:.3g} V"
    trials = f"mean of {steps.trials} trials" if steps.trials > 1 else "one trial"
    inside = _percent(steps.inside_percent, f"steps.{place}.inside_percent")
    segments = f"Segment{'s' if steps.trials > 1 else ''} {ranges(steps.segments)}, {trials}"
    said = paragraph(f"{segments}: the model's speed is inside the measured band in ", inside, " of the rows.")
    panel = _panel(steps.time_s, steps.measured.mean, steps.measured, steps.predicted, "Speed (rad/s)")
    drawing = figure(plot([panel], alt=f"{title}: measured and predicted speed, {trials}"), "Speed.", _key(panel))
    return _block(title, said, drawing, steps)


def _loop(place: int, loop: ClosedLoop) -> Html:
    integral = f" + {loop.integral_gain_V_rad:.3g} V/rad" if loop.kind == "PI" else ""
    title = f"Closed loop, {loop.kind} {loop.gain_V_s_rad:.3g} V s/rad{integral}, segment {loop.segment}"
    speed = _panel(loop.time_s, loop.measured_speed_rad_s, None, loop.speed, "Speed (rad/s)")
    reference = level(speed.x, loop.reference_rad_s, "ink dotted")
    values = np.concatenate([mark.y.ravel() for mark in (*speed.marks, reference)])
    speed = Panel(speed.x, Scale.of(values, "Speed (rad/s)"), [*speed.marks, reference])
    volts = _panel(loop.time_s, loop.measured_volts_V, None, loop.volts, "Effort (V)", height=110.0)
    inside = _percent(loop.speed_inside_percent, f"closed_loop.{place}.speed_inside_percent")
    effort = _percent(loop.volts_inside_percent, f"closed_loop.{place}.volts_inside_percent")
    which = f"Reference {loop.reference_rad_s:.4g} rad/s. Measured inside the predicted band: speed in "
    said = paragraph(which, inside, ", voltage in ", effort, " of the ticks.")
    alt = f"{title}: measured and predicted speed and voltage, reference {loop.reference_rad_s:.4g} rad/s"
    caption = "Speed above (dotted: the reference), voltage below."
    drawing = figure(plot([speed, volts], alt=alt, shared=True), caption, _key(speed))
    return _block(title, said, drawing, loop, [paragraph(note, class_="quiet") for note in loop.notes])


def _block(title: str, said: Html, drawing: Html, found: StepTrials | ClosedLoop, notes: Content = None) -> Html:
    """What is said and drawn of a step or a loop, and a table of its numbers."""
    rows = [
        _compared(name, getattr(found, attribute), factor)
        for name, attribute, factor in NUMBERS
        if hasattr(found, attribute)
    ]
    caption = f"{title}: measured and predicted, with 95 % intervals"
    head = ("", "measured", "predicted", "")
    return element("div", element("h3", title), said, drawing, table(caption, head, rows), notes)


def _panel(
    time: np.ndarray, measured: np.ndarray, around: Band | None, predicted: Band, label: str, height: float = 170.0
) -> Panel:
    every = slice(None, None, 1 + len(time) // MOST_ROWS)
    time, measured = time[every], measured[every]
    marks: list[Mark] = [band(time, predicted.low[every], predicted.high[every])]
    marks.append(line(time, predicted.mean[every], "blue curve", "predicted"))
    if around is not None and np.isfinite(around.low).any():
        ends = (line(time, end[every], "grey") for end in (around.low, around.high))
        marks += ends
    marks.append(dots(time, measured, "dot small ink", "measured"))
    values = np.concatenate([mark.y.ravel() for mark in marks])
    return Panel(Scale.of(time, "Time (s)", margin=0.01), Scale.of(values, label), marks, height)


def _key(panel: Panel) -> Html:
    """Of what is drawn in the panel."""
    around = [("grey", "95 % band of the measurement")] if any(mark.look == "grey" for mark in panel.marks) else []
    known = np.isfinite(panel.marks[0].y).any()
    predicted = [("blue curve", "predicted"), *([("band", "95 % band of the prediction")] if known else [])]
    return legend([("dot ink", "measured"), *around, *predicted])


def _percent(value: float, key: str) -> Html:
    return number(value, f"validation.{key}", f"{value:.1f} %")


def _compared(name: str, comparison: Comparison, factor: float) -> tuple[str, str, str, str]:
    mark = {True: "inside", False: "outside", None: ""}[comparison.inside]
    measured, predicted = (with_bracket(one, factor) for one in (comparison.measured, comparison.predicted))
    return name, measured, predicted, mark
