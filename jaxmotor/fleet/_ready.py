"""A recording as arrays of a shape that many recordings share."""

import dataclasses
from collections.abc import Hashable, Iterable
from typing import Any, NamedTuple

import jax
import numpy as np
from jaxtyping import Float

from jaxmotor._errors import JaxmotorError
from jaxmotor._precision import in_float64
from jaxmotor.estimate import (
    Prepared,
    Sines,
    enough_sines,
    needs_more_than_one_frequency,
    needs_transients,
    pole_range,
    prepare,
    sine_data,
)
from jaxmotor.prediction import Batch, Packed, Problem, as_problem
from jaxmotor.recording import Recording

SEQUENCE_STEP = 4
"""Numbers of sequences are rounded up to a multiple of this."""
LEAST_PIECES, LEAST_CLUSTERS = 32, 32
"""To which their numbers are rounded up, so that motors share programs."""


class Case(NamedTuple):
    """What a program needs of a motor; of a batch, each array has a leading axis."""

    problem: Problem
    sines: Sines | None
    """None where there are not enough of them."""
    log_poles: Float[Any, "*motor k"]
    """From which the fit may start."""


class Ready(NamedTuple):
    """One motor, ready for a batch."""

    prepared: Prepared
    case: Case

    @property
    def key(self) -> Hashable:
        """What must be equal for motors to be done by one program: what chooses it, and the shapes of its arrays."""
        leaves, tree = jax.tree.flatten(self.case)
        return tree, tuple(leaf.shape for leaf in leaves)


@in_float64
def ready(recording: Recording, hold_out: Iterable[int] = ()) -> Ready:
    """`recording` for a batch. Nothing is compiled.

    **Raises:** `JaxmotorError`, as `identify`.
    """
    prepared = prepare(recording, hold_out)
    needs_more_than_one_frequency(recording, prepared.fitted)
    needs_transients(recording, prepared.fitted)
    packed, fitted = prepared.packed, prepared.fitted
    sines = sine_data(recording, fitted) if enough_sines(recording, fitted) else None
    return Ready(prepared, Case(_padded(packed), sines, pole_range(packed.batch)))


def stack(cases: list[Any], size: int) -> Any:
    """Trees of arrays as one whose arrays have a leading axis of `size`, the unused rest zero."""

    def block(*leaves: Any) -> np.ndarray:
        whole = np.zeros((size, *leaves[0].shape), leaves[0].dtype)
        for index, leaf in enumerate(leaves):
            whole[index] = leaf
        return whole

    return jax.tree.map(block, *cases)


def _padded(packed: Packed) -> Problem:
    """The problem of `packed`, of a shape that many share: rows that hold nothing name what comes after the last piece
    and the last cluster."""
    pieces, clusters = max(packed.pieces, LEAST_PIECES), max(packed.clusters, LEAST_CLUSTERS)
    batch, number = packed.batch, len(packed.batch.volts)
    batch = batch._replace(
        piece=np.where(batch.piece == packed.pieces, pieces, batch.piece),
        cluster=np.where(batch.cluster == packed.clusters, clusters, batch.cluster),
    )
    empty = {"piece": pieces, "cluster": clusters, "duration": 1.0, "span": 1.0}
    padded = []
    for name, array in batch._asdict().items():
        more = np.full((-number % SEQUENCE_STEP, *array.shape[1:]), empty.get(name, 0), array.dtype)
        padded.append(np.concatenate([array, more]) if array.ndim and len(more) else array)
    return dataclasses.replace(as_problem(packed), batch=Batch(*padded), pieces=pieces, clusters=clusters)


def problem_of(error: Exception) -> str:
    """The sentence about one motor that could not be done, whatever went wrong with it."""
    if isinstance(error, JaxmotorError):
        return str(error)
    return f"a defect of jaxmotor, not of the recording: {type(error).__name__}: {error}"
