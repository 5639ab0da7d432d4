"""What laws need to know of a recording beside its voltage: supply, angle of the shaft, warmth of the winding."""

import numpy as np

from jaxmotor._precision import to_jax
from jaxmotor.estimate import pack
from jaxmotor.motor import Motor
from jaxmotor.motor import warmth as followed_warmth
from jaxmotor.motor.effects import Heard, WindingHeating
from jaxmotor.recording import Recording


def bridge_supply(recording: Recording) -> float:
    """Nominal supply, or the largest voltage that was applied where none is stated [V]."""
    largest = max(float(np.abs(segment.volts).max()) for segment in recording.segments)
    return max(recording.supply_V or 0.0, largest, 1e-3)


def shaft_angles(recording: Recording) -> list[np.ndarray] | None:
    """(n,) measured angle of each segment [rad], all from one zero; None where that is not known."""
    segments = recording.segments
    if recording.measured == "speed" or (recording.count_resets and len(segments) > 1):
        return None
    if recording.measured == "angle":
        return [np.asarray(segment.angle_rad) for segment in segments]
    assert recording.counts_per_rev is not None
    return [np.asarray(segment.count) * (2 * np.pi / recording.counts_per_rev) for segment in segments]


def warmth(motor: Motor, recording: Recording) -> list[np.ndarray] | None:
    """(n,) relative rise of the winding's resistance in each segment; None where `motor` has no law of it.

    It is followed through all that was measured, in its order: what is not scored heats the winding, too.
    """
    if not any(isinstance(effect, WindingHeating) for effect in motor.effects):
        return None
    packed = pack(recording, tuple(range(len(recording.segments))))
    lanes, unit = packed.lanes, packed.observation.unit
    cells = packed.segment_of >= 0
    time = np.array([segment.start_s for segment in recording.segments])[packed.segment_of] + packed.time_s
    order = np.argsort(time[cells], kind="stable")
    duration, _ = packed.durations
    speed, variance = lanes.observed * unit, unit**2 / 12
    if packed.observation.kind == "turn":
        speed, variance = speed / np.asarray(lanes.duration), 2 * variance / duration**2
    # A tick without a measurement moved about as the one before it.
    speed = np.where(lanes.valid, speed, np.roll(speed, 1, axis=1))
    volts, speed, time = (to_jax(column[cells][order]) for column in (lanes.volts, speed, time))
    length, supply, noise = (to_jax(np.float64(number)) for number in (duration, bridge_supply(recording), variance))
    rise = followed_warmth(to_jax(motor), Heard(volts, speed, time, None, length, supply, noise))
    return _by_segment(recording, packed.segment_of[cells][order], packed.row_of[cells][order], np.asarray(rise))


def _by_segment(recording: Recording, segment: np.ndarray, row: np.ndarray, values: np.ndarray) -> list[np.ndarray]:
    """`values` of some rows as a column for each segment; the rows before its first of them are like it."""
    columns = []
    for index, one in enumerate(recording.segments):
        mine = segment == index
        column = np.zeros(len(one))
        column[row[mine]] = values[mine]
        if mine.any():
            column[: row[mine].min()] = values[mine][row[mine].argmin()]
        columns.append(column)
    return columns
