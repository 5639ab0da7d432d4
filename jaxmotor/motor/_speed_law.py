"""The PI law of a speed loop. With the error e at a tick, the period T, and the integral I [V]:

    u = gain e + I + now Ki T e
    applied = the nearest multiple of a step to u, within the limit
    I becomes I + Ki T e, unless u is beyond the limit on the side to which Ki e pushes

`now` is 1 where the integral includes the error of the same tick, and 0 where an error enters one tick later.
"""

from collections.abc import Callable
from typing import NamedTuple

import jax.numpy as jnp
from jaxtyping import Array, Float

Scalar = Float[Array, "..."]


class SpeedLaw(NamedTuple):
    """The law's numbers."""

    gain: Scalar
    """[V s/rad]"""
    integral_gain: Scalar
    """Ki [V/rad]."""
    limit_V: Scalar
    """Of the voltage; infinite where there is none."""
    step_V: Scalar
    """One duty; 0 where the voltage is not quantised."""
    integral_limit_V: Scalar
    """Of the integral; infinite where there is none."""
    now: Scalar
    """The integral includes the error of the same tick: 1 or 0."""

    @classmethod
    def of(
        cls,
        gain: float,
        integral_gain: float,
        limit_V: float,
        step_V: float = 0.0,
        integral_limit_V: float | None = None,
        now: float = 0.0,
    ) -> "SpeedLaw":
        """From plain numbers; without an `integral_limit_V` it is `limit_V`."""
        bound = limit_V if integral_limit_V is None else integral_limit_V
        return cls(*(jnp.asarray(value) for value in (gain, integral_gain, limit_V, step_V, bound, now)))


def command(
    law: SpeedLaw,
    error: Scalar,
    integral: Scalar,
    duration: Scalar,
    compensated: Callable[[Scalar], Scalar] = lambda volts: volts,
) -> tuple[Scalar, Scalar]:
    """Voltage [V] for an `error` [rad/s] at the end of a tick of `duration` [s], and the integral [V] after it.

    `compensated` makes of u the voltage that is asked for, which saturates in its place.
    """
    change = law.integral_gain * duration * error
    wanted = compensated(law.gain * error + integral + law.now * change)
    winds_up = (jnp.abs(wanted) > law.limit_V) & (wanted * change > 0)
    integral = jnp.clip(integral + jnp.where(winds_up, 0.0, change), -law.integral_limit_V, law.integral_limit_V)
    return quantised(wanted, law.step_V, law.limit_V), integral


def quantised(volts: Scalar, step_V: Scalar, limit_V: Scalar) -> Scalar:
    """The multiple of `step_V` nearest to `volts`, within `limit_V`; `volts` themselves where the step is 0."""
    step = jnp.where(step_V > 0, step_V, 1.0)
    return jnp.clip(jnp.where(step_V > 0, step * jnp.round(volts / step), volts), -limit_V, limit_V)
