"""What a log would hold of a motor with effects."""

from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from jaxmotor.motor import Motor, Rows, Run, in_chunks, row_by, scan_rows, simulate_motor, some_rows, taken, warmth
from jaxmotor.motor.effects import SpeedWindow
from jaxmotor.prediction._log import Log
from jaxmotor.prediction._problem import Problem


def predicted_readings(
    motor: Motor, begins: Float[Array, "*motors k"], log: Log
) -> Float[Array, "row sequence *motors"]:
    """The readings [units] of `motor` whose pieces begin as `begins` say: first the speed of each [rad/s], then for a
    motor that has one the place of the load within its gap, from -1 to 1. Rows come first, as they are walked.

    Where what `motor` holds has an axis, there are as many motors.
    """
    problem, speeds, places = log.problem, *jnp.split(begins, [log.problem.pieces + 1], axis=-1)
    run = _simulated(motor, speeds, places if places.shape[-1] else None, log)
    if problem.kind == "turn":
        return run.sensed_turn / problem.unit
    windows = _stated(problem, speeds.ndim - 1) if problem.kind == "window" else None
    for effect in motor.effects:
        if isinstance(effect, SpeedWindow):
            windows = _sought(problem, speeds, effect.length_s)
    read = run.sensed_speed if windows is None else _mean_speed(run, problem, windows, log.used)
    return read / problem.unit


def residuals(motors: Motor, begins: Float[Array, "motors k"], log: Log) -> Float[Array, "row sequence motors"]:
    """Measured minus predicted [units] of each of a batch of motors; zero where nothing was measured."""
    batch = log.problem.batch
    return jnp.where(_by_row(batch.valid), _by_row(batch.observed) - predicted_readings(motors, begins, log), 0.0)


def _simulated(
    motor: Motor, speeds: Float[Array, "*motors k"], places: Float[Array, "*motors k"] | None, log: Log
) -> Run:
    """Of all sequences (row, sequence, ...): motors come last, whose numbers are then read as they lie."""
    batch, each = log.problem.batch, speeds.ndim - 1
    # Sequences do not hold experiments in their order; what is warm is followed through the whole recording instead.
    rise = jax.vmap(warmth, (0, None))(motor, log.measured_log) if each else warmth(motor, log.measured_log)

    def chosen(
        values: Float[Array, "*motors all"], place: Int[Array, "sequence row"]
    ) -> Float[Array, "row sequence *motors"]:
        return _motors_last(values[..., place.T], each)

    rows = Rows(
        _by_row(batch.volts, each),
        _by_row(batch.reset, each),
        _by_row(batch.free, each) * chosen(speeds, jnp.asarray(batch.piece)),
        _by_row(log.time, each),
        None if log.angle is None else _by_row(log.angle, each),
        None if rise is None else chosen(rise, log.row),
        None if places is None else chosen(places, jnp.asarray(batch.piece)),
    )
    duration = _by_row(batch.duration, each)
    return simulate_motor(motor, rows, duration, log.supply, log.steps, used=log.used, lengths=log.lengths)


def _by_row(values: Any, each: int = 1) -> Array:
    """`values` (sequence, row) as (row, sequence, 1), or (row, sequence) for one motor."""
    values = jnp.asarray(values).T
    return values[..., None] if each and values.ndim else values


def _motors_last(values: Float[Array, "*motors row sequence"], each: int) -> Float[Array, "row sequence *motors"]:
    return jnp.moveaxis(values, 0, -1) if each else values


class _Window(NamedTuple):
    """The time over which the speeds of some rows are means (row, sequence, ...)."""

    first: Int[Array, "row sequence *motors"]
    """The row in which it begins."""
    part: Float[Array, "row sequence *motors"]
    """Time from that row to its beginning [s]."""
    before: Float[Array, "row sequence *motors"] | float
    """Turned in it before the piece began, at the speed at which that begins [rad]."""
    length: Float[Array, "..."]
    """[s]"""


Windows = Callable[[Int[Array, ""], int], _Window]
"""Those of so many rows from one on."""


