"""Free simulation of a first-order motor with Coulomb friction and a dead zone, exact over each tick.

Between reversals such a motor is linear, and under a held voltage it stops at most once within a tick. Towards the
terminal speed v = K (e - f sgn w) it moves as w(t) = v + (w - v) exp(-a t), stops at τ = log(1 - w/v)/a if v points the
other way, and either stays or starts anew towards v' = K (e - f sgn e). With w' = v + (w - v) exp(-a T), where it would
be after the tick if friction did not turn round, exp(-a (T - τ)) = 1 - w'/v, so that it ends at v' w'/v: speeds take no
logarithm. The angle, v τ + v' (T - τ) less the change of speed over a, takes one, in a pass over all rows.

The derivatives of the speeds obey a linear recurrence, whose factors are known for all rows once the speeds are.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

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


class _Law(NamedTuple):
    """What is the same in all rows."""

    gain: Float[Array, ""]
    rub: Float[Array, ""]
    """Terminal speed that friction takes away [rad/s]."""
    dead_zone: Float[Array, ""]
    kept: Float[Array, ""]
    """exp(-a T)."""


class _Tick(NamedTuple):
    """What each row does; terminal speeds [rad/s]."""

    towards: Float[Array, "..."]
    """As it begins."""
    anew: Float[Array, "..."]
    """From rest."""
    end: Float[Array, "..."]
    """Speed at its end if friction did not turn round [rad/s]."""
    stops: Bool[Array, "..."]


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
    law = _Law(gain, jnp.abs(gain) * friction_V, dead_zone_V, jnp.exp(-pole * duration))
    after = _ends(law, volts, jnp.where(reset, initial_speed, jnp.nan))
    speed = jnp.where(reset, initial_speed, _one_later(after))
    tick = _tick(law, speed, volts)
    ratio = jnp.where(tick.stops, -speed / jnp.where(tick.stops, tick.towards, 1.0), 0.0)
    moving = jnp.where(tick.stops, jnp.log1p(ratio) / pole, duration)
    turn = tick.towards * moving + tick.anew * (duration - moving) - (after - speed) / pole
    return RubbingMotion(speed, turn)


def _tick(law: _Law, speed: Float[Array, "..."], volts: Float[Array, "..."]) -> _Tick:
    target = law.gain * _beyond(volts, law.dead_zone)
    forward, backward, anew = target - law.rub, target + law.rub, _beyond(target, law.rub)
    towards = jnp.where(speed > 0, forward, jnp.where(speed < 0, backward, anew))
    end = towards + (speed - towards) * law.kept
    return _Tick(towards, anew, end, speed * end < 0)


def _beyond(x: Float[Array, "..."], limit: Float[Array, ""]) -> Float[Array, "..."]:
    """sgn(x) max(|x| - limit, 0); comparisons have cheaper derivatives than `sign` and `maximum`."""
    return jnp.where(x > limit, x - limit, jnp.where(x < -limit, x + limit, 0.0))


def _after(law: _Law, speed: Float[Array, "..."], volts: Float[Array, "..."]) -> Float[Array, "..."]:
    """Speed at the end of a row [rad/s]."""
    towards, anew, end, stops = _tick(law, speed, volts)
    return jnp.where(stops, anew * (end / jnp.where(stops, towards, 1.0)), end)


@jax.custom_jvp
def _ends(law: _Law, volts: Float[Array, "lane n"], begin: Float[Array, "lane n"]) -> Float[Array, "lane n"]:
    """Speed at the end of each row; it begins with the one before, or with `begin` where that is not NaN."""

    def row(before, given):
        volts, begin = given
        return _after(law, jnp.where(jnp.isnan(begin), before, begin), volts)

    return _walked(row, (volts, begin))


@_ends.defjvp
def _ends_jvp(primals, tangents):
    law, volts, begin = primals
    after, starts = _ends(law, volts, begin), ~jnp.isnan(begin)
    speed = jnp.where(starts, begin, _one_later(after))
    _, factor = jax.jvp(lambda speed: _after(law, speed, volts), (speed,), (jnp.ones_like(speed),))
    _, own = jax.jvp(lambda law, volts: _after(law, speed, volts), (law, volts), tangents[:2])
    # What begins anew forgets what was before.
    rows = (jnp.where(starts, 0.0, factor), own + jnp.where(starts, factor * tangents[2], 0.0))
    return after, _walked(lambda moved, row: row[0] * moved + row[1], rows)


def _walked(row: Callable[..., Any], given: tuple[Float[Array, "lane n"], ...]) -> Float[Array, "lane n"]:
    """What `row` makes of what it made of the row before, zero at first, and of `given`; all lanes side by side."""

    def both(before, given):
        after = row(before, given)
        return after, after

    _, found = jax.lax.scan(both, jnp.zeros_like(given[0][:, 0]), tuple(each.T for each in given))
    return found.T


def _one_later(found: Float[Array, "lane n"]) -> Float[Array, "lane n"]:
    return jnp.concatenate([jnp.zeros_like(found[:, :1]), found[:, :-1]], axis=1)
