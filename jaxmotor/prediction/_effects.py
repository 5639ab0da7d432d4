"""What a log would hold of a motor with effects."""

from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from jaxmotor.motor import Motor, Rows, Run, simulate_motor, warmth
from jaxmotor.prediction._log import Log
from jaxmotor.prediction._problem import Problem


def predicted_readings(motor: Motor, speeds: Float[Array, "*batch k"], log: Log) -> Float[Array, "row *batch lane"]:
    """The readings [units] of `motor` whose pieces begin at `speeds` [rad/s]. Rows come first, as they are walked.

    Where what `motor` holds has an axis, there are as many motors.
    """
    run, problem = _simulated(motor, speeds, log), log.problem
    if problem.kind == "turn":
        return run.seen_turn / problem.unit
    return (run.seen_speed if problem.kind == "speed" else _mean_speed(run, problem)) / problem.unit


def residuals(motors: Motor, speeds: Float[Array, "batch k"], log: Log) -> Float[Array, "row batch lane"]:
    """Measured minus predicted [units] of each of a batch of motors; zero where nothing was measured."""
    lanes = log.problem.lanes
    return jnp.where(_by_row(lanes.valid), _by_row(lanes.observed) - predicted_readings(motors, speeds, log), 0.0)


def _simulated(motor: Motor, speeds: Float[Array, "*batch k"], log: Log) -> Run:
    """Of all lanes (row, ..., lane)."""
    lanes, each = log.problem.lanes, speeds.ndim - 1
    # Lanes do not hold experiments in their order; what is warm is followed through the whole recording instead.
    rise = jax.vmap(warmth, (0, None))(motor, log.measured_log) if each else warmth(motor, log.measured_log)

    def chosen(values: Float[Array, "*batch all"], place: Int[Array, "lane row"]) -> Float[Array, "row *batch lane"]:
        return jnp.moveaxis(values[..., place.T], -2, 0)

    rows = Rows(
        _by_row(lanes.volts, each),
        _by_row(lanes.reset, each),
        _by_row(lanes.free, each) * chosen(speeds, jnp.asarray(lanes.piece)),
        _by_row(log.time, each),
        None if log.angle is None else _by_row(log.angle, each),
        None if rise is None else chosen(rise, log.row),
    )
    motor = jax.tree.map(lambda leaf: leaf[..., None], motor)
    duration = _by_row(lanes.duration, each)
    return simulate_motor(
        motor, rows, duration, log.supply, log.steps, used=log.used, lengths=log.lengths, late=log.late
    )


def _by_row(values: Any, each: int = 1) -> Array:
    """`values` (lane, row) as (row, 1, lane), or (row, lane) where not `each` of several motors is asked for."""
    values = jnp.asarray(values).T
    return values[:, None] if each and values.ndim else values


def _mean_speed(run: Run, problem: Problem) -> Float[Array, "row *batch lane"]:
    """Mean over the window before each row; within the row in which it begins the speed is a parabola."""
    lanes, each = problem.lanes, run.seen_turn.ndim - 2
    angle = jnp.cumsum(run.seen_turn, axis=0) - run.seen_turn
    back, part, duration = (_by_row(values, each) for values in (lanes.back, lanes.part, lanes.duration))
    first = jnp.arange(len(angle), dtype=jnp.int32).reshape(-1, *(1,) * (angle.ndim - 1)) - back.astype(jnp.int32)
    every = (angle, run.seen_speed, jnp.roll(run.seen_speed, -1, axis=0), run.seen_turn)
    lengths = jnp.broadcast_to(duration, back.shape)
    before, begin, end, turn, length = (jnp.take_along_axis(values, first, axis=0) for values in (*every, lengths))
    share, rise, mean = part / length, (end - begin) * length, turn - begin * length
    inside = part * begin + share**2 * (3 * mean - rise + share * (rise - 2 * mean))
    return (angle - before - inside) / problem.window
