"""Free simulation of a linear motor on a train of held voltages; exact at every row."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from jaxmotor.motor._linear import AbstractLinearMotor


class Motion(NamedTuple):
    """What the shaft did, row by row."""

    state: Float[Array, "n order"]
    """State at the row; the first is the speed [rad/s]."""
    turn: Float[Array, " n"]
    """Angle turned from this row to the next [rad]."""

    @property
    def speed(self) -> Float[Array, " n"]:
        """Speed at the row [rad/s]."""
        return self.state[:, 0]


def simulate(
    motor: AbstractLinearMotor,
    volts: Float[Array, " n"],
    reset: Bool[Array, " n"],
    initial_speed: Float[Array, " n"],
    duration: Float[Array, ""] | Float[Array, " n"],
) -> Motion:
    """Motion under `volts` [V], each held for `duration` [s] (one for all rows, or one per row).

    Where `reset` is true an experiment begins: the motor runs at `initial_speed` [rad/s] of that row, without
    torque. Experiments can so stand end to end, and a batch of unequal ones is packed into few long lanes.
    """
    uniform = duration.ndim == 0
    holds = motor.hold(duration) if uniform else jax.vmap(motor.hold)(duration)

    def tick(state: Float[Array, " order"], row):
        volts, reset, initial_speed, hold = row
        hold = holds if uniform else hold
        fresh = jnp.zeros_like(state).at[0].set(initial_speed)
        state = jnp.where(reset, fresh, state)
        turn = hold.turn @ state + hold.turn_drive * volts
        return hold.transition @ state + hold.drive * volts, (state, turn)

    rows = (volts, reset, initial_speed, None if uniform else holds)
    _, (state, turn) = jax.lax.scan(tick, jnp.zeros((motor.order,), volts.dtype), rows)
    return Motion(state, turn)
