"""What a log would hold of a motor with effects."""

from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from jaxmotor.motor import Motor, Rows, Run, scan_rows, simulate_motor, taken, warmth
from jaxmotor.motor.effects import SpeedWindow
from jaxmotor.prediction._log import Log
from jaxmotor.prediction._problem import Problem

CHUNK = 128
"""Rows whose windows are computed side by side."""


def predicted_readings(
    motor: Motor, begins: Float[Array, "*motors k"], log: Log
) -> Float[Array, "row *motors sequence"]:
    """The readings [units] of `motor` whose pieces begin as `begins` say: first the speed of each [rad/s], then for a
    motor that has one the place of the load within its gap, from -1 to 1. Rows come first, as they are walked.

    Where what `motor` holds has an axis, there are as many motors.
    """
    problem, speeds, places = log.problem, *jnp.split(begins, [log.problem.pieces + 1], axis=-1)
    run = _simulated(motor, speeds, places if places.shape[-1] else None, log)
    if problem.kind == "turn":
        return run.sensed_turn / problem.unit
    chunk = min(CHUNK, len(run.turn))
    windows = _stated(problem, speeds.ndim - 1, chunk) if problem.kind == "window" else None
    for effect in motor.effects:
        if isinstance(effect, SpeedWindow):
            windows = _sought(problem, speeds, effect.length_s, chunk)
    read = run.sensed_speed if windows is None else _mean_speed(run, problem, windows, chunk, log.used)
    return read / problem.unit


def residuals(motors: Motor, begins: Float[Array, "motors k"], log: Log) -> Float[Array, "row motors sequence"]:
    """Measured minus predicted [units] of each of a batch of motors; zero where nothing was measured."""
    batch = log.problem.batch
    return jnp.where(_by_row(batch.valid), _by_row(batch.observed) - predicted_readings(motors, begins, log), 0.0)


def _simulated(
    motor: Motor, speeds: Float[Array, "*motors k"], places: Float[Array, "*motors k"] | None, log: Log
) -> Run:
    """Of all sequences (row, ..., sequence)."""
    batch, each = log.problem.batch, speeds.ndim - 1
    # Sequences do not hold experiments in their order; what is warm is followed through the whole recording instead.
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
        None if places is None else chosen(places, jnp.asarray(batch.piece)),
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
    """The time over which the speeds of some rows are means (row, ..., sequence)."""

    first: Int[Array, "row *motors sequence"]
    """The row in which it begins."""
    part: Float[Array, "row *motors sequence"]
    """Time from that row to its beginning [s]."""
    before: Float[Array, "row *motors sequence"] | float
    """Turned in it before the piece began, at the speed at which that begins [rad]."""
    length: Float[Array, "..."]
    """[s]"""


Windows = Callable[[Int[Array, ""]], _Window]
"""Those of `CHUNK` rows from one on."""


def _stated(problem: Problem, each: int, chunk: int) -> Windows:
    """Those that the log states."""
    batch = problem.batch
    back, part = (_by_row(values, each) for values in (batch.back, batch.part))
    length = problem.window * _by_row(batch.span, each)

    def at(begin: Int[Array, ""]) -> _Window:
        number = begin + jnp.arange(chunk, dtype=jnp.int32).reshape(-1, *(1,) * (back.ndim - 1))
        own, part_ = (_rows(values, begin, chunk) for values in (back, part))
        first = jnp.maximum(number - own.astype(jnp.int32), 0)
        return _Window(first, part_, 0.0, _rows(length, begin, chunk))

    return at


