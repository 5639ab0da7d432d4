"""Free simulation of a first-order motor with Coulomb friction and a dead zone, exact over each tick.

Between reversals such a motor is linear, and under a held voltage it stops at most once within a tick. Towards the
terminal speed v = K (e - f sgn w) it moves as w(t) = v + (w - v) exp(-a t), stops at τ = log(1 - w/v)/a if v points the
other way, and either stays or starts anew towards v' = K (e - f sgn e). With w' = v + (w - v) exp(-a T), where it would
be after the tick if friction did not turn round, exp(-a (T - τ)) = 1 - w'/v, so that it ends at v' w'/v: speeds take no
logarithm. The angle is v τ + v' (T - τ) less the change of speed over a.

`simulate_motor` has the same laws, for all effects, but takes a stop to lie on a straight line within its step. In one
step for each tick it moved the poles that a fleet's fit finds by 2.4 standard errors (32 motors, ticks of 5 ms); in the
five steps that it needs there, the fit took 2.7 times as long. Hence this one, beside it and tested against it.
"""

import math
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from jaxmotor.motor import FirstOrder

TERMS = {4: 4, 8: 8}
"""Of the logarithm's series, by the bytes of a number: what is left out is below rounding."""
SPLIT = {4: (23, 127, np.int32), 8: (52, 1023, np.int64)}
"""Bits of the fraction, the exponent's zero, and the integer of the same size."""


class FrictionMotion(NamedTuple):
    """What the shafts did, row by row."""

    speed: Float[Array, "n batch"]
    """At the row [rad/s]."""
    turn: Float[Array, "n batch"]
    """Angle turned from this row to the next [rad]."""


def simulate_friction(
    motor: FirstOrder,
    friction_V: Float[Array, ""],
    dead_zone_V: Float[Array, ""],
    volts: Float[Array, "n batch"],
    reset: Bool[Array, "n batch"],
    initial_speed: Float[Array, "n batch"],
    duration: Float[Array, ""],
) -> FrictionMotion:
    """Motion under `volts` [V], each held for `duration` [s]. Rows come first: a step takes all of the batch.

    Where `reset` is true an experiment begins, and the motor runs at `initial_speed` [rad/s].
    """
    pole, taken = motor.pole, jnp.abs(motor.gain) * friction_V
    kept = jnp.exp(-pole * duration)

    def row(before: Float[Array, " batch"], given: tuple[Array, ...]) -> tuple[Array, FrictionMotion]:
        volts, reset, initial_speed = given
        speed = jnp.where(reset, initial_speed, before)
        target = motor.gain * _beyond(volts, dead_zone_V)
        anew = _beyond(target, taken)
        towards = jnp.where(speed > 0, target - taken, jnp.where(speed < 0, target + taken, anew))
        end = towards + (speed - towards) * kept
        stops = speed * end < 0
        # One division for all that follows: this is what a tick's time goes into.
        ratio = 1 - speed * (1 / jnp.where(stops, towards, 1.0))
        moving = jnp.where(stops, _log(ratio) * (1 / pole), duration)
        after = jnp.where(stops, anew * (1 - ratio * kept), end)
        turn = towards * moving + anew * (duration - moving) - (after - speed) * (1 / pole)
        return after, FrictionMotion(speed, turn)

    return jax.lax.scan(row, jnp.zeros_like(volts[0]), (volts, reset, initial_speed))[1]


def _beyond(x: Float[Array, "..."], limit: Float[Array, ""]) -> Float[Array, "..."]:
    """sgn(x) max(|x| - limit, 0); comparisons have cheaper derivatives than `sign` and `maximum`."""
    return jnp.where(x > limit, x - limit, jnp.where(x < -limit, x + limit, 0.0))


@jax.custom_jvp
def _log(y: Float[Array, "..."]) -> Float[Array, "..."]:
    """log y of y >= 1, exact to rounding of 1: y = 2^k m, s = (m - √2)/(m + √2), log m = log √2 + 2 artanh s.

    XLA's own takes three times as long, and would be most of a tick.
    """
    size = y.dtype.itemsize
    bits, zero, integer = SPLIT[size]
    whole = jax.lax.bitcast_convert_type(y, integer)
    # As the fraction of 2^bits a whole number is a float without a conversion, which processors have no fast one for.
    shifted = jax.lax.shift_right_logical(whole, integer(bits)) | integer((zero + bits) << bits)
    exponent = jax.lax.bitcast_convert_type(shifted, y.dtype) - y.dtype.type(2**bits + zero)
    fraction = (whole & integer((1 << bits) - 1)) | integer(zero << bits)
    m = jax.lax.bitcast_convert_type(fraction, y.dtype)
    root = y.dtype.type(np.sqrt(2))
    s = (m - root) / (m + root)
    square, series = s * s, jnp.zeros_like(s)
    for n in range(TERMS[size], 0, -1):
        series = (series + 1 / (2 * n + 1)) * square
    return exponent * math.log(2) + (math.log(2) / 2 + 2 * s * (1 + series))


_log.defjvps(lambda change, log, y: change * (1 / y))
