"""How warm the winding is throughout a recording, from what was measured."""

import jax.numpy as jnp
from jaxtyping import Array, Float

from jaxmotor.motor._motor import Motor, source_of
from jaxmotor.motor.effects import Heard, WindingHeating
from jaxmotor.motor.effects._base import Scalar, Winding
from jaxmotor.motor.effects._substep import parts_of


def warmth(motor: Motor, log: Heard) -> Float[Array, " n"] | None:
    """Relative rise of the winding's resistance at each row of `log`; None where `motor` has no law of it.

    The current that heats is the one that all laws of bridge and winding together give at the measured speed.
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

    return heating.history(log, back, motor.linear.pole, current)
