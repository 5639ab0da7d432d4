"""What a log would hold of a linear motor, exactly."""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from jaxmotor.motor import AbstractLinearMotor, FirstOrder, SecondOrder, simulate
from jaxmotor.prediction._problem import Problem


def motor_of(psi: Float[Array, " p"]) -> AbstractLinearMotor:
    """The motor at ψ."""
    gain, pole = psi[0], jnp.exp(psi[2])
    return FirstOrder(gain, pole) if len(psi) == 3 else SecondOrder(gain, pole, jnp.exp(psi[3]))


def observe(
    motor: AbstractLinearMotor,
    problem: Problem,
    volts: Float[Array, "lane row"],
    initial_speed: Float[Array, "lane row"],
) -> Float[Array, "lane row"]:
    """What the recording would show [units] of a motor under `volts` that starts its pieces at `initial_speed`."""
    lanes = problem.lanes
    duration = jnp.asarray(lanes.duration)
    per_lane = (0, 0, 0, None if duration.ndim == 0 else 0)
    motion = jax.vmap(lambda *row: simulate(motor, *row), per_lane)(
        volts, jnp.asarray(lanes.reset), initial_speed, duration
    )
    if problem.kind == "turn":
        return motion.turn / problem.unit
    if problem.kind == "speed":
        return motion.state[..., 0] / problem.unit
    angle = jnp.cumsum(motion.turn, axis=1) - motion.turn
    back = jnp.asarray(lanes.back)
    first = jnp.arange(angle.shape[1], dtype=back.dtype)[None, :] - back
    state = jnp.take_along_axis(motion.state, first[..., None], axis=1)
    part = jax.vmap(jax.vmap(motor.hold))(jnp.asarray(lanes.part))
    inside = (part.turn * state).sum(-1) + part.turn_drive * jnp.take_along_axis(volts, first, axis=1)
    return (angle - jnp.take_along_axis(angle, first, axis=1) - inside) / (problem.window * problem.unit)


def predict(psi: Float[Array, " p"], initial_speed: Float[Array, " k"], problem: Problem) -> Float[Array, "lane row"]:
    """What the recording would show [units] at ψ."""
    lanes = problem.lanes
    start = jnp.asarray(lanes.free) * initial_speed[lanes.piece]
    unit_gain = motor_of(psi.at[0].set(1.0))
    return observe(unit_gain, problem, psi[0] * jnp.asarray(lanes.volts) + psi[1], start)


def start_columns(psi: Float[Array, " p"], problem: Problem) -> Float[Array, "lane row c"]:
    """What one rad/s of initial speed adds to the piece it belongs to [units]; no column where all start at rest."""
    free = jnp.asarray(problem.lanes.free)
    if not problem.free:
        return jnp.zeros((*free.shape, 0), free.dtype)
    return observe(motor_of(psi), problem, jnp.zeros_like(free), free)[..., None]
