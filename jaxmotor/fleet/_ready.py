"""A recording as arrays of a shape that many recordings share."""

from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np

from jaxmotor._errors import JaxmotorError
from jaxmotor.estimate import (
    Prepared,
    SineData,
    enough_sines,
    needs_more_than_one_frequency,
    pole_range,
    prepare,
    sine_data,
)
from jaxmotor.prediction import Lanes
from jaxmotor.recording import Recording

LANE_STEP = 4
"""Numbers of lanes are rounded up to a multiple of this."""
LEAST_PIECES, LEAST_CLUSTERS = 32, 32


class Key(NamedTuple):
    """What must be equal for motors to be done by one program."""

    lanes: tuple[int, int]
    """Number of lanes and of rows in each."""
    timed: bool
    """Rows have durations of their own."""
    pieces: int
    clusters: int
    kind: str
    floor_known: bool
    free: bool
    """Some piece of one of the motors may begin at an unknown speed."""
    sines: tuple[int, int] | None
    """Number of sines and of rows in each; None where there are not enough of them."""
    sine_kind: str
    sine_window_s: float


class Ready(NamedTuple):
    """One motor, ready for a batch."""

    key: Key
    prepared: Prepared
    arrays: dict[str, np.ndarray]
    """As `Key` shapes them."""


def ready(recording: Recording, hold_out: Iterable[int] = ()) -> Ready:
    """`recording` for a batch. Numpy only.

    **Raises:** `JaxmotorError`, as `identify`.
    """
    prepared = prepare(recording, hold_out)
    needs_more_than_one_frequency(recording, prepared.fitted)
    packed = prepared.packed
    sines = sine_data(recording, prepared.fitted) if enough_sines(recording, prepared.fitted) else None
    lanes, rows = packed.lanes.volts.shape
    key = Key(
        lanes=(-(-lanes // LANE_STEP) * LANE_STEP, rows),
        timed=packed.lanes.duration.ndim > 0,
        pieces=max(packed.pieces, LEAST_PIECES),
        clusters=max(packed.clusters, LEAST_CLUSTERS),
        kind=packed.observation.kind,
        floor_known=packed.observation.floor_known,
        free=bool(packed.lanes.free.any()),
        sines=None if sines is None else (sines.time.shape[0], sines.time.shape[1]),
        sine_kind="" if sines is None else sines.kind,
        sine_window_s=0.0 if sines is None else sines.window_s,
    )
    arrays = _lane_arrays(prepared, key) | ({} if sines is None else _sine_arrays(sines))
    arrays["log_poles"] = pole_range(packed.lanes)
    return Ready(key, prepared, arrays)


def stack(motors: list[Ready], size: int) -> dict[str, np.ndarray]:
    """The motors' arrays with a leading axis of `size`, the unused rest zero."""
    stacked: dict[str, np.ndarray] = {}
    for name, first in motors[0].arrays.items():
        block = np.zeros((size, *first.shape), first.dtype)
        for index, motor in enumerate(motors):
            block[index] = motor.arrays[name]
        stacked[name] = block
    return stacked


def _lane_arrays(prepared: Prepared, key: Key) -> dict[str, np.ndarray]:
    packed = prepared.packed
    lanes = packed.lanes._replace(
        piece=np.where(packed.lanes.piece == packed.pieces, key.pieces, packed.lanes.piece),
        cluster=np.where(packed.lanes.cluster == packed.clusters, key.clusters, packed.lanes.cluster),
    )
    # Rows that hold nothing name the piece and the cluster after the last.
    empty = {"piece": key.pieces, "cluster": key.clusters, "duration": 1.0}
    arrays = {}
    for name, array in lanes._asdict().items():
        if array.ndim:
            whole = np.full(key.lanes, empty.get(name, 0), array.dtype)
            whole[: len(array)] = array
            array = whole
        arrays[name] = array
    about = {"unit": packed.observation.unit, "window": packed.observation.window_s}
    return arrays | {name: np.asarray(value, float) for name, value in about.items()}


def lanes_of(arrays: dict[str, Any]) -> Lanes:
    """The lanes among `arrays`."""
    return Lanes(**{name: arrays[name] for name in Lanes._fields})


def _sine_arrays(sines: SineData) -> dict[str, np.ndarray]:
    return {
        "sine_frequency_Hz": sines.frequency_Hz,
        "sine_time": sines.time,
        "sine_volts": sines.volts,
        "sine_measured": sines.measured,
        "sine_valid": sines.valid,
        "sine_unit": np.asarray(sines.unit),
        "sine_period": np.asarray(sines.period_s),
    }


def problem_of(error: Exception) -> str:
    """The sentence about one motor that could not be done, whatever went wrong with it."""
    if isinstance(error, JaxmotorError):
        return str(error)
    return f"a defect of jaxmotor, not of the recording: {type(error).__name__}: {error}"
