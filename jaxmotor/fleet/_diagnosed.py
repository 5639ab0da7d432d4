"""One motor of a data set diagnosed: its columns in the results."""

import json
from collections.abc import Mapping
from typing import Any

from jaxmotor.diagnosis import diagnose, to_json
from jaxmotor.fleet._ready import problem_of
from jaxmotor.recording import Recording

DIAGNOSIS_TEXTS = (
    "verdict",
    "effect_parameters",
    "effect_standard_errors",
    "effect_probabilities",
    "family_probabilities",
    "looks_like",
    "left_open",
    "diagnosis_problem",
)
DIAGNOSIS_NUMBERS = ("diagnosed_gain_rad_s_V", "diagnosed_pole_rad_s", "held_out_chi2_before", "held_out_chi2_after")
EFFECTS = "effects"
"""The column of the names of effects that are told as causes, a list in the order of how much they improve the fit."""


def diagnosis_columns(recording: Recording | None, problem: str | None, seed: int) -> dict[str, Any]:
    """The columns of `DIAGNOSIS_TEXTS`, `DIAGNOSIS_NUMBERS` and `EFFECTS`; where the diagnosis fails, why.

    `problem` says why there is no `recording`, where there is none.
    """
    if recording is None:
        return {"diagnosis_problem": problem}
    try:
        return _columns(to_json(diagnose(recording, seed=seed)))
    except Exception as error:
        return {"diagnosis_problem": problem_of(error)}


def _columns(found: Mapping[str, Any]) -> dict[str, Any]:
    effects = found["effects"]
    return {
        "verdict": found["verdict"],
        EFFECTS: [effect["name"] for effect in effects if effect["named"]],
        "effect_parameters": json.dumps({effect["name"]: effect["parameters"] for effect in effects}),
        "effect_standard_errors": json.dumps({effect["name"]: effect["standard_error"] for effect in effects}),
        "effect_probabilities": json.dumps({effect["name"]: effect["probability"] for effect in effects}),
        "family_probabilities": json.dumps(found["families"]),
        "looks_like": None if found["looks_like"] is None else found["looks_like"]["text"],
        "left_open": ", ".join(one["name"] for one in found["open_hypotheses"]) or None,
        "diagnosed_gain_rad_s_V": found["model"]["gain_rad_s_V"],
        "diagnosed_pole_rad_s": found["model"]["pole_rad_s"],
        "held_out_chi2_before": found["held_out"]["chi2_before"],
        "held_out_chi2_after": found["held_out"]["chi2_after"],
    }
