"""By how much a recording differs from what it would show of a motor with effects."""

import jax.numpy as jnp
from jaxtyping import Array, Float

from jaxmotor._programs import Arrays, program
from jaxmotor.diagnosis._trial import Trial
from jaxmotor.motor import Motor, scan_rows
from jaxmotor.prediction import residuals


@program
def residuals_program(motors: Motor, speeds: Float[Array, "motors k"], trial: Trial) -> Arrays:
    """Of each of a batch of motors whose pieces begin at `speeds`: the `plain` residual [units] and its `drift`.

    Rows come first (row, sequence, motor), as they are walked through.
    """
    plain = residuals(motors, speeds, trial)
    return {"plain": plain, "drift": drift(plain, trial)}


def drift(plain: Float[Array, "row sequence motors"], trial: Trial) -> Float[Array, "row sequence motors"]:
    """`plain` residuals passed through 1/(1 - ρ z⁻¹), anew in each piece.

    Differences of counts hardly show a small torque, positions hardly forgive a wrong initial one; a drift over
    twenty ticks is between the two (ρ = 0: differences; ρ = 1: positions).
    """

    def row(
        before: Float[Array, "sequence motors"], now
    ) -> tuple[Float[Array, "sequence motors"], Float[Array, "sequence motors"]]:
        residual, begins = now
        after = residual + jnp.where(begins, 0.0, trial.memory)[:, None] * before
        return after, after

    return scan_rows(row, jnp.zeros_like(plain[0]), (plain, trial.problem.begins.T), trial.used)[1]
