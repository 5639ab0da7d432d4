"""The motor and its recording: what is known of the rig, what was done, and how it turned."""

from collections import Counter
from collections.abc import Mapping
from typing import Any

import numpy as np

from jaxmotor.present._overview import overview
from jaxmotor.present.report._drawing import drawing
from jaxmotor.present.report._html import Content, Html, details, element, table
from jaxmotor.present.report._page import figure
from jaxmotor.present.report._story import Story
from jaxmotor.recording import Recording, lost_ticks, ranges
from jaxmotor.text import key_title, named, plainly

MOST_SEGMENTS = 400
"""Rows of the table of segments."""
FREE_TEXT = ("motor", "rig", "firmware", "created", "notes")
LONGEST = 2_000
"""Characters of free text that are shown."""


def motor_section(story: Story) -> Content:
    """Free text of the header, the rig, the experiments, and a picture of all of it."""
    recording = story.recording
    return [
        table("What the recording says of itself", ("what", "value"), _facts(recording)),
        _overview(recording),
        details("All segments", _segments(recording), printed=False),
    ]


def _facts(recording: Recording) -> list[tuple[str, str]]:
    free = [(key, _cut(recording.header[key])) for key in FREE_TEXT if recording.header.get(key)]
    last = recording.segments[-1]
    kinds = Counter(segment.kind for segment in recording.segments)
    facts = [
        ("experiments", ", ".join(f"{number} {named(kind)}" for kind, number in kinds.items())),
        ("rows", f"{_rows(recording)}, over {last.start_s + last.time_s[-1]:.4g} s"),
        ("measured", _measured(recording)),
    ]
    if recording.period_s is not None:
        facts.append(("period", f"{1e3 * recording.period_s:g} ms"))
    else:
        facts.append(("time stamps", f"uneven: rows are {spacing(recording)}"))
    if recording.supply_V is not None:
        facts.append(("supply", f"{recording.supply_V:g} V"))
    if recording.drive is not None:
        facts.append(("drive between pulses", recording.drive))
    others = [(key_title(key), _cut(value)) for key, value in recording.header.items() if key not in FREE_TEXT]
    return free + facts + others


def _rows(recording: Recording) -> str:
    """How many, and, where there are ticks, how many of those were lost."""
    rows = str(sum(map(len, recording.segments)))
    if recording.period_s is None:
        return rows
    return f"{rows}, {sum(lost_ticks(segment) for segment in recording.segments)} ticks lost"


def spacing(recording: Recording) -> str:
    """Time from row to row within the segments, from the least to the largest, and the median."""
    steps_ms = 1e3 * np.concatenate([np.diff(segment.time_s) for segment in recording.segments])
    if not len(steps_ms):
        return "alone in their experiments"
    return f"{steps_ms.min():.3g} to {steps_ms.max():.3g} ms apart, in the median {np.median(steps_ms):.3g} ms"


def _measured(recording: Recording) -> str:
    if recording.measured == "count" and recording.counts_per_rev:
        return f"encoder counts, {recording.counts_per_rev:g} per turn of the output shaft"
    return {"count": "encoder counts", "angle": "angle of the shaft"}.get(recording.measured, "speed of the shaft")


def _cut(value: Any) -> str:
    if isinstance(value, Mapping):
        value = ", ".join(f"{key} = {one}" for key, one in value.items())
    text = f"{value:.6g}" if isinstance(value, float) else str(value)
    return text if len(text) <= LONGEST else text[:LONGEST] + "…"


def _overview(recording: Recording) -> Html:
    last = recording.segments[-1]
    over = f"the {last.start_s + last.time_s[-1]:.4g} seconds of the recording, {len(recording.segments)} segments"
    drawn = drawing(overview(recording), "overview", alt=f"Voltage and speed over {over}")
    return figure(drawn, "The whole recording, as far as a screen can show it.")


def _segments(recording: Recording) -> Content:
    rows = []
    for index, segment in enumerate(recording.segments[:MOST_SEGMENTS]):
        about = ", ".join(f"{key_title(key)} = {_cut(value)}" for key, value in segment.parameters.items())
        length = plainly(float(segment.time_s[-1]), 4)
        rows.append((str(index), named(segment.kind), plainly(segment.start_s, 5), length, str(len(segment)), about))
    head = ("segment", "kind", "begins (s)", "length (s)", "rows", "parameters")
    left = recording.segments[MOST_SEGMENTS:]
    more = element("p", f"and segments {ranges(range(MOST_SEGMENTS, len(recording.segments)))}") if left else None
    return [table("The experiments", head, rows), more]
