"""Held-out steps and closed loops: predicted beside measured."""

from jaxmotor.present._validation import controller, step_trials
from jaxmotor.present.report._drawing import drawing
from jaxmotor.present.report._html import Content, Html, details, element, number, paragraph, table
from jaxmotor.present.report._page import figure, runs
from jaxmotor.present.report._story import Story
from jaxmotor.recording import ranges
from jaxmotor.text import compared, with_bracket
from jaxmotor.validation import ClosedLoop, Comparison, StepTrials

MOST = 2
"""Steps, and closed loops, that are drawn at once; the others are folded."""


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
        content.append(runs(items[:MOST]))
        if items[MOST:]:
            content.append(details(f"More {title} ({len(items) - MOST})", runs(items[MOST:])))
    return content


def _steps(place: int, steps: StepTrials) -> Html:
    title = f"Step to {steps.amplitude_V:.3g} V"
    trials = f"mean of {steps.trials} trials" if steps.trials > 1 else "one trial"
    inside = _percent(steps.inside_percent, f"steps.{place}.inside_percent")
    segments = f"Segment{'s' if steps.trials > 1 else ''} {ranges(steps.segments)}, {trials}"
    said = paragraph(f"{segments}: the model's speed is inside the measured band in ", inside, " of the rows.")
    alt = f"{title}: measured and predicted speed, {trials}, and the difference"
    drawn = drawing(step_trials(steps), f"step-{place}", alt=alt)
    return _block(title, said, figure(drawn, "Speed, and below measured minus predicted speed."), steps)


def _loop(place: int, loop: ClosedLoop) -> Html:
    title = f"Closed loop, {loop.gains}, segment {loop.segment}"
    inside = _percent(loop.speed_inside_percent, f"closed_loop.{place}.speed_inside_percent")
    effort = _percent(loop.volts_inside_percent, f"closed_loop.{place}.volts_inside_percent")
    which = f"Reference {loop.reference_rad_s:.4g} rad/s. Measured inside the predicted band: speed in "
    said = paragraph(which, inside, ", voltage in ", effort, " of the ticks.")
    alt = f"{title}: measured and predicted speed and voltage, reference {loop.reference_rad_s:.4g} rad/s"
    drawn = figure(drawing(controller(loop), f"loop-{place}", alt=alt), "Speed above, voltage below.")
    return _block(title, said, drawn, loop, [paragraph(note, class_="quiet") for note in loop.notes])


def _block(title: str, said: Html, drawn: Html, found: StepTrials | ClosedLoop, notes: Content = None) -> Html:
    """What is said and drawn of a step or a loop, and a table of its numbers."""
    rows = [_compared(f"{name} ({unit})", comparison, factor) for name, unit, comparison, factor in compared(found)]
    caption = f"{title}: measured and predicted, with 95 % intervals"
    head = ("", "measured", "predicted", "")
    return element("div", element("h3", title), said, drawn, table(caption, head, rows), notes, class_="run")


def _percent(value: float, key: str) -> Html:
    return number(value, f"validation.{key}", f"{value:.1f} %")


def _compared(name: str, comparison: Comparison, factor: float) -> tuple[str, str, str, str]:
    mark = {True: "inside", False: "outside", None: ""}[comparison.inside]
    measured, predicted = (with_bracket(one, factor) for one in (comparison.measured, comparison.predicted))
    return name, measured, predicted, mark
