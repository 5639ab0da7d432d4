"""Many motors in one compiled program: sine fit, response fit, trajectory fit and their errors, as `identify` does.

The program takes the motors one after the other. A motor's sequences already fill the vector units, and side by side
every motor would wait for the slowest fit while the arrays outgrow the cache: 16 at once took 1.6 times as long each,
64 four times.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from jaxmotor._errors import JaxmotorError
from jaxmotor._precision import in_float64, to_jax
from jaxmotor._programs import Arrays, program
from jaxmotor.estimate import (
    NOT_CONVERGED,
    Assessment,
    Estimate,
    Prepared,
    agreement,
    assess,
    estimate_of,
    response_program,
    scores,
    sine_motor,
    start_program,
    trajectory_program,
)
from jaxmotor.fleet._ready import Case, Ready, stack

BATCH = 32
"""Motors in one call."""
LEFT_OUT = ("jacobian",)
"""What of a solution stays inside the program."""
OF_SINES = ("gain", "pole", "covariance", "solved")
"""What comes out of it of the fit to the frequency response."""


class Identified(NamedTuple):
    """What `identify` finds of one motor, without its traces."""

    assessment: Assessment
    chi2_per_sample: float
    fit_percent: float
    notes: tuple[str, ...]
    estimate: Estimate


class Started(NamedTuple):
    """A batch whose program runs."""

    motors: list[Ready]
    found: Arrays


def identify_batch(motors: list[Ready], seed: int = 0) -> list[Identified | JaxmotorError]:
    """Each of `motors`, which share one key and are at most `BATCH`, or the sentence about it."""
    return results_of(start_batch(motors, seed))


@in_float64
def start_batch(motors: list[Ready], seed: int = 0) -> Started:
    """`identify_batch` begun: the program runs, and this thread is free meanwhile."""
    cases = stack([motor.case for motor in motors], BATCH)
    return Started(motors, batch_program(*to_jax((cases, np.int32(len(motors)), np.uint32(seed)))))


def results_of(started: Started) -> list[Identified | JaxmotorError]:
    """What `identify_batch` returns, once the program has ended."""
    numbers = {name: np.asarray(value) for name, value in started.found.items()}
    return [
        _identified(motor.prepared, {name: np.asarray(value[index]) for name, value in numbers.items()})
        for index, motor in enumerate(started.motors)
    ]


@program
def batch_program(cases: Case, count: Int[Array, ""], seed: Array) -> Arrays:
    """What the programs of `identify` return, for the first `count` motors of `cases` (motor, ...)."""
    return in_turn(lambda case: _one(case, seed), cases, count)


def in_turn(one: Callable[[Any], Arrays], arrays: Any, count: Int[Array, ""]) -> Arrays:
    """`one` of each of the first `count` motors in `arrays`; zeros for the rest."""
    size = jax.tree.leaves(arrays)[0].shape[0]
    shapes = jax.eval_shape(one, jax.tree.map(lambda leaf: leaf[0], arrays))
    empty = jax.tree.map(lambda leaf: jnp.zeros((size, *leaf.shape), leaf.dtype), shapes)

    def body(index: Int[Array, ""], results: Arrays) -> Arrays:
        own = jax.tree.map(lambda leaf: jax.lax.dynamic_index_in_dim(leaf, index, keepdims=False), arrays)
        return jax.tree.map(lambda all_, new: all_.at[index].set(new), results, one(own))

    return jax.lax.fori_loop(0, count, body, empty)


def _one(case: Case, seed: Array) -> Arrays:
    psi, sines = _start(case)
    found = trajectory_program(case.problem, psi, seed)
    return sines | {name: value for name, value in found.items() if name not in LEFT_OUT}


def _start(case: Case) -> tuple[Float[Array, " 3"], Arrays]:
    """The start that the sines give, where they do, and what they say; else that of the data."""
    if case.sines is None:
        return _data_start(case), {}
    found = response_program(case.sines)
    psi = jnp.stack([found["gain"], jnp.zeros_like(found["gain"]), jnp.log(found["pole"])])
    psi = jax.lax.cond(found["solved"], lambda: psi, lambda: _data_start(case))
    return psi, {f"sine_{name}": found[name] for name in OF_SINES}


def _data_start(case: Case) -> Float[Array, " 3"]:
    return start_program(case.problem, case.log_poles)["psi"]


def _identified(prepared: Prepared, found: dict[str, np.ndarray]) -> Identified | JaxmotorError:
    batch = prepared.packed.batch.volts.shape[0]
    found = found | {"residual": found["residual"][:batch], "jacobian": np.zeros(0)}
    sines = {name.removeprefix("sine_"): value for name, value in found.items() if name.startswith("sine_")}
    motor = sine_motor(sines) if sines else None
    notes = list(prepared.notes)
    if motor is not None and not motor.solved:
        notes.append(NOT_CONVERGED)
    try:
        estimate = estimate_of(prepared.recording, found)
        assessment = assess(prepared.recording, prepared.packed, *estimate)
    except JaxmotorError as error:
        return error
    score = scores(prepared.packed, np.asarray(estimate.solution.residual))
    all_notes = (*notes, *assessment.notes, *agreement(motor, assessment))
    return Identified(assessment, score["chi2_per_sample"], score["fit_percent"], all_notes, estimate)
