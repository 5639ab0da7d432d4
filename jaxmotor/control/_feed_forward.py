"""The voltage that a wanted motion needs: the motor's law turned round, friction and dead zone included.

    f = w/K + w'/(K a) + sgn(K) (sgn(w) v + c w |w| + load)         at the winding
    u = (f - u0)/(1 + e sgn(f))                                      before offset and asymmetry
    u = u + sgn(u) d                                                 before the dead zone

`sgn(w)` is that of the wanted speed; where that is 0 no friction is added, so that a motor at rest does not chatter.
"""

import math

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from jaxmotor._precision import in_float64, to_numpy
from jaxmotor.control._sampled import effect_of, linear_of, parameter_of
from jaxmotor.motor import Motor

Scalar = Float[Array, ""]
COMPENSATED = {
    "coulomb_friction",
    "stiction",
    "quadratic_drag",
    "load_torque",
    "voltage_offset",
    "direction_asymmetry",
    "dead_zone",
}
"""Effects that feed-forward undoes."""


class FeedForward(eqx.Module):
    """Numbers of the law above. Friction, drag and load have the sign of K: the voltage that makes up for them."""

    gain: Scalar
    """K [rad/s/V]."""
    pole: Scalar
    """a [rad/s]."""
    friction_V: Scalar
    """v [V]; of a stiction the part that stays while turning."""
    drag_V_s2_rad2: Scalar
    """c [V s²/rad²]."""
    load_V: Scalar
    """Of a constant torque against positive motion [V]."""
    offset_V: Scalar
    """u0 [V]."""
    asymmetry: Scalar
    """e [1]."""
    dead_zone_V: Scalar
    """d [V]."""

    def volts(self, speed: Scalar, acceleration: Scalar) -> Scalar:
        """u [V] that holds `speed` [rad/s] while it changes by `acceleration` [rad/s²]."""
        linear = (speed + acceleration / self.pole) / self.gain
        return self.drive(linear + self.drag(speed), jnp.sign(speed))

    def drag(self, speed: Scalar) -> Scalar:
        """c w |w| [V]."""
        return self.drag_V_s2_rad2 * speed * jnp.abs(speed)

    def drive(self, linear: Scalar, way: Scalar) -> Scalar:
        """u [V] that does what `linear` [V] would in the linear motor while it turns `way`: 1, -1, or 0 for neither."""
        volts = linear + way * self.friction_V + self.load_V - self.offset_V
        volts = volts / (1 + self.asymmetry * jnp.sign(volts))
        return volts + jnp.sign(volts) * self.dead_zone_V


@in_float64
def feed_forward(motor: Motor) -> FeedForward:
    """What undoes `motor`."""
    linear = linear_of(motor)
    friction = parameter_of(motor, "coulomb_friction", "volts_V") + parameter_of(motor, "stiction", "volts_V")
    way = math.copysign(1.0, float(linear.gain))
    values = (
        float(linear.gain),
        float(linear.pole),
        way * friction,
        way * parameter_of(motor, "quadratic_drag", "volts_V_s2_rad2"),
        way * parameter_of(motor, "load_torque", "volts_V"),
        parameter_of(motor, "voltage_offset", "volts_V"),
        parameter_of(motor, "direction_asymmetry", "ratio"),
        parameter_of(motor, "dead_zone", "volts_V"),
    )
    return to_numpy(FeedForward(*(jnp.asarray(value) for value in values)))


def reachable_rad_s(motor: Motor, supply_V: float) -> float:
    """The speed [rad/s] that the whole supply holds in the slower direction.

    What friction, dead zone, load, offset, asymmetry and saturation take from the supply is taken off.
    """
    law = feed_forward(motor)
    supply = supply_V
    if effect_of(motor, "voltage_saturation") is not None:
        supply = min(supply, parameter_of(motor, "voltage_saturation", "volts_V"))
    left = (supply - float(law.dead_zone_V)) * (1 - abs(float(law.asymmetry)))
    left -= abs(float(law.friction_V)) + abs(float(law.load_V) - float(law.offset_V))
    if left <= 0:
        return 0.0
    drag, back = abs(float(law.drag_V_s2_rad2)), 1 / abs(float(law.gain))
    # c w² + w/K = left, written so that it holds for c = 0.
    return float(2 * left / (back + (back**2 + 4 * drag * left) ** 0.5))
