"""A recording whose header does not state how its speeds were averaged."""

import dataclasses

import numpy as np

from jaxmotor._precision import to_numpy
from jaxmotor.estimate import Model, SpeedAverage, average_by_rows, stated
from jaxmotor.motor.effects import LogFilter
from jaxmotor.prediction import pack, row_window
from jaxmotor.recording import Recording
from jaxmotor.validation._free_simulation import simulate_model


def as_averaged(model: Model, recording: Recording, segments: tuple[int, ...]) -> tuple[Model, Recording, list[str]]:
    """`model` and `recording` with the average of its speeds, and a note on it: over the last rows where they show it,
    else as in the model's own recording where `segments` are nearer to the model so."""
    if recording.measured != "speed" or not segments:
        return model, recording, []
    rows = row_window(recording, segments)
    if rows is not None:
        average = average_by_rows(rows)
        return model, stated(recording, average), [average.sentence]
    average = model.average
    if average is None or recording.speed_window_s is not None:
        return model, recording, []
    filtered, averaged = _filtered(model, average), stated(recording, average)
    if _square(filtered, averaged, segments) >= _square(model, recording, segments):
        return model, recording, []
    return filtered, averaged, [f"taken as in the recording that the model was identified from: {average.sentence}"]


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
