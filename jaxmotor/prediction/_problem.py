"""A packed recording on its way into JAX: what was applied, what was read, and how."""

import dataclasses
from typing import Literal

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from jaxmotor._precision import to_jax
from jaxmotor.prediction._packing import Batch, Packed


class Problem(eqx.Module):
    """One recording, and what is asked of it. Static fields choose the program, arrays are its data."""

    batch: Batch
    unit: Float[Array, ""]
    window: Float[Array, ""]
    kind: Literal["turn", "speed", "window"] = eqx.field(static=True)
    floor_known: bool = eqx.field(static=True)
    pieces: int = eqx.field(static=True)
    clusters: int = eqx.field(static=True)
    free: bool = eqx.field(static=True)
    """Some piece begins at an unknown speed."""
    row: Float[Array, ""] | None = None
    """Typical duration of a row [s], in which ψ holds the timing offset; None where the log's timing is known."""
    held: Bool[Array, " p"] | None = None
    """Which of ψ are not fitted; None where all are, and ψ does not hold how the log's speeds were averaged."""

    @property
    def floor(self) -> float:
        """Variance of one observation from the encoder alone [units²]."""
        return 1 / 6 if self.kind == "turn" else 1 / 12

    @property
    def shared(self) -> float:
        """Covariance between neighbours from the encoder alone, with its sign changed [units²]."""
        return 1 / 12 if self.kind == "turn" else 0.0

    @property
    def begins(self) -> Bool[Array, "sequence row"]:
        """Rows whose error shares nothing with the row before."""
        batch = self.batch
        before = jnp.pad(batch.valid[:, :-1], ((0, 0), (1, 0)))
        return jnp.asarray(batch.reset) | ~before


def holding(problem: Problem, places: tuple[int, ...]) -> Problem:
    """`problem`, in which those of ψ = (K, b, log a) at `places` are not fitted."""
    if not places:
        return problem
    return dataclasses.replace(problem, held=to_jax(np.isin(np.arange(3), places)))


def as_problem(packed: Packed, timed: bool = False, held: np.ndarray | None = None) -> Problem:
    """`packed` with what the solver needs to know of it; with `timed` its timing offset is unknown.

    With `held` (p,) so is how its speeds were averaged; those of ψ are not fitted.
    """
    observation, batch = packed.observation, packed.batch
    return Problem(
        batch,
        to_jax(observation.unit),
        to_jax(observation.window_s),
        observation.kind if held is None else "window",
        observation.floor_known,
        packed.pieces,
        packed.clusters,
        bool(batch.free.any()),
        to_jax(np.float64(packed.durations[0])) if timed else None,
        None if held is None else to_jax(held),
    )
