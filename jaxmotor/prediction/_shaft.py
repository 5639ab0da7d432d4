"""What laws need to know of a recording beside its voltage: supply, angle of the shaft, what heated the winding."""

import numpy as np
from jaxtyping import Int

from jaxmotor._precision import to_jax
from jaxmotor.motor.effects import MeasuredLog
from jaxmotor.prediction._packing import Packed
from jaxmotor.recording import Recording, Segment, angle_of


def supply_of(recording: Recording) -> float:
    """Nominal supply, or the largest voltage that was applied where none is stated [V]."""
    largest = max(float(np.abs(segment.volts).max()) for segment in recording.segments)
    return max(recording.supply_V or 0.0, largest, 1e-3)


def shaft_angles(recording: Recording) -> list[np.ndarray] | None:
    """(n,) measured angle of each segment [rad], all from one zero; None where that is not known."""
    segments, is_speed = recording.segments, recording.measured == "speed"
    alone = len(segments) == 1
    if not (is_speed or (recording.count_resets and not alone)):
        return [segment.shaft * (recording.count_rad if segment.count is not None else 1.0) for segment in segments]
    begins = [0.0] if alone else [segment.begins_rad for segment in segments]
    window_s = recording.speed_window_s or 0.0
    turned = [_integrated(one, window_s) if is_speed else angle_of(recording, one) for one in segments]
    known = [at + angle for at, angle in zip(begins, turned, strict=True) if at is not None and angle is not None]
    return known if len(known) == len(segments) else None


def _integrated(segment: Segment, window_s: float) -> np.ndarray | None:
    """(n,) angle of a log of mean speeds over `window_s` before each row [rad], from 0 on; None where rows are lost.

    The integral of such means is the mean angle over the window, which was the shaft's half a window before.
    """
    assert segment.speed_rad_s is not None
    if segment.tick is not None and segment.tick[-1] - segment.tick[0] >= len(segment):
        return None
    time, speed = segment.time_s, segment.speed_rad_s
    mean = 0.5 * (speed[1:] + speed[:-1])
    return np.append(0.0, np.cumsum(mean * np.diff(time))) + 0.5 * window_s * speed


def measured_log(recording: Recording, packed: Packed) -> MeasuredLog:
    """All rows of `packed` in the order in which they were measured, for what goes on from one experiment to the next.

    There are as many as `packed` has room for, the last of them empty: one program serves many recordings.
    """
    cells, batch, unit = packed.segment_of >= 0, packed.batch, packed.observation.unit
    time = time_of(recording, packed)
    order = np.argsort(time[cells], kind="stable")
    duration, _ = packed.durations
    speed, variance = batch.observed * unit, unit**2 / 12
    if packed.observation.kind == "turn":
        speed, variance = speed / np.asarray(batch.duration), 2 * variance / duration**2
    # A tick without a measurement moved about as the one before it.
    speed = np.where(batch.valid, speed, np.roll(speed, 1, axis=1))
    padding = np.zeros(cells.size - len(order))
    volts, speed, time = (np.concatenate([array[cells][order], padding]) for array in (batch.volts, speed, time))
    length, supply, noise = (np.float64(number) for number in (duration, supply_of(recording), variance))
    return to_jax(MeasuredLog(volts, speed, time, np.int32(len(order)), length, supply, noise))  # pyright: ignore[reportArgumentType]


def rows_in_log(recording: Recording, packed: Packed, everything: Packed) -> Int[np.ndarray, "sequence row"]:
    """Which row of `measured_log(recording, everything)` each row of `packed` is, or is followed by in its segment."""
    cells, many = everything.segment_of >= 0, max(map(len, recording.segments))
    number = everything.segment_of[cells] * many + everything.row_of[cells]
    known = np.argsort(number)
    wanted = np.searchsorted(number[known], packed.segment_of * many + packed.row_of)
    place = np.argsort(np.argsort(time_of(recording, everything)[cells], kind="stable"))
    rows = place[known[np.minimum(wanted, len(known) - 1)]]
    return np.where(packed.segment_of >= 0, rows, 0).astype(np.int32)


def time_of(recording: Recording, packed: Packed) -> np.ndarray:
    """(sequence, row) since the recording began [s]; zero where there is no row."""
    start = np.array([segment.start_s for segment in recording.segments])
    return np.where(packed.segment_of >= 0, start[packed.segment_of] + packed.time_s, 0.0)
