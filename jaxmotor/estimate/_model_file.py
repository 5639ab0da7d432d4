"""The identified motor as JSON, and back. Format 1; numbers in SI, units in the keys."""

import dataclasses
import json
import math
from pathlib import Path
from typing import Any

import numpy as np

from jaxmotor._errors import JaxmotorError
from jaxmotor._precision import in_float64
from jaxmotor.estimate._fit import Fit
from jaxmotor.estimate._frequency_response import FrequencyResponse
from jaxmotor.motor import AbstractLinearMotor, SecondOrder, linear_motor

FORMAT = 1
LARGEST = 20_000_000
"""Bytes of a model file that are read at most."""
KEYS = ("gain_rad_s_V", "pole_rad_s", "electrical_time_constant_s")


@dataclasses.dataclass(frozen=True, eq=False)
class Model:
    """An identified motor as a model file holds it."""

    motor: AbstractLinearMotor
    covariance: np.ndarray
    """(p, p) of (gain [rad/s/V], pole [rad/s] [, electrical time constant [s]])."""
    offset_V: float
    """Constant voltage error of the rig that it was identified on [V]."""
    period_s: float | None
    recording: str
    """Name of the recording it came from."""
    fitted: frozenset[str]
    """Fingerprints of the segments that were fitted."""
    source: str
    """The model file."""


def model_of(fit: Fit) -> Model:
    """`fit` as the model that its file would hold."""
    return Model(
        fit.motor, fit.covariance, fit.offset_V, fit.period_s, fit.source, frozenset(fit.fingerprints), fit.source
    )


@in_float64
def to_json(fit: Fit) -> dict[str, Any]:
    """`fit` as an object of plain numbers and strings."""
    values = [float(v) for v in _parameters(fit.motor)]
    errors = [float(v) for v in _parameters(fit.standard_error)]
    return {
        "format": FORMAT,
        "recording": Path(fit.source).name,
        "method": fit.method,
        "model": dict(zip(KEYS, values, strict=False)) | {"voltage_offset_V": fit.offset_V},
        "standard_error": dict(zip(KEYS, errors, strict=False)) | {"voltage_offset_V": fit.offset_standard_error_V},
        "covariance": fit.covariance.tolist(),
        "fit_percent": fit.fit_percent,
        "chi2_per_sample": fit.chi2_per_sample,
        "chi2_floor": "encoder" if fit.floor_known else "estimated",
        "scored_on": "the fitted segments",
        "fitted_segments": list(fit.fitted),
        "held_out_segments": list(fit.held_out),
        "fitted_fingerprints": list(fit.fingerprints),
        "period_s": fit.period_s,
        "frequency_response": None if fit.frequency_response is None else _response(fit.frequency_response),
        "notes": list(fit.notes),
    }


def _parameters(motor: AbstractLinearMotor) -> list[Any]:
    first = [motor.gain, motor.pole]
    return [*first, motor.electrical_time_constant] if isinstance(motor, SecondOrder) else first


def _response(measured: FrequencyResponse) -> dict[str, Any]:
    window = measured.window_s
    return {
        "frequency_Hz": np.asarray(measured.frequency_Hz).tolist(),
        "real": np.real(measured.response).tolist(),
        "imag": np.imag(measured.response).tolist(),
        "standard_error": np.asarray(measured.standard_error).tolist(),
        "covariance": np.asarray(measured.covariance).tolist(),
        "amplitude_V": np.asarray(measured.amplitude_V).tolist(),
        "speed": "mean over the tick that holds the voltage" if window is None else f"mean over {window:g} s before",
    }


def read_model(path: Path) -> Model:
    """The motor in a model file that `identify` wrote.

    **Raises:** `JaxmotorError` where the file is missing, is not JSON, or is not a model of format 1.
    """
    content = _load(path)
    version = content.get("format")
    if version != FORMAT:
        raise JaxmotorError(f"{path}: model format {version!r} is not {FORMAT}; write it anew with jaxmotor identify")
    values = content.get("model")
    if not isinstance(values, dict):
        raise JaxmotorError(f"{path}: has no 'model' with gain_rad_s_V and pole_rad_s; write it with jaxmotor identify")
    keys = KEYS if KEYS[2] in values else KEYS[:2]
    numbers = [_number(path, values, key) for key in keys]
    if numbers[0] == 0 or min(numbers[1:]) <= 0:
        raise JaxmotorError(f"{path}: a motor's gain is not zero, and its pole and time constant are positive")
    return Model(
        linear_motor(numbers),
        _covariance(path, content, len(numbers)),
        _number(path, values, "voltage_offset_V") if "voltage_offset_V" in values else 0.0,
        _number(path, content, "period_s") if content.get("period_s") is not None else None,
        str(content.get("recording", "")),
        frozenset(str(print_) for print_ in content.get("fitted_fingerprints") or ()),
        str(path),
    )


def _load(path: Path) -> dict[str, Any]:
    try:
        if path.stat().st_size > LARGEST:
            raise JaxmotorError(f"{path}: larger than {LARGEST // 1_000_000} MB, so not a model file")
        content = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise JaxmotorError(f"{path}: cannot be read ({error.strerror})") from error
    except (ValueError, RecursionError) as error:
        raise JaxmotorError(f"{path}: not a JSON file; a model is what jaxmotor identify -o writes") from error
    if not isinstance(content, dict):
        raise JaxmotorError(f"{path}: not a model; a model is what jaxmotor identify -o writes")
    return content


def _number(path: Path, values: dict[str, Any], key: str) -> float:
    value = values.get(key)
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise JaxmotorError(f"{path}: {key} is {value!r}, not a number; write the model anew with jaxmotor identify")
    return float(value)


def _covariance(path: Path, content: dict[str, Any], size: int) -> np.ndarray:
    try:
        covariance = np.array(content.get("covariance"), dtype=float)
    except (ValueError, TypeError):
        covariance = np.zeros(0)
    if covariance.shape != (size, size) or not np.isfinite(covariance).all():
        raise JaxmotorError(f"{path}: covariance is not a {size} x {size} table; write the model anew with identify")
    return covariance
