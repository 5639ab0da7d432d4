"""The identified motor as JSON, and back. Format 1; numbers in SI, units in the keys.

`"effects": [{"name", "parameters": {...}, "standard_error": {...}}]` is optional: what makes the motor differ from a
linear one, in the terms of `vocabulary`. A file without it is a linear motor. So is `"joint_covariance"`, how sure
their parameters are together with the linear ones.
"""

import contextlib
import dataclasses
import json
import math
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Protocol, runtime_checkable

import jax
import numpy as np

from jaxmotor._arguments import path_of, taken
from jaxmotor._errors import JaxmotorError
from jaxmotor._files import read_bytes
from jaxmotor._precision import in_float64, to_jax, to_numpy
from jaxmotor._sentences import shown
from jaxmotor.estimate._average_file import read_average
from jaxmotor.estimate._fit import Fit
from jaxmotor.estimate._frequency_response import FrequencyResponse
from jaxmotor.estimate._model import Model, ModelRig
from jaxmotor.estimate._model_effects import effects_to_json, read_effects
from jaxmotor.estimate._model_joint import joint_to_json, names_of, read_joint
from jaxmotor.estimate._model_numbers import RANGES, covariance_of, in_range, is_number, numbers
from jaxmotor.estimate._open_hypotheses import open_to_json
from jaxmotor.motor import AbstractLinearMotor, linear_motor
from jaxmotor.prediction import noise_to_json

FORMAT = 1
"""Of the model file."""
LARGEST = 20_000_000
"""Bytes of a model file that are read at most."""
MAX_TEXT = 1000
"""Characters of a name."""
KEYS = ("gain_rad_s_V", "pole_rad_s", "electrical_time_constant_s")
SHARE = "viscous_share"
OFFSET = "voltage_offset_V"
JOINT = "joint_covariance"


@runtime_checkable
class HasModel(Protocol):
    """A `Fit`, a `Diagnosis`, a `Validation`."""

    @property
    def model(self) -> Model: ...


AnyModel = Model | HasModel | str | os.PathLike[str]


def model_of(given: AnyModel) -> Model:
    """The model that `given` is, has, or is the file of. **Raises:** `JaxmotorError`, also for anything else."""
    own = getattr(given, "model", given)
    return taken(own, Model, "a model (a Model, a Fit, a Diagnosis, or the path of a model file)", read_model)


@in_float64
def to_json(fit: Fit) -> dict[str, Any]:
    """`fit` as an object of plain numbers and strings."""
    return {
        "format": FORMAT,
        "recording": Path(fit.source).name,
        "method": fit.method,
        "model": linear_to_json(fit.motor) | {OFFSET: fit.offset_V},
        "standard_error": linear_to_json(fit.standard_error) | {OFFSET: fit.offset_standard_error_V},
        "covariance": fit.covariance.tolist(),
        **open_to_json(fit.open_hypotheses, fit.allowed),
        "fit_percent": fit.fit_percent,
        "chi2_per_sample": fit.chi2_per_sample,
        "chi2_floor": "encoder" if fit.floor_known else "estimated",
        "noise": noise_to_json(fit.noise),
        "scored_on": "the fitted segments",
        "fitted_segments": list(fit.fitted),
        "held_out_segments": list(fit.held_out),
        "fitted_fingerprints": list(fit.fingerprints),
        "period_s": fit.period_s,
        **fit.rig._asdict(),
        "timing": None if fit.timing is None else dataclasses.asdict(fit.timing),
        "speed_average": None if fit.average is None else dataclasses.asdict(fit.average),
        "frequency_response": None if fit.frequency_response is None else _response(fit.frequency_response),
        "notes": list(fit.notes),
    }


