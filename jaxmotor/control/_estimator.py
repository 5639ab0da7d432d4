"""Speed, angle and missing torque from counts: a steady Kalman filter with the encoder's known error.

With x the motor's states, the angle θ and d, the volts that the model lacks (a load, more friction, a low supply),

    between ticks   x, θ move exactly under the voltages held, friction brakes by its full share or stops the shaft,
                    d wanders: its variance grows by q² per tick
    at a tick       θ is known to be within the latched count: variance 1/12 count²

The gain L is that of the steady state, P = A (P - L C P) Aᵀ + Q. Unlike the count difference, which is the mean
over the last tick, the estimate is of the speed at the tick: half a tick less delay.
"""

import math
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxmotor._arguments import check_positive
from jaxmotor._errors import JaxmotorError
from jaxmotor._precision import in_float64, to_jax, to_numpy
from jaxmotor.control._feed_forward import FeedForward, feed_forward
from jaxmotor.control._hardware import Hardware
from jaxmotor.control._sampled import late_holds
from jaxmotor.motor import Motor

DISTURBANCE = 0.02
"""Share of the supply by which the missing volts wander within the motor's time constant, by default."""
Scalar = Float[Array, ""]


class Estimator(eqx.Module):
    """z = (x, θ, d); z[k+1] = A z[k] + B0 u[k-1-late] + B1 u[k-late], then z + L (θ measured - θ)."""

    transition: Float[Array, "n n"]
    old_drive: Float[Array, " n"]
    new_drive: Float[Array, " n"]
    correction: Float[Array, " n"]
    """L: of speed [1/s], torque, angle [1] and missing volts [V] per rad."""
    standard_deviation: Float[Array, " n"]
    """Of z after a count, as far as the model is right and the missing volts wander as assumed."""
    per_volt: Float[Array, ""]
    """Speed that one volt of friction takes in a tick [rad/s/V]."""
    turn_per_speed: Float[Array, ""]
    """Angle that a torque takes in a tick, per speed that it takes [s]."""
    law: FeedForward
    late: int = eqx.field(static=True)
    """Whole ticks that the voltage is late."""

    def linear(self, volts: Scalar) -> Scalar:
        """What of `volts` drives the linear motor: dead zone, asymmetry, offset and load taken off."""
        driven = jnp.sign(volts) * jax.nn.relu(jnp.abs(volts) - self.law.dead_zone_V)
        return driven * (1 + self.law.asymmetry * jnp.sign(driven)) + self.law.offset_V - self.law.load_V

    def advance(self, z: Float[Array, " n"], old: Scalar, new: Scalar) -> Float[Array, " n"]:
        """The state one tick later; `old` and `new` are `linear` volts [V]."""
        drag = self.law.drag(z[0])
        moved = self.transition @ z + self.old_drive * (old - drag) + self.new_drive * (new - drag)
        # Friction as one implicit step: its full share, or the shaft stops. A stop takes the turn with it.
        budget = jnp.abs(self.per_volt * self.law.friction_V)
        speed = jnp.sign(moved[0]) * jax.nn.relu(jnp.abs(moved[0]) - budget)
        lost = moved[0] - speed
        angle_share = self.turn_per_speed * lost
        return moved.at[0].set(speed).at[-2].add(-angle_share)

    def correct(self, z: Float[Array, " n"], angle: Scalar) -> Float[Array, " n"]:
        """`z` with the measured `angle` [rad], the middle of the latched count."""
        return z + self.correction * (angle - z[-2])


class Motions(NamedTuple):
    """What an estimator made of counts, at each tick after its count was latched."""

    speed: np.ndarray
    """(n,) at the tick [rad/s]."""
    angle: np.ndarray
    """(n,) since the first count [rad]."""
    missing_V: np.ndarray
    """(n,) residual voltage: what the model needs beside the command [V]."""


