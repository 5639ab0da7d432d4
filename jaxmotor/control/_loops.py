"""The designed loops as controllers of `simulate_motor`: counts, rounded duties, saturation, compensation.

They count for themselves, from a place within a count that can be drawn, so give `simulate_motor` no `count_rad`.
"""

from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from jaxmotor._precision import in_float64, to_jax, to_numpy
from jaxmotor.control._feed_forward import FeedForward, feed_forward
from jaxmotor.control._hardware import Hardware
from jaxmotor.control._position_design import PositionDesign
from jaxmotor.control._speed_design import SpeedDesign
from jaxmotor.motor import AbstractController, Motor

Scalar = Float[Array, ""]


class Counter(NamedTuple):
    """The encoder, and what the controller remembers."""

    exact: Scalar
    """Angle, from an edge of the encoder's [counts]."""
    latched: Scalar
    """Latched [counts]."""
    integral: Scalar
    """[V]"""


class Bridge(eqx.Module):
    """Counts and duties of a rig."""

    count_rad: Scalar
    begin_counts: Scalar
    """Where within a count the shaft begins, 0 to 1."""
    limit_V: Scalar
    step_V: Scalar

    def begin(self) -> Counter:
        return Counter(self.begin_counts, jnp.floor(self.begin_counts), jnp.zeros_like(self.begin_counts))

    def latch(self, before: Counter, turned: Scalar) -> tuple[Counter, Scalar]:
        """The counter after `turned` [rad], and the count difference."""
        exact = before.exact + turned / self.count_rad
        count = jnp.floor(exact)
        return Counter(exact, count, before.integral), count - before.latched

    def rounded(self, volts: Scalar) -> Scalar:
        """The nearest duty within full scale, in volts."""
        return jnp.clip(jnp.round(volts / self.step_V) * self.step_V, -self.limit_V, self.limit_V)


class CountedSpeedLoop(AbstractController):
    """u = k e + I [+ r/K], then friction and dead zone compensated; as the C header does it."""

    bridge: Bridge
    gain: Scalar
    """k [V s/rad]."""
    integral_gain: Scalar
    """Ki [V/rad]."""
    ahead: Scalar
    """Times r/K: 1 or 0."""
    law: FeedForward

    def begin(self) -> Counter:
        return self.bridge.begin()

    def volts(self, memory: Counter, reference: Scalar, turned: Scalar, duration: Scalar) -> tuple[Scalar, Counter]:
        now, counts = self.bridge.latch(memory, turned)
        error = reference - counts * self.bridge.count_rad / duration
        linear = self.ahead * reference / self.law.gain + self.gain * error + now.integral
        wanted = self.law.drive(linear + self.law.drag(reference), jnp.sign(reference))
        winds_up = (jnp.abs(wanted) > self.bridge.limit_V) & (wanted * error > 0)
        integral = now.integral + jnp.where(winds_up, 0.0, self.integral_gain * duration * error)
        limit = self.bridge.limit_V
        return self.bridge.rounded(wanted), now._replace(integral=jnp.clip(integral, -limit, limit))


class CountedPositionLoop(AbstractController):
    """u = kp (r - θ) - kv v, then the dead zone compensated, and friction while the error is larger than a count."""

    bridge: Bridge
    gain: Scalar
    """kp [V/rad]."""
    speed_gain: Scalar
    """kv [V s/rad]."""
    law: FeedForward

    def begin(self) -> Counter:
        return self.bridge.begin()

    def volts(self, memory: Counter, reference: Scalar, turned: Scalar, duration: Scalar) -> tuple[Scalar, Counter]:
        now, counts = self.bridge.latch(memory, turned)
        error = reference - (now.latched - jnp.floor(self.bridge.begin_counts)) * self.bridge.count_rad
        linear = self.gain * error - self.speed_gain * counts * self.bridge.count_rad / duration
        way = jnp.where(jnp.abs(error) > self.bridge.count_rad, jnp.sign(error), 0.0)
        wanted = self.law.drive(linear, way)
        wanted = jnp.where((way == 0) & (counts == 0), 0.0, wanted)
        return self.bridge.rounded(wanted), now


@in_float64
def speed_controller(motor: Motor, design: SpeedDesign, hardware: Hardware) -> CountedSpeedLoop:
    """`design` with what `motor` needs compensated, for `simulate_motor`."""
    return to_numpy(
        CountedSpeedLoop(
            bridge=to_jax(bridge_of(hardware)),
            gain=jnp.asarray(design.gain_V_s_rad),
            integral_gain=jnp.asarray(design.integral_gain_V_rad),
            ahead=jnp.asarray(float(design.feeds_forward)),
            law=feed_forward(motor),
        )
    )


@in_float64
def position_controller(motor: Motor, design: PositionDesign, hardware: Hardware) -> CountedPositionLoop:
    """`design` with what `motor` needs compensated, for `simulate_motor`."""
    return to_numpy(
        CountedPositionLoop(
            bridge=to_jax(bridge_of(hardware)),
            gain=jnp.asarray(design.gain_V_rad),
            speed_gain=jnp.asarray(design.speed_gain_V_s_rad),
            law=feed_forward(motor),
        )
    )


@in_float64
def bridge_of(hardware: Hardware) -> Bridge:
    """Counts and duties of `hardware`, the shaft in the middle of a count."""
    values = (hardware.count_rad, 0.5, hardware.supply_V, hardware.step_V)
    return to_numpy(Bridge(*(jnp.asarray(value) for value in values)))