def _sought(
    problem: Problem, speeds: Float[Array, "*motors k"], length: Float[Array, "*motors"], chunk: int
) -> Windows:
    """Those of any `length` [s], one for each motor."""
    batch, each = problem.batch, speeds.ndim - 1
    shape = (*speeds.shape[:-1], len(batch.volts))
    length = jnp.expand_dims(length, (0, -1)) * _by_row(batch.span, each)
    duration = jnp.broadcast_to(batch.duration, batch.volts.shape)
    time = _by_row(jnp.cumsum(duration, axis=1) - duration, each)
    number = jnp.arange(len(time), dtype=jnp.int32).reshape(-1, *(1,) * (each + 1))
    resets = _by_row(batch.reset, each)
    began_s, began = (jax.lax.cummax(jnp.where(resets, one, 0), axis=0) for one in (time, number))
    piece = jnp.asarray(batch.piece).T

    def at(begin: Int[Array, ""]) -> _Window:
        own, now, start_s, start, long = (_rows(one, begin, chunk) for one in (number, time, began_s, began, length))
        past = now - start_s
        moment = jnp.broadcast_to(jnp.maximum(now - long, start_s), (chunk, *shape))
        # Where it is if rows are even; then row by row.
        part = (now - moment) / jnp.where(past > 0, past, 1.0)
        back = jnp.ceil(part * (own - start).astype(part.dtype) - 1e-9).astype(own.dtype)
        first = _row_in(time, moment, start, own, jnp.clip(own - back, start, own))
        speed = jnp.moveaxis(speeds[..., _rows(piece, begin, chunk)], -2, 0)
        before = speed * jnp.maximum(long - past, 0.0)
        return _Window(first, jnp.maximum(moment - taken(time, first), 0.0), before, long)

    return at


def _row_in(
    time: Float[Array, "row ..."],
    moment: Float[Array, "chunk *motors sequence"],
    first: Int[Array, "chunk ..."],
    last: Int[Array, "chunk ..."],
    near: Int[Array, "chunk *motors sequence"],
) -> Int[Array, "chunk *motors sequence"]:
    """The last row from `first` to `last` that begins by a `moment`, `near` to the given one."""

    def is_late(row: Int[Array, "chunk *motors sequence"]) -> Bool[Array, "chunk *motors sequence"]:
        return (row > first) & (taken(time, row) > moment)

    def is_early(row: Int[Array, "chunk *motors sequence"]) -> Bool[Array, "chunk *motors sequence"]:
        return (row < last) & (taken(time, jnp.minimum(row + 1, last)) <= moment)

    return _walked(is_early, 1, _walked(is_late, -1, near))


def _walked(
    goes_on: Callable[[Int[Array, "chunk *motors sequence"]], Bool[Array, "chunk *motors sequence"]],
    way: int,
    row: Int[Array, "chunk *motors sequence"],
) -> Int[Array, "chunk *motors sequence"]:
    """`row`, or as many rows on as it `goes_on`."""

    def on(state: tuple[Array, Array]) -> tuple[Array, Array]:
        row = state[0] + jnp.where(state[1], way, 0)
        return row, goes_on(row)

    return jax.lax.while_loop(lambda state: state[1].any(), on, (row, goes_on(row)))[0]


def _rows(values: Array, begin: Int[Array, ""], chunk: int) -> Array:
    """`chunk` rows of `values` (row, ...) from row `begin` on; `values` where they have no rows, or are one for all."""
    if values.ndim == 0 or values.shape[0] == 1:
        return values
    return jax.lax.dynamic_slice_in_dim(values, begin, chunk, 0)


def _mean_speed(
    run: Run, problem: Problem, windows: Windows, chunk: int, used: Int[Array, ""]
) -> Float[Array, "row *motors sequence"]:
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

    def some(
        number: Int[Array, ""], means: Float[Array, "row *motors sequence"]
    ) -> Float[Array, "row *motors sequence"]:
        at = jnp.minimum(number * chunk, len(angle) - chunk)
        window = windows(at)
        before, begin, turn = (taken(values, window.first) for values in every)
        end = taken(run.sensed_speed, jnp.minimum(window.first + 1, len(angle) - 1))
        length = taken(lengths, window.first) if lengths.ndim else lengths
        share, rise, mean = window.part / length, (end - begin) * length, turn - begin * length
        inside = window.part * begin + share**2 * (3 * mean - rise + share * (rise - 2 * mean))
        turned = _rows(angle, at, chunk) - before - inside + window.before
        at_once = _rows(run.sensed_speed, at, chunk)
        speed = jnp.where(window.length > 0, turned / jnp.where(window.length > 0, window.length, 1.0), at_once)
        return jax.lax.dynamic_update_slice_in_dim(means, speed, at, 0)

    return jax.lax.fori_loop(0, (used + chunk - 1) // chunk, some, jnp.zeros_like(angle))
