"""Free simulation of a linear motor on a train of held voltages; exact at every row."""

import functools
from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from jaxmotor.motor._linear import AbstractLinearMotor, Hold
from jaxmotor.motor._zoh import hold_switched


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


class Switched(NamedTuple):
    """A row whose voltage changes once within it."""

    first: Float[Array, " n"]
    """Voltage until then [V]."""
    second: Float[Array, " n"]
    part: Float[Array, " n"]
    """When, since the row began [s]."""


def switched(
    volts: Float[Array, " n"], reset: Bool[Array, " n"], duration: Float[Array, "*n"], late: Float[Array, ""]
) -> Switched:
    """Rows of which each voltage acts `late` [s] after its row begins, or before it where that is negative.

    A voltage is never further off than its row is long. Before an experiment there was none.
    """
    ends = jnp.concatenate([reset[1:], jnp.ones(1, bool)])
    before = jnp.where(reset, 0.0, jnp.roll(volts, 1))
    after = jnp.where(ends, volts, jnp.roll(volts, -1))
    # Never quite nothing: the hold of a motor of second order has no derivative there.
    least = 1e-9 * duration
    part = jnp.clip(jnp.where(late < 0, duration + late, late), least, duration - least)
    early = late < 0
    part = jnp.broadcast_to(part, volts.shape)
    return Switched(jnp.where(early, volts, before), jnp.where(early, after, volts), part)


def simulate(
    motor: AbstractLinearMotor,
    volts: Float[Array, " n"],
    reset: Bool[Array, " n"],
    initial_speed: Float[Array, " n"],
    duration: Float[Array, ""] | Float[Array, " n"],
    late: Float[Array, ""] | None = None,
) -> Motion:
    """Motion under `volts` [V], each held for `duration` [s] (one for all rows, or one per row).

    Where `reset` is true an experiment begins: the motor runs at `initial_speed` [rad/s] of that row, without
    torque. Experiments can so stand end to end, and a batch of unequal ones is packed into few long sequences. Voltages
    act `late` [s] (`switched`).
    """
    uniform = duration.ndim == 0
    if late is None:
        drives, holds = (volts,), (motor.hold(duration) if uniform else jax.vmap(motor.hold)(duration),)
    else:
        rows = switched(volts, reset, duration, late)
        drives = rows.first, rows.second
        lengths = (rows.part[0], duration) if uniform else (rows.part, duration)
        pair = functools.partial(hold_switched, motor)
        holds = pair(*lengths) if uniform else jax.vmap(pair)(*lengths)

    def tick(state: Float[Array, " order"], row):
        drives, reset, initial_speed, own = row
        fresh = jnp.zeros_like(state).at[0].set(initial_speed)
        state = jnp.where(reset, fresh, state)
        after, turn = driven(holds if uniform else own, state, drives)
        return after, (state, turn)

    rows = (drives, reset, initial_speed, None if uniform else holds)
    _, (state, turn) = jax.lax.scan(tick, jnp.zeros((motor.order,), volts.dtype), rows)
    return Motion(state, turn)


def driven(
    holds: tuple[Hold, ...], state: Float[Array, " order"], volts: tuple[Float[Array, ""], ...]
) -> tuple[Float[Array, " order"], Float[Array, ""]]:
    """State after a row, and the angle turned in it [rad]; each hold is that of one of `volts`."""
    drive = sum((hold.drive * u for hold, u in zip(holds, volts, strict=True)), jnp.zeros_like(state))
    turn = sum((hold.turn_drive * u for hold, u in zip(holds, volts, strict=True)), jnp.zeros_like(state[0]))
    return holds[0].transition @ state + drive, holds[0].turn @ state + turn
