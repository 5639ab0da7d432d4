"""A recording without the speeds and angles that no motor has."""

import dataclasses

from jaxmotor.recording._jumps import spikes
from jaxmotor.recording._recording import Recording
from jaxmotor.recording._unread import filled


def without_spikes(recording: Recording) -> Recording:
    """`recording`, in which rows whose speed or angle is one of its `spikes` have no reading; its header says how many
    they are."""
    name = "speed_rad_s" if recording.measured == "speed" else "angle_rad"
    segments, number = list(recording.segments), 0
    for index, row, rows in spikes(recording):
        segment = segments[index]
        unread = ~segment.read
        unread[row : row + rows] = True
        segments[index] = dataclasses.replace(
            segment, unread=unread, **{name: filled(segment.shaft, segment.time_s, unread)}
        )
        number += rows
    header = {**recording.header, "imported": {**recording.header["imported"], "spikes": number}}
    return dataclasses.replace(recording, segments=tuple(segments), header=header) if number else recording