@in_float64
def design_estimator(motor: Motor, hardware: Hardware, *, disturbance_V: float | None = None) -> Estimator:
    """The filter for `motor`; `disturbance_V` [V] is how far the missing volts wander within 1/a.

    Larger, it follows loads faster and shows more of the encoder's rounding. The default is 2 % of the supply.

    **Raises:** `JaxmotorError` where `disturbance_V` is not positive.
    """
    wander = DISTURBANCE * hardware.supply_V if disturbance_V is None else disturbance_V
    check_positive("disturbance_V", wander, "; 2 % of the supply is usual")
    late, old, new = late_holds(motor, hardware)
    order = len(new.drive)
    drives = [np.concatenate([hold.drive, [hold.turn_drive, 0.0]]) for hold in (old, new)]
    a = np.eye(order + 2)
    a[:order, :order], a[order, :order] = new.transition, new.turn
    whole = drives[0] + drives[1]
    a[:, -1] += whole
    per_tick = wander * math.sqrt(hardware.period_s * float(motor.linear.pole))
    noise = _process_noise(whole, per_tick, hardware)
    gain, covariance = _steady(a, noise, hardware.count_rad**2 / 12)
    return to_numpy(
        Estimator(
            transition=jnp.asarray(a),
            old_drive=jnp.asarray(drives[0]),
            new_drive=jnp.asarray(drives[1]),
            correction=jnp.asarray(gain),
            standard_deviation=jnp.asarray(np.sqrt(np.diag(covariance))),
            per_volt=jnp.asarray(whole[0]),
            turn_per_speed=jnp.asarray(whole[-2] / whole[0]),
            law=feed_forward(motor),
            late=late,
        )
    )


def _process_noise(drive: np.ndarray, per_tick_V: float, hardware: Hardware) -> np.ndarray:
    """The missing volts' step, and half of it felt in the tick itself; duties are rounded to a step, too."""
    step = 0.5 * drive.copy()
    step[-1] = 1.0
    return per_tick_V**2 * np.outer(step, step) + hardware.step_V**2 / 12 * np.outer(drive, drive)


def _steady(a: np.ndarray, noise: np.ndarray, variance: float) -> tuple[np.ndarray, np.ndarray]:
    """Gain and covariance after a measurement of the last angle, in the steady state."""
    from scipy.linalg import solve_discrete_are

    c = np.zeros((1, len(a)))
    c[0, -2] = 1.0
    covariance = solve_discrete_are(a.T, c.T, noise, np.array([[variance]]))
    gain = covariance[:, -2] / (covariance[-2, -2] + variance)
    return gain, covariance - np.outer(gain, covariance[-2])


@in_float64
def estimate_motion(estimator: Estimator, counts: np.ndarray, volts: np.ndarray, hardware: Hardware) -> Motions:
    """The motion behind `counts` (n,), at each of which `volts` (n,) [V] were set, from rest.

    **Raises:** `JaxmotorError` where the two differ in length.
    """
    if np.shape(counts) != np.shape(volts) or np.ndim(counts) != 1:
        raise JaxmotorError(f"{np.shape(counts)} counts and {np.shape(volts)} voltages: give one voltage per count")
    angle = (np.asarray(counts) - counts[0]) * hardware.count_rad
    states = _filter(to_jax(estimator), jnp.asarray(angle), jnp.asarray(np.asarray(volts, float)))
    states = np.asarray(states)
    return Motions(states[:, 0], states[:, -2], states[:, -1])


@eqx.filter_jit
def _filter(estimator: Estimator, angle: Float[Array, " n"], volts: Float[Array, " n"]) -> Float[Array, "n s"]:
    driven = jax.vmap(estimator.linear)(volts)
    rest = estimator.linear(jnp.zeros_like(volts[0]))
    late = estimator.late
    past = jnp.concatenate([jnp.full(late + 2, rest), driven])
    # At tick k the motor has just done tick k-1 under u[k-2-late] and u[k-1-late].
    old, new = past[: len(angle)], past[1 : len(angle) + 1]

    def tick(z, row):
        measured, old, new = row
        z = estimator.correct(estimator.advance(z, old, new), measured)
        return z, z

    start = jnp.zeros(estimator.correction.shape, angle.dtype)
    return jax.lax.scan(tick, start, (angle, old, new))[1]
