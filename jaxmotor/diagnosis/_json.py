"""A diagnosis as JSON: plain numbers in SI and strings."""

import dataclasses
from typing import Any

from jaxmotor._json import plain
from jaxmotor.diagnosis._before_after import BeforeAfter
from jaxmotor.diagnosis._diagnosis import Diagnosis
from jaxmotor.diagnosis._found_effect import FoundEffect
from jaxmotor.diagnosis._learned_law import LearnedLaw
from jaxmotor.diagnosis._loops import LoopGain
from jaxmotor.diagnosis._residual_dependence import Dependence
from jaxmotor.diagnosis._residual_voltage import ResidualVoltage
from jaxmotor.estimate import open_to_json
from jaxmotor.prediction import noise_to_json
from jaxmotor.validation import Interval

VALUES = {"V": "volts_V", "rad": "error_rad"}
"""What a learned curve gives, by its unit."""
FORMAT = 2
"""Of the JSON."""


def to_json(diagnosis: Diagnosis) -> dict[str, Any]:
    """`diagnosis` as an object; numbers that are not known are null."""
    linear, motor, like = diagnosis.linear.linear, diagnosis.motor.linear, diagnosis.looks_like
    content = {
        "format": FORMAT,
        "recording": diagnosis.recording,
        "verdict": diagnosis.verdict,
        "linear": {"gain_rad_s_V": float(linear.gain), "pole_rad_s": float(linear.pole)},
        "model": {"gain_rad_s_V": float(motor.gain), "pole_rad_s": float(motor.pole)},
        "standard_error": diagnosis.standard_error,
        **open_to_json(diagnosis.open_hypotheses, diagnosis.allowed),
        "undecided": diagnosis.undecided,
        "noise": noise_to_json(diagnosis.fit.noise),
        "probabilities": {name: min(value, 1.0) for name, value in diagnosis.probabilities.items()},
        "families": {name: min(value, 1.0) for name, value in diagnosis.families.items()},
        "effects": [_effect(found) for found in diagnosis.effects],
        "disturbances": [_effect(found) for found in diagnosis.disturbances],
        "timing": None if diagnosis.timing is None else dataclasses.asdict(diagnosis.timing),
        "speed_average": None if diagnosis.average is None else dataclasses.asdict(diagnosis.average),
        "held_out": _before_after(diagnosis.held_out),
        "whole": _before_after(diagnosis.whole),
        "closed_loop": [_loop(gain) for gain in diagnosis.closed_loop],
        "looks_like": None if like is None else {"coordinate": like.coordinate, "text": like.text},
        "missing_volts": {"before": _volts(diagnosis.residual_voltage), "after": _volts(diagnosis.unexplained_voltage)},
        "looks": {
            "before": _dependences(diagnosis.dependences),
            "after": _dependences(diagnosis.unexplained_dependences),
        },
        "learned": [_learned(law) for law in diagnosis.learned],
        "experiments": [
            {"text": one.text, "separates": list(one.separates), "plan": one.plan} for one in diagnosis.experiments
        ],
        "notes": diagnosis.notes,
    }
    return plain(content)


def _effect(found: FoundEffect) -> dict[str, Any]:
    return {
        "name": found.name,
        "parameters": found.parameters,
        "standard_error": found.standard_error,
        "held_out_gain_percent": found.held_out_gain_percent,
        "rivals": [
            {"name": one.name, "chi2_excess": one.chi2_excess, "inseparable": one.inseparable}
            for one in found.alternatives
        ],
        "not_identifiable": list(found.unknown),
        "probability": min(found.probability, 1.0),
        "family_probability": min(found.family_probability, 1.0),
        "name_probability": min(found.name_probability, 1.0),
        "named": found.is_named,
        "one_of_several": found.is_one_of_several,
        "family": found.effect.family or None,
        "of_family_probability": min(found.of_family, 1.0),
        "unexplained_share": found.unexplained_share,
        "held_out_unexplained_share": found.held_out_share,
    }


def _before_after(scores: BeforeAfter) -> dict[str, Any]:
    before, after = scores.before, scores.after
    intervals = {}
    for when, known in (("before", scores.before_intervals), ("after", scores.after_intervals)):
        intervals[f"chi2_{when}_interval"] = known.chi2_per_sample[1:]
        intervals[f"rmse_rad_s_{when}_interval"] = known.rmse_rad_s[1:]
        intervals[f"fit_percent_{when}_interval"] = known.fit_percent[1:]
    return intervals | {
        "segments": list(scores.segments),
        "segments_in_part": list(scores.in_part),
        "chi2_before": before.chi2_per_sample,
        "chi2_after": after.chi2_per_sample,
        "fit_percent_before": before.fit_percent,
        "fit_percent_after": after.fit_percent,
        "angle_fit_percent_before": scores.angle_fit_percent_before,
        "angle_fit_percent_after": scores.angle_fit_percent_after,
        "drift_chi2_before": scores.drift_before,
        "drift_chi2_after": scores.drift_after,
        "rmse_rad_s_before": before.rmse_rad_s,
        "rmse_rad_s_after": after.rmse_rad_s,
        "rmse_counts_before": before.rmse_counts,
        "rmse_counts_after": after.rmse_counts,
    }


def _loop(gain: LoopGain) -> dict[str, Any]:
    content: dict[str, Any] = {
        "segment": gain.before.segment,
        "kind": gain.before.kind,
        "reference_rad_s": gain.before.reference_rad_s,
        "held_out": gain.held_out,
    }
    for name in ("rise_time_s", "overshoot_percent", "steady_error_rad_s"):
        before, after = getattr(gain.before, name), getattr(gain.after, name)
        content[name] = before.measured.value
        content |= _predicted(name, before.predicted, after.predicted)
    return content | _predicted("rmse_rad_s", gain.before.rmse_rad_s, gain.after.rmse_rad_s)


def _predicted(name: str, before: Interval, after: Interval) -> dict[str, Any]:
    content: dict[str, Any] = {}
    for when, value in (("before", before), ("after", after)):
        content[f"{name}_{when}"] = value.value
        content[f"{name}_{when}_interval"] = value[1:]
    return content


def _volts(residual: ResidualVoltage) -> dict[str, float]:
    return {"rms_V": residual.rms_V, "noise_V": residual.noise_V}


def _dependences(dependences: tuple[Dependence, ...]) -> list[dict[str, Any]]:
    return [
        {"coordinate": like.coordinate, "text": like.text, "share": like.share, "chance": like.chance}
        for like in dependences
    ]


def _learned(law: LearnedLaw) -> dict[str, Any]:
    return {
        "coordinate": law.coordinate,
        "unit": law.unit,
        "text": law.text,
        "resembles": [
            {
                "name": one.name,
                "similarity": one.similarity,
                VALUES[law.unit]: one.most,
                f"standard_error_{law.unit}": one.standard_error,
            }
            for one in law.resembles
        ],
        "share": law.share,
        "at": law.at.tolist(),
        VALUES[law.unit]: law.values.tolist(),
        f"standard_error_{law.unit}": law.standard_error.tolist(),
    }