@in_float64
def model_to_json(model: Model) -> dict[str, Any]:
    """`model` with its effects as an object of plain numbers and strings, which `read_model` reads.

    The linear part's standard errors are those of its covariance.
    """
    errors = np.sqrt(np.maximum(np.diag(model.covariance), 0.0)).tolist()
    offset_error = {OFFSET: model.offset_error_V} if math.isfinite(model.offset_error_V) else {}
    others = {OFFSET: model.offset_V} | ({SHARE: model.viscous_share} if model.viscous_share else {})
    return {
        "format": FORMAT,
        "recording": model.recording,
        "model": linear_to_json(model.motor) | others,
        "standard_error": dict(zip(KEYS, errors, strict=False)) | offset_error,
        "covariance": model.covariance.tolist(),
        "effects": effects_to_json(model.effects, model.effect_errors),
        **({} if model.joint is None else {JOINT: joint_to_json(model.joint)}),
        "fitted_fingerprints": sorted(model.fitted),
        "period_s": model.period_s,
        **model.rig._asdict(),
        "speed_average": None if model.average is None else dataclasses.asdict(model.average),
        "frequency_response": None if model.response is None else _response(model.response),
    }


def linear_to_json(motor: AbstractLinearMotor) -> dict[str, float]:
    """The parameters of `motor`, or errors of them in their places, by `KEYS`."""
    return {key: float(value) for key, value in zip(KEYS, jax.tree.leaves(motor), strict=False)}


def _response(measured: FrequencyResponse) -> dict[str, Any]:
    window = measured.window_s
    return {
        "frequency_Hz": np.asarray(measured.frequency_Hz).tolist(),
        "real": np.real(measured.response).tolist(),
        "imag": np.imag(measured.response).tolist(),
        "standard_error": np.asarray(measured.standard_error).tolist(),
        "covariance": np.asarray(measured.covariance).tolist(),
        "amplitude_V": np.asarray(measured.amplitude_V).tolist(),
        "speed_window_s": window,
        "speed": "mean over the tick that holds the voltage" if window is None else f"mean over {window:g} s before",
    }


def read_model(path: str | os.PathLike[str]) -> Model:
    """The motor in a model file that `identify` wrote, with its effects where it has some.

    **Raises:** `JaxmotorError` where the file is missing, is not JSON, or is not a model of format 1.
    """
    path = path_of(path, "the path of a model file")
    content = _load(path)
    version = content.get("format")
    if version != FORMAT:
        raise JaxmotorError(
            f"{path}: model format {shown(version)} is not {FORMAT}; write it anew with jaxmotor identify"
        )
    values = content.get("model")
    if not isinstance(values, dict):
        raise JaxmotorError(f"{path}: has no 'model' with gain_rad_s_V and pole_rad_s; write it with jaxmotor identify")
    keys = KEYS if KEYS[2] in values else KEYS[:2]
    linear = [_number(path, values, key) for key in keys]
    if min(linear[1:]) <= 0:
        raise JaxmotorError(f"{path}: a motor's gain is not zero, and its pole and time constant are positive")
    share = _number(path, values, SHARE) if SHARE in values else 0.0
    if not 0 <= share < 1:
        raise JaxmotorError(f"{path}: {SHARE} is {share:g}, not a share of the pole (from 0 to less than 1)")
    anew = "write the model anew with jaxmotor"
    with _in_file(path, anew):
        effects = read_effects(content.get("effects"))
    with _in_file(path, f"{anew} identify"):
        covariance = covariance_of(content.get("covariance"), len(linear), "covariance")
    with _in_file(path, f"{anew}, or leave it out"):
        joint = read_joint(content.get(JOINT), keys, [SHARE, *names_of([each.effect for each in effects])])
        average = read_average(content.get("speed_average"))
    return Model(
        linear_motor(linear),
        covariance,
        _number(path, values, OFFSET) if OFFSET in values else 0.0,
        _known(path, content, "period_s"),
        _text(path, content, "recording"),
        frozenset(_fingerprints(path, content)),
        str(path),
        tuple(each.effect for each in effects),
        tuple(each.standard_error for each in effects),
        _read_response(path, content),
        share,
        joint,
        ModelRig(*(_known(path, content, key) for key in ModelRig._fields)),
        _offset_error(content),
        average,
    )


def _offset_error(content: dict[str, Any]) -> float:
    """Standard error of the voltage offset [V]; NaN where the file does not hold it."""
    errors = content.get("standard_error")
    error = errors.get(OFFSET) if isinstance(errors, dict) else None
    return error if isinstance(error, float) and 0 <= error < math.inf else math.nan


