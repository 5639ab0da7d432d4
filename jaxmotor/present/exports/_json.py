"""The motor and its controllers as one JSON object (format 1); numbers in SI, units in the keys."""

import dataclasses
import json
from typing import Any

import numpy as np

from jaxmotor._arguments import taken
from jaxmotor._json import plain
from jaxmotor.control import feed_forward, sampled_motor, transfer_function
from jaxmotor.estimate import AnyModel, Model, model_of, model_to_json
from jaxmotor.present.exports._design import Design

FORMAT = 1
FEED_FORWARD = {
    "friction_V": "friction_V",
    "drag_V_s2_rad2": "drag_V_s2_rad2",
    "load_V": "load_V",
    "offset_V": "offset_V",
    "asymmetry": "asymmetry_ratio",
    "dead_zone_V": "dead_zone_V",
}


def to_export_json(model: AnyModel, design: Design | None = None) -> str:
    """The text of the JSON file; without a `design` its controllers are null."""
    model = model_of(model)
    content = {key: value for key, value in model_to_json(model).items() if key != "fitted_fingerprints"}
    law = feed_forward(model.whole)
    numerator, denominator = transfer_function(model.whole)
    content |= {
        "format": FORMAT,
        "kind": "jaxmotor export",
        "transfer_function": {"numerator": numerator, "denominator": denominator, "unit": "rad/s/V"},
        "feed_forward": {name: float(getattr(law, key)) for key, name in FEED_FORWARD.items()},
        **dict.fromkeys(("rig", "sampled", "speed_loop", "position_loop", "estimator")),
    }
    if design is not None:
        content |= _controllers(model, taken(design, Design, "a Design (of jaxmotor.present.exports.design)"))
    return json.dumps(plain(content), indent=1) + "\n"


def _controllers(model: Model, design: Design) -> dict[str, Any]:
    hardware, estimator = design.hardware, design.estimator
    sampled = sampled_motor(model.whole, hardware)
    return {
        "rig": dataclasses.asdict(hardware),
        "sampled": {
            "transition": sampled.transition.tolist(),
            "drive": sampled.drive.tolist(),
            "output": sampled.output.tolist(),
            "states": "motor's states, voltages on their way, mean speed over the last tick",
        },
        "speed_loop": _loop(design.speed),
        "position_loop": _loop(design.position),
        "estimator": {
            "transition": np.asarray(estimator.transition).tolist(),
            "old_drive": np.asarray(estimator.old_drive).tolist(),
            "new_drive": np.asarray(estimator.new_drive).tolist(),
            "correction": np.asarray(estimator.correction).tolist(),
            "standard_deviation": np.asarray(estimator.standard_deviation).tolist(),
            "late_ticks": estimator.late,
            "states": "speed [rad/s] [, torque as speed], angle [rad], residual voltage [V]",
        },
    }


def _loop(design: Any) -> dict[str, Any]:
    content = dataclasses.asdict(design)
    content["poles"] = [[pole.real, pole.imag] for pole in design.poles]
    content["notes"] = list(design.notes)
    return content
