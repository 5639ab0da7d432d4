"""The designed loops as controllers of `simulate_motor`: rounded duties, saturation, compensation.

They expect readings in whole counts, as `simulate_motor` gives them with the rig's `count_rad`.
"""

import jax.numpy as jnp
from jaxtyping import Array, Float

from jaxmotor._precision import in_float64, to_numpy
from jaxmotor.control._feed_forward import FeedForward, feed_forward
from jaxmotor.control._hardware import Hardware
from jaxmotor.control._position_design import PositionDesign
from jaxmotor.control._speed_design import SpeedDesign
from jaxmotor.motor import AbstractController, Motor, SpeedLaw, command, quantised

Scalar = Float[Array, ""]


class CountedSpeedLoop(AbstractController):
    """u = k e + I [+ r/K], then friction and dead zone compensated; as the C header does it."""

    law: SpeedLaw
    ahead: Scalar
    """Times r/K: 1 or 0."""
    compensation: FeedForward

    def begin(self) -> Scalar:
        return jnp.zeros_like(self.law.gain)

    def volts(self, memory: Scalar, reference: Scalar, turned: Scalar, duration: Scalar) -> tuple[Scalar, Scalar]:
        motor = self.compensation

        def compensated(volts: Scalar) -> Scalar:
            linear = self.ahead * reference / motor.gain + volts
            return motor.drive(linear + motor.drag(reference), jnp.sign(reference))

        return command(self.law, reference - turned / duration, memory, duration, compensated)


class CountedPositionLoop(AbstractController):
    """u = kp (r - θ) - kv v, then the dead zone compensated, and friction while the error is larger than a count."""

    count_rad: Scalar
    limit_V: Scalar
    step_V: Scalar
    gain: Scalar
    """kp [V/rad]."""
    speed_gain: Scalar
    """kv [V s/rad]."""
    compensation: FeedForward

    def begin(self) -> Scalar:
        """Counted so far."""
        return jnp.zeros_like(self.gain)

    def volts(self, memory: Scalar, reference: Scalar, turned: Scalar, duration: Scalar) -> tuple[Scalar, Scalar]:
        counts = jnp.round(turned / self.count_rad)
        position = memory + counts
        error = reference - position * self.count_rad
        linear = self.gain * error - self.speed_gain * counts * self.count_rad / duration
        way = jnp.where(jnp.abs(error) > self.count_rad, jnp.sign(error), 0.0)
        wanted = jnp.where((way == 0) & (counts == 0), 0.0, self.compensation.drive(linear, way))
        return quantised(wanted, self.step_V, self.limit_V), position


@in_float64
def speed_controller(motor: Motor, design: SpeedDesign, hardware: Hardware) -> CountedSpeedLoop:
    """`design` with what `motor` needs compensated, for `simulate_motor`."""
    law = SpeedLaw.of(design.gain_V_s_rad, design.integral_gain_V_rad, hardware.supply_V, hardware.step_V)
    return to_numpy(CountedSpeedLoop(law, jnp.asarray(float(design.feeds_forward)), feed_forward(motor)))


@in_float64
def position_controller(motor: Motor, design: PositionDesign, hardware: Hardware) -> CountedPositionLoop:
    """`design` with what `motor` needs compensated, for `simulate_motor`."""
    return to_numpy(
        CountedPositionLoop(
            count_rad=jnp.asarray(hardware.count_rad),
            limit_V=jnp.asarray(hardware.supply_V),
            step_V=jnp.asarray(hardware.step_V),
            gain=jnp.asarray(design.gain_V_rad),
            speed_gain=jnp.asarray(design.speed_gain_V_s_rad),
            compensation=feed_forward(motor),
        )
    )
