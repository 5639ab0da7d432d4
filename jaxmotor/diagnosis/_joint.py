"""How sure gain, pole and the effects' parameters are together: what makes up for an error of another stays with it."""

import math

import numpy as np
from jaxtyping import Float

from jaxmotor.diagnosis._errors import effect_errors, linear_errors
from jaxmotor.diagnosis._free import OWN
from jaxmotor.diagnosis._solve import Fitted
from jaxmotor.estimate import Joint
from jaxmotor.motor.effects import AbstractEffect, Rig, free_size, parameters


def joint_covariance(fitted: Fitted, spread: np.ndarray, rig: Rig) -> Joint:
    """Of all parameters whose error is known, from the covariance `spread` (p, p) of the free numbers of `fitted`.

    Its diagonal holds the standard errors as they are stated; what these have beyond `spread` is independent.
    """
    motor, width = fitted.motor, len(spread)
    stated = linear_errors(fitted, spread)
    values = (float(motor.linear.gain), float(motor.linear.pole), 1.0, 1.0)
    slopes = [value * np.eye(width)[k] for k, value in enumerate(values)]
    at = OWN
    for effect, errors in zip(motor.effects, effect_errors(fitted, spread, rig), strict=True):
        stated |= {f"{effect.name}.{name}": errors[name] for name in parameters(effect)}
        slopes += _slopes(effect, at, width)
        at += free_size(effect)
    names, errors, slope = list(stated), np.array(list(stated.values())), np.stack(slopes)
    covariance = slope @ np.where(np.isfinite(spread), spread, 0.0) @ slope.T
    np.fill_diagonal(covariance, np.maximum(np.square(errors), np.diag(covariance)))
    return Joint(tuple(names), covariance).of([name for name, error in stated.items() if math.isfinite(error)])


def _slopes(effect: AbstractEffect, at: int, width: int) -> list[Float[np.ndarray, " p"]]:
    """Of each parameter with respect to the free numbers (p,), of which the effect's own begin at `at`."""
    unit, slopes = np.eye(width), {name: np.zeros(width) for name in parameters(effect)}
    for name, about in parameters(effect).items():
        value = float(getattr(effect, name))
        if about["kind"] in ("positive", "signed"):
            slopes[name] = unit[at] * (value if about["kind"] == "positive" else 1.0)
            at += 1
        elif about["kind"] == "amplitude":
            phase = float(effect.phase_rad)  # pyright: ignore[reportAttributeAccessIssue]
            slopes[name] = math.cos(phase) * unit[at] + math.sin(phase) * unit[at + 1]
            across = math.cos(phase) * unit[at + 1] - math.sin(phase) * unit[at]
            slopes["phase_rad"] = across / max(value, 1e-300)
            at += 2
    return list(slopes.values())
