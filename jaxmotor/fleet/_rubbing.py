"""Free simulation of a first-order motor with Coulomb friction and a dead zone, exact over each tick.

Between reversals such a motor is linear, and under a held voltage it stops at most once within a tick. Towards the
terminal speed v = K (e - f sgn w) it moves as w(t) = v + (w - v) exp(-a t), stops at τ = log(1 - w/v)/a if v points the
other way, and either stays or starts anew towards K (e - f sgn e). With exp(-a (T - τ)) = p (1 - w/v) a tick takes one
logarithm: no steps within it, as `simulate_motor` needs for effects in general.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from jaxmotor.motor import FirstOrder


class RubbingMotion(NamedTuple):
    """What the shafts did, row by row."""

    speed: Float[Array, "lane n"]
    """At the row [rad/s]."""
    turn: Float[Array, "lane n"]
    """Angle turned from this row to the next [rad]."""


def simulate_rubbing(
    motor: FirstOrder,
    friction_V: Float[Array, ""],
    dead_zone_V: Float[Array, ""],
    volts: Float[Array, "lane n"],
    reset: Bool[Array, "lane n"],
    initial_speed: Float[Array, "lane n"],
    duration: Float[Array, ""],
) -> RubbingMotion:
    """Motion under `volts` [V], each held for `duration` [s].

    Where `reset` is true an experiment begins, and the motor runs at `initial_speed` [rad/s].
    """
    gain, pole = motor.gain, motor.pole
    lost = -jnp.expm1(-pole * duration)
    kept, coast = 1 - lost, lost / pole
    pull = jnp.sign(volts) * jnp.maximum(jnp.abs(volts) - dead_zone_V, 0.0)
    rub = jnp.abs(gain) * friction_V
    # Few arrays to walk along: a row that begins nothing has no speed to begin with.
    begin = jnp.where(reset, initial_speed, jnp.nan)

    def tick(speed, row):
        pull, begin = row
        target = gain * pull
        from_rest = jnp.sign(target) * jnp.maximum(jnp.abs(target) - rub, 0.0)
        speed = jnp.where(jnp.isnan(begin), speed, begin)
        towards = jnp.where(speed == 0, from_rest, target - jnp.sign(speed) * rub)
        end = towards + (speed - towards) * kept
        stops = speed * end < 0
        ratio = jnp.where(stops, -speed / jnp.where(stops, towards, 1.0), 0.0)
        moving = jnp.log1p(ratio) / pole
        turn = towards * duration + (speed - towards) * coast
        left = 1 - kept * (1 + ratio)
        turn_stopped = towards * moving + speed / pole + from_rest * (duration - moving - left / pole)
        after = jnp.where(stops, from_rest * left, end)
        return after, (speed, jnp.where(stops, turn_stopped, turn))

    _, (speed, turn) = jax.lax.scan(tick, jnp.zeros_like(volts[:, 0]), (pull.T, begin.T))
    return RubbingMotion(speed.T, turn.T)
