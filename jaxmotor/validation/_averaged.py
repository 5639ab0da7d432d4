"""A recording whose header does not state how its speeds were averaged."""

import dataclasses

import numpy as np

from jaxmotor._errors import JaxmotorError
from jaxmotor._precision import to_numpy
from jaxmotor.estimate import Model, SpeedAverage, average_seen, stated
from jaxmotor.motor.effects import LogFilter
from jaxmotor.prediction import pack
from jaxmotor.recording import Recording
from jaxmotor.validation._free_simulation import simulate_model
from jaxmotor.validation._open_loop import has_pieces


def as_averaged(model: Model, recording: Recording, segments: tuple[int, ...]) -> tuple[Model, Recording, list[str]]:
    """`model` and `recording` with the average of its speeds, and a note on it: from row to row where they show it,
    else as in the model's own recording where `segments` are nearer to the model so."""
    if recording.measured != "speed" or not segments:
        return model, recording, []
    seen = average_seen(recording, segments)
    average = model.average if seen is None else seen
    if average is None or (seen is None and recording.speed_window_s is not None):
        return model, recording, []
    filtered, averaged = _filtered(model, average), stated(recording, average)
    if not _has_readings(averaged, segments):
        return model, recording, []
    if seen is not None:
        return filtered, averaged, [average.sentence]
    if _square(filtered, averaged, segments) >= _square(model, recording, segments):
        return model, recording, []
    return filtered, averaged, [f"taken as in the recording that the model was identified from: {average.sentence}"]


def _has_readings(recording: Recording, segments: tuple[int, ...]) -> bool:
    """Each of `segments` is longer than the window of its speeds, where it begins in motion."""
    try:
        return all(has_pieces(recording, index) for index in segments)
    except JaxmotorError:
        return False


def _filtered(model: Model, average: SpeedAverage) -> Model:
    if average.kind == "window":
        return model
    lag = to_numpy(LogFilter.of(time_constant_s=average.length_s))
    errors = {"time_constant_s": average.standard_error_s}
    return dataclasses.replace(model, effects=(*model.effects, lag), effect_errors=(*model.effect_errors, errors))


def _square(model: Model, recording: Recording, segments: tuple[int, ...]) -> float:
    """Mean square of what the model leaves of `segments` [rad²/s²]."""
    packed = pack(recording, segments, few_shapes=True)
    _, residual = simulate_model(model, recording, packed)
    return float(np.mean(residual[packed.batch.valid] ** 2)) * packed.observation.unit**2
