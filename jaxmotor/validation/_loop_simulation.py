"""A motor, an encoder and a speed controller in a loop, tick by tick; exact between the ticks."""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Key

from jaxmotor.motor import AbstractLinearMotor
from jaxmotor.prediction import motor_of
from jaxmotor.validation._controller import Law, command
from jaxmotor.validation._draws import draw_psi


class Sensor(NamedTuple):
    """How the controller sees the speed."""

    unit: Float[Array, ""]
    """One count [rad]."""
    counts: Bool[Array, ""]
    """The angle is counted, floor(θ/unit + c); otherwise it is known as it is."""
    instantaneous: Bool[Array, ""]
    """The speed at the tick is seen, not the mean over the tick before."""


class Run(NamedTuple):
    """One simulated run."""

    speed: Float[Array, "*draw n"]
    """As the controller saw it at each tick [rad/s]."""
    volts: Float[Array, "*draw n"]
    """Applied from each tick on [V]."""


class Begin(NamedTuple):
    """How a run begins."""

    speed: Float[Array, ""]
    """[rad/s]"""
    offset: Float[Array, ""]
    """Of the encoder, c [counts]."""


def simulate_loop(
    motor: AbstractLinearMotor,
    offset_V: Float[Array, ""],
    law: Law,
    sensor: Sensor,
    begin: Begin,
    period: Float[Array, ""],
    ticks: Float[Array, " n"],
) -> Run:
    """The loop closed over `ticks` periods [s] from `begin`; the rig adds `offset_V` [V] to every voltage.

    At each tick the count is latched, then the voltage set, as format 1 has it.
    """
    hold = motor.hold(period)

    def latch(angle: Float[Array, ""]) -> Float[Array, ""]:
        return jnp.where(sensor.counts, jnp.floor(angle), angle)

    def tick(carry, _):
        state, angle, before, integral = carry
        count = latch(angle)
        speed = (count - before) * sensor.unit / period
        speed = jnp.where(sensor.instantaneous & ~sensor.counts, state[0], speed)
        volts, integral = command(law, integral, speed)
        driven = volts + offset_V
        turn = hold.turn @ state + hold.turn_drive * driven
        state = hold.transition @ state + hold.drive * driven
        return (state, angle + turn / sensor.unit, count, integral), (speed, volts)

    state = jnp.zeros((motor.order,), begin.speed.dtype).at[0].set(begin.speed)
    earlier = latch(begin.offset - begin.speed * period / sensor.unit)
    carry = (state, begin.offset, earlier, jnp.zeros_like(begin.speed))
    return Run(*jax.lax.scan(tick, carry, ticks)[1])


@eqx.filter_jit
def simulate_loops(
    psi: Float[Array, " p"],
    root: Float[Array, "m m"],
    number: int,
    law: Law,
    sensor: Sensor,
    speed: Float[Array, ""],
    period: Float[Array, ""],
    ticks: Float[Array, " n"],
    key: Key[Array, ""],
) -> Run:
    """`number` runs from `speed` [rad/s] of motors around ψ (`root` is that of the covariance) with random encoders.

    The first is the ideal one: ψ itself, neither counts nor duties, only the limit.
    """
    motors, encoder = jax.random.split(key)
    offset = jax.random.uniform(encoder, (number,), psi.dtype)
    ideal = jnp.arange(number) == 0

    def run(psi, offset, ideal):
        exact = law._replace(step=jnp.where(ideal, 0.0, law.step))
        smooth = sensor._replace(counts=sensor.counts & ~ideal)
        return simulate_loop(motor_of(psi), psi[1] / psi[0], exact, smooth, Begin(speed, offset), period, ticks)

    return jax.vmap(run)(draw_psi(psi, root, number, motors), offset, ideal)
