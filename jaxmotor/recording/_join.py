"""Several recordings of one motor on one rig as one, so that they are explained together."""

import dataclasses
import os
import statistics
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from jaxmotor._arguments import taken
from jaxmotor.recording._pulse_windows import usual_window_s
from jaxmotor.recording._read import recording_of
from jaxmotor.recording._recording import Recording, RecordingError, Segment
from jaxmotor.recording._supply import supplied

PAUSE_S = 1.0
"""Between one recording and the next, of which nothing is known."""
SHARED = {
    "period_s": "a period of {} s",
    "counts_per_rev": "{} counts per turn",
    "duty_full_scale": "a full scale of duty {}",
    "supply_V": "a supply of {} V",
    "drive": "a bridge set to {}",
    "speed_window_s": "speeds over {} s",
    "speed_window_rows": "speeds over {} rows",
    "speed_pulses_per_rev": "speeds from {} pulses per turn",
    "duty_delay_s": "duties that act {} s late",
}
"""What one rig has one of."""
MEANS = ("period_s", "speed_window_s", "speed_window_rows", "speed_pulses_per_rev", "duty_delay_s")
"""What must be stated by all or by none: it says how rows are to be read."""


def join(recordings: Iterable[Recording | str | os.PathLike[str]]) -> Recording:
    """`recordings`, or those in the files of these paths, of one motor on one rig, end to end.

    What only some of them state is taken for all, except what says how rows are to be read: the period, the window of
    speeds, the delay of duties. Where only some hold duties, all hold volts. A pause of a second is put between them.

    **Raises:** `RecordingError` where they were not measured alike, or contradict each other.
    """
    several = (recordings,) if isinstance(recordings, str) else taken(recordings, Iterable, "a list of recordings")
    recordings = [recording_of(one) for one in several]
    if not recordings:
        raise RecordingError("there is nothing to join; name two recordings or more")
    first = recordings[0]
    for other in recordings[1:]:
        if other.measured != first.measured:
            raise RecordingError(
                f"{first.name} holds the {first.measured}, {other.name} the {other.measured}; join what was measured "
                "alike"
            )
    pulses = first.speed_pulses_per_rev
    in_rows = all(one.speed_window_rows is not None and one.speed_window_s for one in recordings)
    # Over how long speeds from pulses, or over rows, usually are is no property of the rig.
    rig = [name for name in SHARED if (pulses is None and not in_rows) or name != "speed_window_s"]
    shared = {name: _agreed(recordings, name) for name in rig}
    segments: list[Segment] = []
    begin = 0.0
    for recording in recordings:
        last = max(float(segment.start_s + segment.time_s[-1]) for segment in recording.segments)
        segments += [dataclasses.replace(one, start_s=begin + one.start_s) for one in recording.segments]
        begin += last + PAUSE_S
    if pulses is not None:
        shared["speed_window_s"] = usual_window_s(segments, pulses)
    elif in_rows:
        shared["speed_window_s"] = statistics.median(one.speed_window_s or 0.0 for one in recordings)
    if any(one.duty is None for one in segments):
        segments = [dataclasses.replace(one, duty=None) for one in segments]
        shared["duty_full_scale"] = None
    header = {key: value for recording in reversed(recordings) for key, value in recording.header.items()}
    header["joined"] = [Path(recording.source).name for recording in recordings]
    resets = len(recordings) > 1 or first.count_resets
    joined = dataclasses.replace(first, segments=tuple(segments), count_resets=resets, header=header, **shared)
    return supplied(joined)


def _agreed(recordings: Sequence[Recording], name: str) -> Any:
    stated = [one for one in recordings if getattr(one, name) is not None]
    values = {getattr(one, name) for one in stated}
    if len(values) > 1:
        one, other = stated[0], next(one for one in stated if getattr(one, name) != getattr(stated[0], name))
        says = SHARED[name].format(f"{getattr(one, name)}"), SHARED[name].format(f"{getattr(other, name)}")
        raise RecordingError(
            f"{one.name} has {says[0]}, {other.name} {says[1]}; only recordings of one rig can be joined"
        )
    if name in MEANS and stated and len(stated) < len(recordings):
        other = next(one for one in recordings if getattr(one, name) is None)
        what = SHARED[name].format(f"{getattr(stated[0], name)}")
        raise RecordingError(
            f"{stated[0].name} has {what}, {other.name} states none; "
            "import it again with the same, or state it in its header"
        )
    return values.pop() if values else None
