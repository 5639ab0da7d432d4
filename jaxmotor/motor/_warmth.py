"""How warm the winding is throughout a recording, from what was measured."""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float

from jaxmotor.motor._motor import Motor, source_of
from jaxmotor.motor.effects import MeasuredLog, SensorLag, WindingHeating
from jaxmotor.motor.effects._base import Scalar, Winding
from jaxmotor.motor.effects._substep import Parts, parts_of


def warmth(motor: Motor, log: MeasuredLog) -> Float[Array, " n"] | None:
    """(n,) relative rise of the winding's resistance [1] at each row of `log`; None where `motor` has no law of it.

    The current that heats is the one that all laws of bridge and winding together give, at the voltage that acts and at
    the speed of the shaft: a late voltage and a filtered reading are taken back.
    """
    heating = next((effect for effect in motor.effects if isinstance(effect, WindingHeating)), None)
    if heating is None:
        return None
    parts = parts_of(motor.effects)
    back = (1 - motor.viscous_share) / motor.linear.gain

    def current(volts: Scalar, speed: Scalar, time: Scalar, rise: Scalar) -> tuple[Scalar, Scalar]:
        source = source_of(parts, log.supply, volts, time)
        way = jnp.where(source.duty * (source.volts - back * speed) < 0, -1.0, 1.0)
        winding = Winding(source.volts, way)
        for law in parts.windings:
            winding = law.winding(winding, source, rise if law is heating else None)
        q, slope = winding.current(back * speed)
        return q, slope * back

    return heating.history(_of_shaft(motor, _late(parts, log)), back, motor.linear.pole, current)


def _follows(log: MeasuredLog) -> Bool[Array, " n"]:
    """Rows that follow the one before them without a pause."""
    return jnp.diff(log.time, prepend=log.time[:1] - 2 * log.duration) < 1.5 * log.duration


def _late(parts: Parts, log: MeasuredLog) -> MeasuredLog:
    """`log` with the voltages that act in each row, in the mean; before an experiment there were none."""
    if not parts.delays:
        return log
    ticks = sum(effect.delay() for effect in parts.delays) / log.duration
    whole = jnp.floor(ticks)
    row = jnp.arange(len(log.volts))
    first = jax.lax.cummax(jnp.where(_follows(log), 0, row))

    def ago(number: Scalar) -> Float[Array, " n"]:
        source = row - number.astype(row.dtype)
        return jnp.where(source >= first, log.volts[jnp.maximum(source, 0)], 0.0)

    return log._replace(volts=(1 - ticks + whole) * ago(whole) + (ticks - whole) * ago(whole + 1))


def _of_shaft(motor: Motor, log: MeasuredLog) -> MeasuredLog:
    """`log` with the speeds that a filter hid, w + τ w', and the noise that this adds."""
    lags = [effect.time_constant_s for effect in motor.effects if isinstance(effect, SensorLag)]
    if not lags:
        return log
    part = sum(lags[1:], lags[0]) / (2 * log.duration)
    follows = _follows(log)
    goes_on = jnp.concatenate([follows[1:], jnp.zeros(1, bool)])
    rate = jnp.where(follows & goes_on, jnp.roll(log.speed, -1) - jnp.roll(log.speed, 1), 0.0)
    return log._replace(speed=log.speed + part * rate, speed_variance=(1 + 2 * part**2) * log.speed_variance)
