"""A torque that gives way: its mean over a step, found together with the step's motion."""

from collections.abc import Callable

import jax
import jax.numpy as jnp

from jaxmotor.motor.effects._base import Scalar

STEPS = 6
"""Of Newton's method."""


def yielding(resists: Callable[[Scalar, Scalar], Scalar], free: Scalar, softness: Scalar, duration: Scalar) -> Scalar:
    """f [V] with f = `resists`(turn, way) and way turn/`duration` = `free` - `softness` f, by Newton's method.

    `free` is the step's mean speed without it [rad/s], `softness` by how much a volt lowers that [rad/s/V], and `turn`
    >= 0 the angle turned [rad]. `resists` rises with the turn and levels off, so that steps from below do not
    overshoot, however stiff it is.
    """
    none = jnp.zeros_like(free)
    rest = resists(none, jnp.ones_like(free))
    way = jnp.where(free >= softness * rest, 1.0, -1.0)

    def lacking(speed: Scalar) -> Scalar:
        return speed - way * free + softness * way * resists(speed * duration, way)

    def newton(_, speed: Scalar) -> Scalar:
        value, slope = jax.jvp(lacking, (speed,), (jnp.ones_like(speed),))
        return jax.nn.relu(speed - value / slope)

    most = jax.nn.relu(way * free)
    speed = jax.lax.fori_loop(0, STEPS, newton, jax.nn.relu(most - lacking(most)))
    return resists(speed * duration, way)
