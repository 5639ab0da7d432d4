"""What a log would hold of a motor with effects."""

from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from jaxmotor.motor import Motor, Rows, Run, simulate_motor, warmth
from jaxmotor.motor.effects import SpeedWindow
from jaxmotor.prediction._log import Log
from jaxmotor.prediction._problem import Problem


def predicted_readings(
    motor: Motor, speeds: Float[Array, "*motors k"], log: Log
) -> Float[Array, "row *motors sequence"]:
    """The readings [units] of `motor` whose pieces begin at `speeds` [rad/s]. Rows come first, as they are walked.

    Where what `motor` holds has an axis, there are as many motors.
    """
    run, problem = _simulated(motor, speeds, log), log.problem
    if problem.kind == "turn":
        return run.sensed_turn / problem.unit
    window = _stated(problem, run) if problem.kind == "window" else None
    for effect in motor.effects:
        if isinstance(effect, SpeedWindow):
            window = _sought(problem, speeds, effect.length_s)
    return (run.sensed_speed if window is None else _mean_speed(run, problem, window)) / problem.unit


def residuals(motors: Motor, speeds: Float[Array, "motors k"], log: Log) -> Float[Array, "row motors sequence"]:
    """Measured minus predicted [units] of each of a batch of motors; zero where nothing was measured."""
    batch = log.problem.batch
    return jnp.where(_by_row(batch.valid), _by_row(batch.observed) - predicted_readings(motors, speeds, log), 0.0)


def _simulated(motor: Motor, speeds: Float[Array, "*motors k"], log: Log) -> Run:
    """Of all sequences (row, ..., sequence)."""
    batch, each = log.problem.batch, speeds.ndim - 1
    # Lanes do not hold experiments in their order; what is warm is followed through the whole recording instead.
    rise = jax.vmap(warmth, (0, None))(motor, log.measured_log) if each else warmth(motor, log.measured_log)

    def chosen(
        values: Float[Array, "*motors all"], place: Int[Array, "sequence row"]
    ) -> Float[Array, "row *motors sequence"]:
        return jnp.moveaxis(values[..., place.T], -2, 0)

    rows = Rows(
        _by_row(batch.volts, each),
        _by_row(batch.reset, each),
        _by_row(batch.free, each) * chosen(speeds, jnp.asarray(batch.piece)),
        _by_row(log.time, each),
        None if log.angle is None else _by_row(log.angle, each),
        None if rise is None else chosen(rise, log.row),
    )
    motor = jax.tree.map(lambda leaf: leaf[..., None], motor)
    duration = _by_row(batch.duration, each)
    return simulate_motor(
        motor, rows, duration, log.supply, log.steps, used=log.used, lengths=log.lengths, late=log.late
    )


def _by_row(values: Any, each: int = 1) -> Array:
    """`values` (sequence, row) as (row, 1, sequence), or (row, sequence) for one motor."""
    values = jnp.asarray(values).T
    return values[:, None] if each and values.ndim else values


class _Window(NamedTuple):
    """The time over which each row's speed is a mean (row, ..., sequence)."""

    first: Int[Array, "row *motors sequence"]
    """The row in which it begins."""
    part: Float[Array, "row *motors sequence"]
    """Time from that row to its beginning [s]."""
    before: Float[Array, "row *motors sequence"] | float
    """Turned in it before the piece began, at the speed at which that begins [rad]."""
    length: Float[Array, "..."]
    """[s]"""


def _stated(problem: Problem, run: Run) -> _Window:
    """That which the log states."""
    batch, each = problem.batch, run.sensed_turn.ndim - 2
    back, part = (_by_row(values, each) for values in (batch.back, batch.part))
    number = jnp.arange(len(back), dtype=jnp.int32).reshape(-1, *(1,) * (back.ndim - 1))
    return _Window(number - back.astype(jnp.int32), part, 0.0, problem.window * _by_row(batch.span, each))


def _sought(problem: Problem, speeds: Float[Array, "*motors k"], length: Float[Array, "*motors"]) -> _Window:
    """Windows of any `length` [s], one for each motor."""
    batch, each = problem.batch, speeds.ndim - 1
    shape = (batch.volts.shape[1], *speeds.shape[:-1], len(batch.volts))
    length = jnp.expand_dims(length, (0, -1)) * _by_row(batch.span, each)
    duration = jnp.broadcast_to(_by_row(batch.duration, each), (shape[0], *(1,) * each, shape[-1]))
    time = jnp.cumsum(duration, axis=0) - duration
    reset = _by_row(batch.reset, each)
    began = jax.lax.cummax(jnp.where(reset, time, 0.0), axis=0)
    begin = jnp.maximum(time - length, began)
    flat = jnp.broadcast_to(time, shape).reshape(shape[0], -1), begin.reshape(shape[0], -1)
    first = jax.vmap(lambda time, begin: jnp.searchsorted(time, begin, side="right"), 1, 1)(*flat) - 1
    first = first.reshape(shape).astype(jnp.int32)
    part = jnp.maximum(begin - jnp.take_along_axis(time, first, axis=0), 0.0)
    speed = jnp.moveaxis(speeds[..., jnp.asarray(batch.piece).T], -2, 0)
    return _Window(first, part, speed * jnp.maximum(length - (time - began), 0.0), length)


def _mean_speed(run: Run, problem: Problem, window: _Window) -> Float[Array, "row *motors sequence"]:
    """Mean over the window before each row; within the row in which it begins the speed is a parabola."""
    each = run.sensed_turn.ndim - 2
    angle = jnp.cumsum(run.sensed_turn, axis=0) - run.sensed_turn
    lengths = jnp.broadcast_to(_by_row(problem.batch.duration, each), (len(angle), *(1,) * each, angle.shape[-1]))
    every = (angle, run.sensed_speed, jnp.roll(run.sensed_speed, -1, axis=0), run.sensed_turn, lengths)
    before, begin, end, turn, length = (jnp.take_along_axis(values, window.first, axis=0) for values in every)
    share, rise, mean = window.part / length, (end - begin) * length, turn - begin * length
    inside = window.part * begin + share**2 * (3 * mean - rise + share * (rise - 2 * mean))
    return (angle - before - inside + window.before) / window.length