def _stated(problem: Problem, each: int) -> Windows:
    """Those that the log states."""
    batch = problem.batch
    back, part = (_by_row(values, each) for values in (batch.back, batch.part))
    length = problem.window * _by_row(batch.span, each)

    def at(begin: Int[Array, ""], chunk: int) -> _Window:
        number = begin + jnp.arange(chunk, dtype=jnp.int32).reshape(-1, *(1,) * (back.ndim - 1))
        own, part_ = (some_rows(values, begin, chunk) for values in (back, part))
        first = jnp.maximum(number - own.astype(jnp.int32), 0)
        return _Window(first, part_, 0.0, some_rows(length, begin, chunk))

    return at


def _sought(problem: Problem, speeds: Float[Array, "*motors k"], length: Float[Array, "*motors"]) -> Windows:
    """Those of any `length` [s], one for each motor."""
    batch, each = problem.batch, speeds.ndim - 1
    shape = (len(batch.volts), *speeds.shape[:-1])
    length = jnp.expand_dims(length, (0, 1)) * _by_row(batch.span, each)
    duration = jnp.broadcast_to(batch.duration, batch.volts.shape)
    time = _by_row(jnp.cumsum(duration, axis=1) - duration, each)
    number = jnp.arange(len(time), dtype=jnp.int32).reshape(-1, *(1,) * (each + 1))
    resets = _by_row(batch.reset, each)
    began_s, began = (jax.lax.cummax(jnp.where(resets, one, 0), axis=0) for one in (time, number))
    piece = jnp.asarray(batch.piece).T

    def at(begin: Int[Array, ""], chunk: int) -> _Window:
        own, now, start_s, start, long = (
            some_rows(one, begin, chunk) for one in (number, time, began_s, began, length)
        )
        past = now - start_s
        moment = jnp.broadcast_to(jnp.maximum(now - long, start_s), (chunk, *shape))
        # Where it is if rows are even; then row by row.
        part = (now - moment) / jnp.where(past > 0, past, 1.0)
        back = jnp.ceil(part * (own - start).astype(part.dtype) - 1e-9).astype(own.dtype)
        first = row_by(time, moment, start, own, own - back)
        speed = _motors_last(speeds[..., some_rows(piece, begin, chunk)], each)
        before = speed * jnp.maximum(long - past, 0.0)
        return _Window(first, jnp.maximum(moment - taken(time, first), 0.0), before, long)

    return at


def _mean_speed(
    run: Run, problem: Problem, windows: Windows, used: Int[Array, ""]
) -> Float[Array, "row sequence *motors"]:
    """Mean over the window before each of the `used` rows, or the speed at the row where a window has no length; within
    the row in which it begins the speed is a parabola.

    Some rows at a time: a log may fill a small part of the rows for which its program was compiled.
    """
    each = run.sensed_turn.ndim - 2
    angle = scan_rows(
        lambda total, turn: (total + turn, total), jnp.zeros_like(run.sensed_turn[0]), run.sensed_turn, used
    )[1]
    every = (angle, run.sensed_speed, run.sensed_turn)
    lengths = _by_row(problem.batch.duration, each)

    def some(at: Int[Array, ""], chunk: int) -> Float[Array, "chunk sequence *motors"]:
        window = windows(at, chunk)
        before, begin, turn = (taken(values, window.first) for values in every)
        end = taken(run.sensed_speed, jnp.minimum(window.first + 1, len(angle) - 1))
        length = taken(lengths, window.first) if lengths.ndim else lengths
        share, rise, mean = window.part / length, (end - begin) * length, turn - begin * length
        inside = window.part * begin + share**2 * (3 * mean - rise + share * (rise - 2 * mean))
        turned = some_rows(angle, at, chunk) - before - inside + window.before
        at_once = some_rows(run.sensed_speed, at, chunk)
        return jnp.where(window.length > 0, turned / jnp.where(window.length > 0, window.length, 1.0), at_once)

    return in_chunks(some, len(angle), used)
