"""A validation as JSON. Format 1; numbers in SI, units in the keys, null where there is no number."""

import math
from pathlib import Path
from typing import Any

from jaxmotor.estimate import Model, effects_to_json
from jaxmotor.motor import SecondOrder
from jaxmotor.validation._validation import ClosedLoop, Comparison, Interval, OpenLoop, Score, StepTrials, Validation

FORMAT = 1


def to_json(validation: Validation) -> dict[str, Any]:
    """`validation` as an object of plain numbers and strings; curves are left out."""
    model = validation.model
    return {
        "format": FORMAT,
        "recording": validation.recording,
        "model_file": Path(model.source).name,
        "model_recording": model.recording,
        "model": _model(model),
        "effects": effects_to_json(model.effects, model.effect_errors),
        "fitted_segments": list(validation.fitted),
        "scored_segments": list(validation.scored),
        "skipped_segments": [
            {"segment": skipped.segment, "kind": skipped.kind, "reason": skipped.reason}
            for skipped in validation.skipped
        ],
        "scored_on": "segments that were not fitted",
        "open_loop": None if validation.open_loop is None else _open_loop(validation.open_loop),
        "steps": [_steps(steps) for steps in validation.steps],
        "closed_loop": [_closed_loop(loop) for loop in validation.closed_loop],
        "seed": validation.seed,
        "simulations": validation.simulations,
        "notes": list(validation.notes),
    }


def _model(model: Model) -> dict[str, float]:
    motor = model.motor
    values = {"gain_rad_s_V": float(motor.gain), "pole_rad_s": float(motor.pole)}
    if isinstance(motor, SecondOrder):
        values["electrical_time_constant_s"] = float(motor.electrical_time_constant)
    return values | {"voltage_offset_V": model.offset_V}


def _open_loop(open_loop: OpenLoop) -> dict[str, Any]:
    return {
        "pooled": _score(open_loop.pooled),
        "segments": [{"segment": index} | _score(score) for index, score in open_loop.segments.items()],
        "initial_speed_estimated": list(open_loop.initial_speed_estimated),
        "chi2_floor": "encoder" if open_loop.floor_known else "estimated",
    }


def _score(score: Score) -> dict[str, Any]:
    return {
        "samples": score.samples,
        "fit_percent": _number(score.fit_percent),
        "rmse_rad_s": _number(score.rmse_rad_s),
        "rmse_counts": _number(score.rmse_counts),
        "chi2_per_sample": _number(score.chi2_per_sample),
    }


def _steps(steps: StepTrials) -> dict[str, Any]:
    return {
        "segments": list(steps.segments),
        "trials": steps.trials,
        "amplitude_V": _number(steps.amplitude_V),
        "samples": len(steps.time_s),
        "inside_percent": _number(steps.inside_percent),
        "rise_time_s": _comparison(steps.rise_time_s),
        "final_speed_rad_s": _comparison(steps.final_speed_rad_s),
    }


def _closed_loop(loop: ClosedLoop) -> dict[str, Any]:
    return {
        "segment": loop.segment,
        "controller": loop.kind,
        "reference_rad_s": loop.reference_rad_s,
        "gain_V_s_rad": loop.gain_V_s_rad,
        "integral_gain_V_rad": loop.integral_gain_V_rad,
        "duty_step_V": _number(loop.duty_step_V),
        "limit_V": _number(loop.limit_V),
        "samples": len(loop.time_s),
        "controller_off_percent": _number(loop.controller_off_percent),
        "speed_inside_percent": _number(loop.speed_inside_percent),
        "volts_inside_percent": _number(loop.volts_inside_percent),
        "rise_time_s": _comparison(loop.rise_time_s),
        "overshoot_percent": _comparison(loop.overshoot_percent),
        "steady_speed_rad_s": _comparison(loop.steady_speed_rad_s),
        "steady_error_rad_s": _comparison(loop.steady_error_rad_s)
        | {
            "theory": _interval(loop.theory_error_rad_s),
            "theory_with_offset": _number(loop.theory_error_with_offset_rad_s),
        },
        "saturated_percent": _comparison(loop.saturated_percent),
        "notes": list(loop.notes),
    }


def _comparison(comparison: Comparison) -> dict[str, Any]:
    return {
        "measured": _interval(comparison.measured),
        "predicted": _interval(comparison.predicted),
        "inside": comparison.inside,
    }


def _interval(interval: Interval) -> dict[str, float | None]:
    return {"value": _number(interval.value), "low": _number(interval.low), "high": _number(interval.high)}


def _number(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None
