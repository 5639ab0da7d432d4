"""kS, kV, kA as WPILib's feed-forward has them: V = kS sgn(v) + kV v + kA v'.

    kV = 1/K     kA = 1/(K a)     kS = friction + dead zone, the volts that are lost while turning

v is that of the output shaft in radians, in rotations, and of a wheel in metres where its radius is given. WPILib's own
`SimpleMotorFeedforward` samples exactly, as the identified model does, so both agree at any period.
"""

import json
import math
from typing import Any

import numpy as np

from jaxmotor._arguments import check_positive
from jaxmotor._errors import JaxmotorError
from jaxmotor.control import feed_forward
from jaxmotor.estimate import AnyModel, Model, model_of
from jaxmotor.present.exports._left_out import left_out


def to_wpilib(model: AnyModel, wheel_radius_m: float | None = None) -> str:
    """A JSON object with the gains per unit, their standard errors, and the line of Java that takes them.

    **Raises:** `JaxmotorError` where the radius is not positive, or the gain is negative (wires are swapped).
    """
    model = model_of(model)
    check_positive("wheel radius", wheel_radius_m)
    law = feed_forward(model.whole)
    gain, pole = float(law.gain), float(law.pole)
    if gain < 0:
        raise JaxmotorError(
            f"{model.source}: the gain is negative, and WPILib's kV is not: motor or encoder are wired the other way "
            "round; swap one, and record again"
        )
    errors = _errors(model, gain, pole)
    lost = float(law.friction_V) + float(law.dead_zone_V)
    units = {"radians": 1.0, "rotations": 2 * math.pi}
    if wheel_radius_m is not None:
        units["meters"] = 1 / wheel_radius_m
    content: dict[str, Any] = {
        "format": 1,
        "kind": "jaxmotor WPILib feed-forward",
        "convention": "V = kS sgn(v) + kV v + kA dv/dt; volts; v of the output shaft per second in the unit named",
        "recording": model.recording,
        "not_carried": left_out(model, "wpilib"),
    }
    for unit, radians in units.items():
        kv, ka = radians / gain, radians / gain / pole
        content[unit] = {
            "kS": lost,
            "kV": kv,
            "kA": ka,
            "standard_error": {"kS": errors[0], "kV": errors[1] * kv, "kA": errors[2] * ka},
            "java": f"new SimpleMotorFeedforward({lost:.6g}, {kv:.6g}, {ka:.6g})",
        }
    return json.dumps(content, indent=1) + "\n"


def _errors(model: Model, gain: float, pole: float) -> tuple[float | None, float, float]:
    """Of kS [V], and relative ones of kV and kA."""
    covariance = model.covariance[:2, :2] / np.outer([gain, pole], [gain, pole])
    squares = []
    for effect, error in zip(model.effects, model.effect_errors, strict=False):
        if effect.name in ("coulomb_friction", "stiction", "dead_zone"):
            squares.append(error.get("volts_V", math.nan) ** 2)
    lost = math.sqrt(sum(squares))
    return (lost if math.isfinite(lost) else None), math.sqrt(covariance[0, 0]), math.sqrt(max(covariance.sum(), 0.0))