@contextlib.contextmanager
def _in_file(path: Path, remedy: str) -> Iterator[None]:
    """What is wrong inside is said of the file, with what to do."""
    try:
        yield
    except ValueError as error:
        raise JaxmotorError(f"{path}: {error}; {remedy}") from error


@in_float64
def _read_response(path: Path, content: dict[str, Any]) -> FrequencyResponse | None:
    """The measured response; None where the file has none, or is older than the key that says which speed it is of."""
    table, period = content.get("frequency_response"), content.get("period_s")
    if not isinstance(table, dict) or "speed_window_s" not in table or period is None:
        return None
    window = None if table["speed_window_s"] is None else _number(path, table, "speed_window_s")
    frequency = numbers(table.get("frequency_Hz"), (None,))
    size = 0 if frequency is None else len(frequency)
    columns = [numbers(table.get(key), (size,)) for key in ("real", "imag", "amplitude_V")]
    covariance = numbers(table.get("covariance"), (size, 2, 2))
    real, imag, amplitude = columns
    if frequency is None or real is None or imag is None or amplitude is None or covariance is None:
        raise JaxmotorError(f"{path}: frequency_response has columns that are no numbers, or differ in length")
    if frequency.min(initial=1.0) <= 0:
        raise JaxmotorError(f"{path}: frequency_response has a frequency that is not positive")
    arrays = (frequency, real + 1j * imag, covariance, amplitude, _number(path, content, "period_s"))
    return to_numpy(FrequencyResponse(*(to_jax(array) for array in arrays), window_s=window))


def _load(path: Path) -> dict[str, Any]:
    data = read_bytes(path, LARGEST, "a model", "a model is what jaxmotor identify -o writes")
    try:
        content = json.loads(data.decode("utf-8"), object_pairs_hook=_once)
    except _TwiceError as error:
        raise JaxmotorError(f"{path}: {error}; write the model anew with jaxmotor identify") from error
    except (ValueError, RecursionError) as error:
        raise JaxmotorError(f"{path}: not a JSON file; a model is what jaxmotor identify -o writes") from error
    if not isinstance(content, dict):
        raise JaxmotorError(f"{path}: not a model; a model is what jaxmotor identify -o writes")
    return content


class _TwiceError(ValueError):
    """A key that stands twice."""


def _once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    table = dict(pairs)
    if len(table) < len(pairs):
        keys = [key for key, _ in pairs]
        raise _TwiceError(f"the key {shown(next(key for key in keys if keys.count(key) > 1))} stands twice")
    return table


def _number(path: Path, values: dict[str, Any], key: str) -> float:
    value = values.get(key)
    if not is_number(value):
        raise JaxmotorError(
            f"{path}: {key} is {shown(value)}, not a number; write the model anew with jaxmotor identify"
        )
    if not in_range(key, value):
        low, high = RANGES[key]
        raise JaxmotorError(
            f"{path}: {key} is {value:g}, which no motor has (from {low:g} to {high:g}); check the file"
        )
    return float(value)


def _known(path: Path, content: dict[str, Any], key: str) -> float | None:
    """A positive number; None where the file has none, as older ones."""
    value = None if content.get(key) is None else _number(path, content, key)
    if value is not None and value < 0:
        raise JaxmotorError(f"{path}: {key} is {value:g}, and is never negative; check the file")
    return value


def _text(path: Path, content: dict[str, Any], key: str) -> str:
    value = content.get(key) or ""
    if not isinstance(value, str) or len(value) > MAX_TEXT:
        raise JaxmotorError(f"{path}: {key} is {shown(value)}, not a name; write the model anew with jaxmotor identify")
    return value


def _fingerprints(path: Path, content: dict[str, Any]) -> list[str]:
    value = content.get("fitted_fingerprints") or []
    if not isinstance(value, list) or not all(isinstance(each, str) and len(each) <= MAX_TEXT for each in value):
        raise JaxmotorError(f"{path}: fitted_fingerprints is not a list of texts; write the model anew with identify")
    return value
