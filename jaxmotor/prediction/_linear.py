"""What a log would hold of a linear motor, exactly.

ψ = (K, b, log a [, log τ]): gain [rad/s/V], speed of a constant voltage error [rad/s], pole [rad/s], electrical time
constant [s]. Where the log's timing is not known (`Problem.row`) its end is the offset: by how much a row was read
after its voltage changed, in rows. Readings that are late see the voltages early.
"""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from jaxmotor.motor import (
    AbstractLinearMotor,
    FirstOrder,
    Motion,
    SecondOrder,
    driven,
    hold_switched,
    simulate,
    switched,
)
from jaxmotor.prediction._problem import Problem

LAG_S = (60e-6, 40e-6)
"""Mean and spread of L/R of hobby motors, with the bridge's own delay: a timing offset looks nearly like it."""


def motor_of(psi: Float[Array, " p"], problem: Problem | None = None) -> AbstractLinearMotor:
    """The motor at ψ; beside a timing offset one of first order has the usual electrical time constant, too."""
    gain, pole, timed = psi[0], jnp.exp(psi[2]), problem is not None and problem.row is not None
    if len(psi) - timed == 4:
        return SecondOrder(gain, pole, jnp.exp(psi[3]))
    return SecondOrder(gain, pole, jnp.full_like(pole, LAG_S[0])) if timed else FirstOrder(gain, pole)


def late_of(psi: Float[Array, " p"], problem: Problem) -> Float[Array, ""] | None:
    """How late voltages act for the readings at ψ [s]; None where a row is read as its voltage changes."""
    return None if problem.row is None else -psi[-1] * problem.row


def observe(
    motor: AbstractLinearMotor,
    problem: Problem,
    volts: Float[Array, "lane row"],
    initial_speed: Float[Array, "lane row"],
    late: Float[Array, ""] | None = None,
) -> Float[Array, "lane row"]:
    """What the log would hold [units] of a motor under `volts`, which act `late` [s], from `initial_speed`."""
    lanes = problem.lanes
    duration, reset = jnp.asarray(lanes.duration), jnp.asarray(lanes.reset)

    def lane(volts, reset, initial_speed, duration) -> Motion:
        return simulate(motor, volts, reset, initial_speed, duration, late)

    per_lane = (0, 0, 0, None if duration.ndim == 0 else 0)
    motion = jax.vmap(lane, per_lane)(volts, reset, initial_speed, duration)
    if problem.kind == "turn":
        return motion.turn / problem.unit
    if problem.kind == "speed":
        return motion.state[..., 0] / problem.unit
    return _mean_speed(motor, problem, motion, volts, late) / problem.unit


def _mean_speed(
    motor: AbstractLinearMotor,
    problem: Problem,
    motion: Motion,
    volts: Float[Array, "lane row"],
    late: Float[Array, ""] | None,
) -> Float[Array, "lane row"]:
    """Over the window before each row [rad/s]."""
    lanes, duration = problem.lanes, jnp.asarray(problem.lanes.duration)
    angle = jnp.cumsum(motion.turn, axis=1) - motion.turn
    back, part = jnp.asarray(lanes.back), jnp.asarray(lanes.part)
    first = jnp.arange(angle.shape[1], dtype=back.dtype)[None, :] - back

    def at_first(values: Float[Array, "lane row"]) -> Float[Array, "lane row"]:
        return jnp.take_along_axis(values, first, axis=1)

    state = jnp.take_along_axis(motion.state, first[..., None], axis=1)
    if late is None:
        drives, holds = (at_first(volts),), (jax.vmap(jax.vmap(motor.hold))(part),)
    else:
        axes = (0, 0, None if duration.ndim == 0 else 0, None)
        rows = jax.vmap(switched, axes)(volts, jnp.asarray(lanes.reset), duration, late)
        drives = at_first(rows.first), at_first(rows.second)
        until = jnp.minimum(at_first(rows.part), part)
        holds = jax.vmap(jax.vmap(lambda until, part: hold_switched(motor, until, part)))(until, part)
    _, inside = jax.vmap(jax.vmap(driven))(holds, state, drives)
    return (angle - at_first(angle) - inside) / problem.window


def predict(psi: Float[Array, " p"], initial_speed: Float[Array, " k"], problem: Problem) -> Float[Array, "lane row"]:
    """What the log would hold [units] at ψ."""
    lanes = problem.lanes
    start = jnp.asarray(lanes.free) * initial_speed[lanes.piece]
    unit_gain = motor_of(psi.at[0].set(1.0), problem)
    return observe(unit_gain, problem, psi[0] * jnp.asarray(lanes.volts) + psi[1], start, late_of(psi, problem))


def start_columns(psi: Float[Array, " p"], problem: Problem) -> Float[Array, "lane row c"]:
    """What one rad/s of initial speed adds to the piece it belongs to [units]; no column where all start at rest."""
    free = jnp.asarray(problem.lanes.free)
    if not problem.free:
        return jnp.zeros((*free.shape, 0), free.dtype)
    return observe(motor_of(psi, problem), problem, jnp.zeros_like(free), free)[..., None]
