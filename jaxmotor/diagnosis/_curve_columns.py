"""The terms of a learned curve at the places that a recording visits."""

import numpy as np
from jaxtyping import Float

from jaxmotor._precision import to_jax
from jaxmotor.diagnosis._trial import Trial
from jaxmotor.motor.effects import AbstractLearnedEffect, parameters


def columns_of(effect: AbstractLearnedEffect, at: np.ndarray) -> Float[np.ndarray, "n k"]:
    """What each term of size one adds at places `at` (n,) [V]."""
    ranges = {key: float(getattr(effect, key)) for key, about in parameters(effect).items() if about["kind"] == "range"}
    terms = [key for key, about in parameters(effect).items() if about["kind"] == "term"]
    places = to_jax(at)
    return np.stack([np.asarray(type(effect).start(**ranges, **{key: 1.0}).adds(places)) for key in terms], axis=1)


def visited(trial: Trial, effect: AbstractLearnedEffect) -> np.ndarray:
    """(n,) places of the effect's coordinate in the rows of `trial`."""
    log, valid = trial.measured_log, trial.valid
    used = int(np.asarray(log.used))
    match effect.coordinate:
        case "speed":
            return np.asarray(log.speed)[:used]
        case "voltage":
            return np.asarray(trial.problem.batch.volts)[valid]
        case "angle":
            return np.mod(np.asarray(trial.angle)[valid], 2 * np.pi)
        case "time":
            return np.asarray(trial.time)[valid]
