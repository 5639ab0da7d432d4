"""What a log would hold of a motor with effects."""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from jaxmotor.motor import Motor, Rows, Run, simulate_motor, warmth
from jaxmotor.prediction._log import Log
from jaxmotor.prediction._problem import Problem


def seen(motor: Motor, speeds: Float[Array, " k"], log: Log) -> Float[Array, "row lane"]:
    """The readings [units] of `motor` whose pieces begin at `speeds` [rad/s]. Rows come first, as they are walked."""
    run, problem = _simulated(motor, speeds, log), log.problem
    if problem.kind == "turn":
        return run.seen_turn / problem.unit
    return (run.seen_speed if problem.kind == "speed" else _mean_speed(run, problem)) / problem.unit


def residuals(motors: Motor, speeds: Float[Array, "batch k"], log: Log) -> Float[Array, "row batch lane"]:
    """Measured minus predicted [units] of each of a batch of motors; zero where nothing was measured."""
    observed = jnp.asarray(log.problem.lanes.observed).T

    def one(motor: Motor, speeds: Float[Array, " k"]) -> Float[Array, "row lane"]:
        return jnp.where(log.problem.lanes.valid.T, observed - seen(motor, speeds, log), 0.0)

    return jax.vmap(one, out_axes=1)(motors, speeds)


def _simulated(motor: Motor, speeds: Float[Array, " k"], log: Log) -> Run:
    """Of all lanes (row, lane)."""
    lanes, duration = log.problem.lanes, jnp.asarray(log.problem.lanes.duration)
    # Lanes do not hold experiments in their order; what is warm is followed through the whole recording instead.
    rise = warmth(motor, log.heard)
    rows = Rows(
        jnp.asarray(lanes.volts),
        jnp.asarray(lanes.reset),
        jnp.asarray(lanes.free) * speeds[lanes.piece],
        log.time,
        log.angle,
        None if rise is None else rise[log.row],
    )

    def lane(rows: Rows, duration: Float[Array, "*n"]) -> Run:
        return simulate_motor(motor, rows, duration, log.supply, log.steps, used=log.used, lengths=log.lengths)

    return jax.vmap(lane, (0, None if duration.ndim == 0 else 0), 1)(rows, duration)


def _mean_speed(run: Run, problem: Problem) -> Float[Array, "row lane"]:
    """Mean over the window before each row; within the row in which it begins the speed is a straight line."""
    lanes = problem.lanes
    angle = jnp.cumsum(run.seen_turn, axis=0) - run.seen_turn
    first = jnp.arange(angle.shape[0], dtype=jnp.int32)[:, None] - jnp.asarray(lanes.back, jnp.int32).T
    duration = jnp.broadcast_to(jnp.asarray(lanes.duration).T, angle.shape)
    every = (angle, run.seen_speed, run.seen_turn, duration)
    before, begin, turn, length = (jnp.take_along_axis(values, first, axis=0) for values in every)
    part = jnp.asarray(lanes.part).T
    inside = part * begin + (part / length) ** 2 * (turn - begin * length)
    return (angle - before - inside) / problem.window
