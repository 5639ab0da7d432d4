"""The compiled steps of an identification: few and large, because each costs a start."""

from functools import partial

import jax
from jaxtyping import Array, Float, UInt32

from jaxmotor._programs import Arrays, program
from jaxmotor.estimate._response_fit import fit_used
from jaxmotor.estimate._sine_fit import Sines, fit_sines
from jaxmotor.estimate._start import data_start
from jaxmotor.estimate._trajectory import evaluate, solve
from jaxmotor.estimate._uncertainty import uncertainty
from jaxmotor.prediction import Problem


@partial(program, brief=True)
def response_program(sines: Sines) -> Arrays:
    """`fit_sines` and `fit_used`: the response, and (gain, pole), covariance and end of the fit to it."""
    response, _ = fit_sines(sines)
    fit = fit_used(response, sines.used)
    return {
        "response": response.response,
        "response_covariance": response.covariance,
        "amplitude_V": response.amplitude_V,
        "gain": fit.motor.gain,
        "pole": fit.motor.pole,
        "covariance": fit.covariance,
        "solved": fit.solved,
    }


@partial(program, brief=True)
def start_program(problem: Problem, log_poles: Float[Array, " k"]) -> Arrays:
    """`data_start`."""
    return {"psi": data_start(problem, log_poles)}


@program
def trajectory_program(problem: Problem, psi: Float[Array, " p"], seed: UInt32[Array, ""]) -> Arrays:
    """`solve` from `psi`, and `uncertainty` at its end."""
    solution, at = solve(problem, psi)
    errors = uncertainty(problem, solution, at, jax.random.key(seed))
    return solution._asdict() | errors._asdict()


@program
def evaluate_program(problem: Problem, psi: Float[Array, " p"]) -> Arrays:
    """`evaluate`."""
    return evaluate(problem, psi)._asdict()
