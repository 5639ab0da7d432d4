"""Free simulation of a given motor beside what was measured."""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from jaxmotor.prediction import Problem, predict, start_columns


@eqx.filter_jit
def follow(problem: Problem, psi: Float[Array, " p"]) -> tuple[Float[Array, " k"], Float[Array, "lane row"]]:
    """Initial speed of each piece [rad/s], and measured minus simulated [units] of the motor ψ; nothing of ψ is fitted.

    A piece whose initial speed is not known begins at the one that fits it best (least squares).
    """
    valid = jnp.asarray(problem.lanes.valid)
    speeds = jnp.zeros(problem.pieces + 1, psi.dtype)

    def residual(simulated: Float[Array, "lane row"]) -> Float[Array, "lane row"]:
        return jnp.where(valid, jnp.asarray(problem.lanes.observed) - simulated, 0.0)

    off = residual(predict(psi, speeds, problem))
    if not problem.free:
        return speeds, off
    start = jnp.where(valid, start_columns(psi, problem)[..., 0], 0.0)
    piece = jnp.asarray(problem.lanes.piece)
    both = jnp.stack([start * off, start**2], axis=-1).reshape(-1, 2)
    total = jax.ops.segment_sum(both, piece.reshape(-1), num_segments=problem.pieces + 1)
    speeds = total[:, 0] / jnp.where(total[:, 1] > 0, total[:, 1], 1.0)
    return speeds, off - start * speeds[piece]
