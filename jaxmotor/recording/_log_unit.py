"""The unit in which the shaft was logged, for messages."""

from collections.abc import Mapping
from typing import NamedTuple

from jaxmotor.recording._recording import Recording, RecordingError
from jaxmotor.recording._units import Scale, angle_factor, speed_factor, split_factor


class LogUnit(NamedTuple):
    """A unit of the shaft's angle or speed."""

    name: str
    si: float
    """One of it [rad or rad/s]."""


def log_unit(recording: Recording) -> LogUnit:
    """The unit of the log that `recording` was imported from, without a number before it; counts, rad or rad/s where it
    was not."""
    if recording.measured == "count":
        return LogUnit("counts", recording.count_rad)
    imported = recording.header.get("imported")
    stated = imported.get(recording.measured) if isinstance(imported, Mapping) else None
    factor = angle_factor if recording.measured == "angle" else speed_factor
    try:
        name = split_factor(str(stated).rpartition(":")[2])[1]
        return LogUnit(name, factor(name, Scale(recording.counts_per_rev)))
    except RecordingError:
        return LogUnit("rad" if recording.measured == "angle" else "rad/s", 1.0)
