"""The fit to a whole recording, and how sure it is."""

from typing import Any, NamedTuple

import numpy as np

from jaxmotor._errors import JaxmotorError
from jaxmotor._precision import to_jax
from jaxmotor.estimate._compiled import trajectory_program
from jaxmotor.estimate._trajectory import MAX_STEPS, Solution
from jaxmotor.estimate._uncertainty import Uncertainty
from jaxmotor.prediction import Problem
from jaxmotor.recording import Recording, warn_gaps, warn_sign, warn_spikes


class Estimate(NamedTuple):
    """What the whole recording says."""

    solution: Solution
    errors: Uncertainty


def fit_whole(recording: Recording, problem: Problem, psi: np.ndarray, seed: int) -> Estimate:
    """The fit to the whole recording.

    **Raises:** `JaxmotorError` where it does not settle.
    """
    arrays = trajectory_program(problem, to_jax(psi), to_jax(np.uint32(seed)))
    return estimate_of(recording, {name: np.asarray(value) for name, value in arrays.items()})


def estimate_of(recording: Recording, found: dict[str, Any]) -> Estimate:
    """From the arrays of `trajectory_program`.

    **Raises:** `JaxmotorError` where the fit did not converge.
    """
    estimate = Estimate(
        Solution(**{name: found[name] for name in Solution._fields}),
        Uncertainty(**{name: found[name] for name in Uncertainty._fields}),
    )
    if not _settled(estimate):
        [why, *_] = [
            *warn_sign(recording),
            *warn_spikes(recording),
            *warn_gaps(recording),
            "the pole is not determined by this recording, or a column has the wrong unit or sign: look at speed over "
            "voltage, and add steps or sines",
        ]
        raise JaxmotorError(f"{recording.name}: the fit did not converge in {MAX_STEPS} steps; {why}")
    return estimate


def _settled(estimate: Estimate) -> bool:
    return bool(np.isfinite(estimate.solution.psi).all()) and int(estimate.solution.steps) < MAX_STEPS
