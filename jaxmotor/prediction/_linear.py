"""What a log would hold of a linear motor, exactly.

ψ = (K, b, log a [, log τ]): gain [rad/s/V], speed of a constant voltage error [rad/s], pole [rad/s], electrical time
constant [s]. Where the log's timing is not known (`Problem.row`) its end is the offset: by how much a row was read
after its voltage changed, in rows. Readings that are late see the voltages early. Where it is not known how speeds were
averaged either (`Problem.held`), ψ = (K, b, log a, log τ, log W, offset): W is the length of a window [rows], and τ may
stand for a first-order filter of the speeds, since that and a motor of first order are one of second order.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

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

NONE_ROWS = 1e-3
"""Length of a window that is none."""

LEAST_APART = 1e-3
"""Of two poles, relative to their mean."""


class Reading(NamedTuple):
    """How rows were read, where the log does not state it."""

    late: Float[Array, ""] | None
    """How late voltages act for the readings [s]; None where a row is read as its voltage changes."""
    window: Float[Array, ""] | None
    """Usual length of the window before the row over which the speed is a mean [s]; None where `Problem.window` is
    that."""


AS_STATED = Reading(None, None)


def motor_of(psi: Float[Array, " p"], problem: Problem | None = None) -> AbstractLinearMotor:
    """The motor at ψ; beside a timing offset one of first order has the usual electrical time constant, too."""
    gain, pole, timed = psi[0], jnp.exp(psi[2]), problem is not None and problem.row is not None
    if len(psi) - timed >= 4:
        return SecondOrder(gain, pole, jnp.exp(psi[3]))
    return SecondOrder(gain, pole, jnp.full_like(pole, LAG_S[0])) if timed else FirstOrder(gain, pole)


def reading_of(psi: Float[Array, " p"], problem: Problem) -> Reading:
    """How rows were read at ψ."""
    if problem.row is None:
        return AS_STATED
    return Reading(-psi[-1] * problem.row, None if problem.held is None else jnp.exp(psi[4]) * problem.row)


def is_no_average(psi: Float[Array, " p"], problem: Problem) -> Bool[Array, ""]:
    """Where it is sought how speeds were averaged: the window or the filter at ψ is less than none."""
    if problem.row is None or problem.held is None:
        return jnp.asarray(False)
    none = jnp.log(jnp.array([LAG_S[0], NONE_ROWS], psi.dtype))
    return ((psi[3:5] < none) & ~problem.held[3:5]).any()


def observe(
    motor: AbstractLinearMotor,
    problem: Problem,
    volts: Float[Array, "sequence row"],
    initial_speed: Float[Array, "sequence row"],
    reading: Reading = AS_STATED,
) -> Float[Array, "sequence row"]:
    """What the log would hold [units] of a motor under `volts`, from `initial_speed`, read as `reading` says."""
    by_row = problem.kind == "window" or jnp.ndim(problem.batch.duration) > 0
    if by_row and problem.row is not None and isinstance(motor, SecondOrder):
        # Of two lags: their closed form, row by row, is many times as fast, and has derivatives where a window ends.
        share, poles = _lags(motor)
        each = jax.vmap(lambda pole: observe(FirstOrder(motor.gain, pole), problem, volts, initial_speed, reading))(
            poles
        )
        return jnp.tensordot(share, each, 1)
    batch = problem.batch
    duration, reset = jnp.asarray(batch.duration), jnp.asarray(batch.reset)

    def sequence(volts, reset, initial_speed, duration) -> Motion:
        return simulate(motor, volts, reset, initial_speed, duration, reading.late)

    per_sequence = (0, 0, 0, None if duration.ndim == 0 else 0)
    motion = jax.vmap(sequence, per_sequence)(volts, reset, initial_speed, duration)
    if problem.kind == "turn":
        return motion.turn / problem.unit
    if problem.kind == "speed":
        return motion.state[..., 0] / problem.unit
    return _mean_speed(motor, problem, motion, volts, initial_speed, reading) / problem.unit


def _lags(motor: SecondOrder) -> tuple[Float[Array, " 2"], Float[Array, " 2"]]:
    """`motor` as a sum of two of first order of its gain: their shares, and their poles [rad/s].

    K p q/((s + p)(s + q)) = [q K p/(s + p) - p K q/(s + q)]/(q - p). Poles are real, and a thousandth apart at least.
    """
    product = jnp.minimum(4 * motor.pole * motor.electrical_time_constant, 1 - LEAST_APART**2)
    apart = jnp.sqrt(1 - product)
    # The slow one is (1 - apart) over twice the lag, without the difference of nearly equal numbers.
    slow, fast = (one / (2 * motor.electrical_time_constant) for one in (product / (1 + apart), 1 + apart))
    poles = jnp.stack([slow, fast])
    return poles[::-1] / (fast - slow) * jnp.array([1.0, -1.0]), poles


def _mean_speed(
    motor: AbstractLinearMotor,
    problem: Problem,
    motion: Motion,
    volts: Float[Array, "sequence row"],
    initial_speed: Float[Array, "sequence row"],
    reading: Reading,
) -> Float[Array, "sequence row"]:
    """Over the window before each row [rad/s]."""
    batch, duration = problem.batch, jnp.asarray(problem.batch.duration)
    angle = jnp.cumsum(motion.turn, axis=1) - motion.turn
    begin = _begin(problem, initial_speed, reading.window)

    def at_first(values: Float[Array, "sequence row"]) -> Float[Array, "sequence row"]:
        return jnp.take_along_axis(values, begin.row, axis=1)

    state = jnp.take_along_axis(motion.state, begin.row[..., None], axis=1)
    if reading.late is None:
        drives, holds = (at_first(volts),), (jax.vmap(jax.vmap(motor.hold))(begin.part),)
    else:
        axes = (0, 0, None if duration.ndim == 0 else 0, None)
        rows = jax.vmap(switched, axes)(volts, jnp.asarray(batch.reset), duration, reading.late)
        drives = at_first(rows.first), at_first(rows.second)
        # Neither part is quite nothing: the hold of a motor of second order has no derivative there.
        until = jnp.minimum(at_first(rows.part), (1 - 1e-9) * begin.part)
        holds = jax.vmap(jax.vmap(lambda until, part: hold_switched(motor, until, part)))(until, begin.part)
    _, inside = jax.vmap(jax.vmap(driven))(holds, state, drives)
    length = (problem.window if reading.window is None else reading.window) * jnp.asarray(batch.span)
    return (angle - at_first(angle) - inside + begin.before) / length


class _Begin(NamedTuple):
    """Where the window of each row begins."""

    row: Int[Array, "sequence row"]
    part: Float[Array, "sequence row"]
    """Since that row began [s]."""
    before: Float[Array, "sequence row"] | float = 0.0
    """Angle turned in the part of the window that is before the piece, at its initial speed [rad]."""


def _begin(problem: Problem, initial_speed: Float[Array, "sequence row"], window: Float[Array, ""] | None) -> _Begin:
    """Of a `window` of any length [s], or of that which the log states."""
    batch = problem.batch
    number = jnp.broadcast_to(jnp.arange(batch.volts.shape[1], dtype=jnp.int32), batch.volts.shape)
    if window is None:
        return _Begin(number - jnp.asarray(batch.back, jnp.int32), jnp.asarray(batch.part))
    duration = jnp.broadcast_to(jnp.asarray(batch.duration), batch.volts.shape)
    time = jnp.cumsum(duration, axis=1) - duration
    first = jax.lax.cummax(jnp.where(jnp.asarray(batch.reset), number, 0), axis=1)
    least, speed = (jnp.take_along_axis(values, first, axis=1) for values in (time, initial_speed))
    length = window * jnp.asarray(batch.span)
    begin = jnp.maximum(time - length, least)
    row = jax.vmap(lambda time, begin: jnp.searchsorted(time, begin, side="right"))(time, begin) - 1
    row = jnp.clip(row, first, number).astype(jnp.int32)
    part = jnp.maximum(begin - jnp.take_along_axis(time, row, axis=1), 1e-9 * duration)
    return _Begin(row, part, speed * jnp.maximum(length - (time - least), 0.0))


def predict(
    psi: Float[Array, " p"], initial_speed: Float[Array, " k"], problem: Problem
) -> Float[Array, "sequence row"]:
    """What the log would hold [units] at ψ."""
    batch = problem.batch
    start = jnp.asarray(batch.free) * initial_speed[batch.piece]
    unit_gain = motor_of(psi.at[0].set(1.0), problem)
    return observe(unit_gain, problem, psi[0] * jnp.asarray(batch.volts) + psi[1], start, reading_of(psi, problem))


def start_columns(psi: Float[Array, " p"], problem: Problem) -> Float[Array, "sequence row c"]:
    """What one rad/s of initial speed adds to the piece it belongs to [units]; no column where all start at rest."""
    free = jnp.asarray(problem.batch.free)
    if not problem.free:
        return jnp.zeros((*free.shape, 0), free.dtype)
    window = reading_of(psi, problem).window
    return observe(motor_of(psi, problem), problem, jnp.zeros_like(free), free, Reading(None, window))[..., None]
