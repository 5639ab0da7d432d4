"""How sure gain, pole and the effects' parameters are together: what makes up for an error of another stays with it."""

import math

import numpy as np

from jaxmotor.diagnosis._errors import effect_errors, linear_errors, slopes_of
from jaxmotor.diagnosis._free import OWN
from jaxmotor.diagnosis._solve import Fitted
from jaxmotor.estimate import Joint
from jaxmotor.motor.effects import Rig, free_size, parameters


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
        slopes += slopes_of(effect, at, width).values()
        at += free_size(effect)
    names, errors, slope = list(stated), np.array(list(stated.values())), np.stack(slopes)
    covariance = slope @ np.where(np.isfinite(spread), spread, 0.0) @ slope.T
    np.fill_diagonal(covariance, np.maximum(np.square(errors), np.diag(covariance)))
    return Joint(tuple(names), covariance).of([name for name, error in stated.items() if math.isfinite(error)])
