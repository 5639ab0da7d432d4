"""A validation as JSON. Format 1; numbers in SI, units in the keys, null where there is no number."""

from pathlib import Path
from typing import Any

from jaxmotor._json import plain
from jaxmotor.estimate import effects_to_json, linear_to_json
from jaxmotor.validation._validation import ClosedLoop, Comparison, Interval, OpenLoop, StepTrials, Validation

FORMAT = 1
"""Of the JSON."""
SCORE = ("samples", "fit_percent", "rmse_rad_s", "rmse_counts", "chi2_per_sample")
STEPS = ("segments", "trials", "amplitude_V", "inside_percent", "rise_time_s", "final_speed_rad_s")
CLOSED_LOOP = (
    *("segment", "reference_rad_s", "gain_V_s_rad", "integral_gain_V_rad", "duty_step_V", "limit_V"),
    *("controller_off_percent", "speed_inside_percent", "volts_inside_percent", "rise_time_s", "overshoot_percent"),
    *("steady_speed_rad_s", "steady_error_rad_s", "saturated_percent", "notes"),
)


def to_json(validation: Validation) -> dict[str, Any]:
    """`validation` as an object of plain numbers and strings; curves are left out."""
    model = validation.model
    return {
        "format": FORMAT,
        "recording": validation.recording,
        "model_file": Path(model.source).name,
        "model_recording": model.recording,
        "model": linear_to_json(model.motor) | {"voltage_offset_V": model.offset_V},
        "effects": effects_to_json(model.effects, model.effect_errors),
        "fitted_segments": list(validation.fitted),
        "scored_segments": list(validation.scored),
        "skipped_segments": [
            {"segment": skipped.segment, "kind": skipped.kind, "reason": skipped.reason}
            for skipped in validation.skipped
        ],
        "scored_on": "held-out segments",
        "open_loop": None if validation.open_loop is None else _open_loop(validation.open_loop),
        "steps": [_steps(steps) for steps in validation.steps],
        "closed_loop": [_closed_loop(loop) for loop in validation.closed_loop],
        "seed": validation.seed,
        "simulations": validation.simulations,
        "notes": list(validation.notes),
    }


def _open_loop(open_loop: OpenLoop) -> dict[str, Any]:
    return {
        "pooled": _fields(open_loop.pooled, SCORE),
        "segments": [{"segment": index} | _fields(score, SCORE) for index, score in open_loop.segments.items()],
        "initial_speed_estimated": list(open_loop.initial_speed_estimated),
        "chi2_floor": "encoder" if open_loop.floor_known else "estimated",
    }


def _steps(steps: StepTrials) -> dict[str, Any]:
    return _fields(steps, STEPS) | {"samples": len(steps.time_s)}


def _closed_loop(loop: ClosedLoop) -> dict[str, Any]:
    found = {"controller": loop.kind, "samples": len(loop.time_s)} | _fields(loop, CLOSED_LOOP)
    found["steady_error_rad_s"] |= {
        "theory": _plain(loop.theory_error_rad_s),
        "theory_with_offset": _plain(loop.theory_error_with_offset_rad_s),
    }
    return found


def _fields(record: Any, names: tuple[str, ...]) -> dict[str, Any]:
    return {name: _plain(getattr(record, name)) for name in names}


def _plain(value: Any) -> Any:
    if isinstance(value, Comparison):
        return _fields(value, ("measured", "predicted", "inside"))
    if isinstance(value, Interval):
        return _fields(value, value._fields)
    return plain(value)
