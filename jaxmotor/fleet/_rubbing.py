"""Free simulation of a first-order motor with Coulomb friction and a dead zone, exact over each tick.

Between reversals such a motor is linear, and under a held voltage it stops at most once within a tick. Towards the
terminal speed v = K (e - f sgn w) it moves as w(t) = v + (w - v) exp(-a t), stops at τ = log(1 - w/v)/a if v points the
other way, and either stays or starts anew towards v' = K (e - f sgn e). With w' = v + (w - v) exp(-a T), where it would
be after the tick if friction did not turn round, exp(-a (T - τ)) = 1 - w'/v, so that it ends at v' w'/v: speeds take no
logarithm. The angle is v τ + v' (T - τ) less the change of speed over a.
"""

import functools
import math
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax.custom_derivatives import SymbolicZero
from jaxtyping import Array, Bool, Float

from jaxmotor.motor import FirstOrder

TERMS = {4: 4, 8: 8}
"""Of the logarithm's series, by the bytes of a number: what is left out is below rounding."""
SPLIT = {4: (23, 127, np.int32), 8: (52, 1023, np.int64)}
"""Bits of the fraction, the exponent's zero, and the integer of the same size."""


class RubbingMotion(NamedTuple):
    """What the shafts did, row by row."""

    speed: Float[Array, "n lane"]
    """At the row [rad/s]."""
    turn: Float[Array, "n lane"]
    """Angle turned from this row to the next [rad]."""


class _Law(NamedTuple):
    """What is the same in all rows."""

    gain: Float[Array, ""]
    pole: Float[Array, ""]
    rub: Float[Array, ""]
    """Terminal speed that friction takes away [rad/s]."""
    dead_zone: Float[Array, ""]
    duration: Float[Array, ""]
    """T [s]."""


class _Tick(NamedTuple):
    """A tick; speeds [rad/s]."""

    speed: Float[Array, "..."]
    """As it begins."""
    towards: Float[Array, "..."]
    """Terminal, as it begins."""
    anew: Float[Array, "..."]
    """Terminal, from rest."""
    pole: Float[Array, ""]
    duration: Float[Array, ""]


def simulate_rubbing(
    motor: FirstOrder,
    friction_V: Float[Array, ""],
    dead_zone_V: Float[Array, ""],
    volts: Float[Array, "n lane"],
    reset: Bool[Array, "n lane"],
    initial_speed: Float[Array, "n lane"],
    duration: Float[Array, ""],
) -> RubbingMotion:
    """Motion under `volts` [V], each held for `duration` [s]. Rows come first: a step takes those of all lanes at once.

    Where `reset` is true an experiment begins, and the motor runs at `initial_speed` [rad/s].
    """
    gain, pole = motor.gain, motor.pole
    law = _Law(gain, pole, jnp.abs(gain) * friction_V, dead_zone_V, duration)

    def row(before: Float[Array, " lane"], given: tuple[Array, ...]) -> tuple[Array, RubbingMotion]:
        volts, reset, initial_speed = given
        speed = jnp.where(reset, initial_speed, before)
        after, turn = _moved(_tick(law, speed, volts))
        return after, RubbingMotion(speed, turn)

    return jax.lax.scan(row, jnp.zeros_like(volts[0]), (volts, reset, initial_speed))[1]


def _tick(law: _Law, speed: Float[Array, "..."], volts: Float[Array, "..."]) -> _Tick:
    target = law.gain * _beyond(volts, law.dead_zone)
    anew = _beyond(target, law.rub)
    towards = jnp.where(speed > 0, target - law.rub, jnp.where(speed < 0, target + law.rub, anew))
    return _Tick(speed, towards, anew, law.pole, law.duration)


def _beyond(x: Float[Array, "..."], limit: Float[Array, ""]) -> Float[Array, "..."]:
    """sgn(x) max(|x| - limit, 0); comparisons have cheaper derivatives than `sign` and `maximum`."""
    return jnp.where(x > limit, x - limit, jnp.where(x < -limit, x + limit, 0.0))


@jax.custom_jvp
def _moved(tick: _Tick) -> tuple[Float[Array, "..."], Float[Array, "..."]]:
    """Speed at the end of a tick [rad/s], and the angle turned in it [rad]."""
    found = _stop(tick)
    return found.after, _turn(tick, found)


class _Stop(NamedTuple):
    kept: Float[Array, ""]
    """exp(-a T)."""
    end: Float[Array, "..."]
    """Speed at the tick's end if friction did not turn round [rad/s]."""
    stops: Bool[Array, "..."]
    inverse: Float[Array, "..."]
    """1/v; 1 where it does not stop."""
    moving: Float[Array, "..."]
    """Time until it stops, or the tick [s]."""
    after: Float[Array, "..."]


def _stop(tick: _Tick) -> _Stop:
    speed, towards, anew, pole, duration = tick
    kept = jnp.exp(-pole * duration)
    end = towards + (speed - towards) * kept
    stops = speed * end < 0
    # One division for all that follows: this is what a tick's time goes into.
    inverse = 1 / jnp.where(stops, towards, 1.0)
    moving = jnp.where(stops, _log(1 - speed * inverse) * (1 / pole), duration)
    return _Stop(kept, end, stops, inverse, moving, jnp.where(stops, anew * end * inverse, end))


def _turn(tick: _Tick, found: _Stop) -> Float[Array, "..."]:
    rest = tick.duration - found.moving
    return tick.towards * found.moving + tick.anew * rest - (found.after - tick.speed) * (1 / tick.pole)


def _moved_jvp(primals, tangents):
    """Factors are computed once, however many derivatives there are; what does not change takes no time."""
    [tick], [change] = primals, tangents
    found = _stop(tick)
    speed, towards, anew, pole, duration = tick
    kept, slow, rate = found.kept, 1 / pole, found.inverse
    by_end = jnp.where(found.stops, anew * rate, 1.0)
    by_anew = jnp.where(found.stops, found.end * rate, 0.0)
    faster = by_end * (towards - speed) * kept
    after = _Tick(by_end * kept, by_end * (1 - kept) - by_anew * anew * rate, by_anew, faster * duration, faster * pole)
    # A stop comes later by dτ; until then the shaft goes towards v, and afterwards towards v'.
    later = jnp.where(found.stops, (towards - anew) * slow / (towards - speed), 0.0)
    moving, timed = found.moving, jnp.where(found.stops, found.moving, 0.0)
    turn = _Tick(
        slow - later,
        moving + later * speed * rate,
        duration - moving,
        slow * ((found.after - speed) * slow - (towards - anew) * timed),
        jnp.where(found.stops, anew, towards),
    )
    after = _along(after, change, tick)
    return (found.after, _turn(tick, found)), (after, _along(turn, change, tick) - slow * after)


_moved.defjvp(_moved_jvp, symbolic_zeros=True)


def _along(factors: _Tick, change: _Tick, tick: _Tick) -> Float[Array, "..."]:
    """Sum of `factors` times `change`."""
    pairs = zip(factors, change, strict=True)
    terms = [factor * own for factor, own in pairs if not isinstance(own, SymbolicZero)]
    return functools.reduce(jnp.add, terms, jnp.zeros_like(tick.speed))


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
