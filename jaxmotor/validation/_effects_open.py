"""Open loop of motors with effects: what a recording would show of them under the voltage that was logged."""

import dataclasses

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int, Key

from jaxmotor._precision import to_jax
from jaxmotor._programs import Arrays, program
from jaxmotor.estimate import Model, Packed, Problem, as_problem
from jaxmotor.motor import Motor, Rows, Run, simulate_motor, steps_for
from jaxmotor.recording import Recording
from jaxmotor.validation._drawn_motors import draw_motors
from jaxmotor.validation._draws import psi_of
from jaxmotor.validation._follow import follow
from jaxmotor.validation._shaft import bridge_supply, shaft_angles, warmth
from jaxmotor.validation._trials import Trials, averaged

MOST_STEPS = 10
"""Per row."""
SPEED_STEP = 0.05
"""Over which initial speeds are differenced [rad/s]."""
ROUNDS = 3


class Logged(eqx.Module):
    """A packed recording, and what else a motor with effects needs of it."""

    problem: Problem
    time: Float[Array, "lane row"]
    """Since the recording began [s]."""
    angle: Float[Array, "lane row"] | None
    """Measured [rad]; None where it is not known throughout."""
    warmth: Float[Array, "lane row"] | None
    """The winding's relative rise of resistance, where the motor has such a law."""
    supply: Float[Array, ""]
    """Nominal [V]."""
    steps: Int[Array, ""]
    """Per row."""
    used: Int[Array, ""]
    """Rows of the fullest lane; the others are padding."""
    lengths: Float[Array, " 2"] | None
    """A typical duration of a row and the longest [s], where rows have durations of their own."""


def logged(motor: Motor, recording: Recording, packed: Packed) -> Logged:
    """`packed` segments of `recording`, for motors like `motor`."""
    time = np.array([segment.start_s for segment in recording.segments])[packed.segment_of] + packed.time_s
    angles, warm = shaft_angles(recording), warmth(motor, recording)
    period, longest = packed.durations
    return Logged(
        # One program for all recordings of a size: what only estimates need is made equal.
        dataclasses.replace(as_problem(packed), clusters=0, floor_known=True),
        to_jax(time),
        None if angles is None else to_jax(_of_rows(angles, packed)),
        None if warm is None else to_jax(_of_rows(warm, packed)),
        to_jax(np.float64(bridge_supply(recording))),
        to_jax(np.int32(min(steps_for(period, float(motor.linear.pole)), MOST_STEPS))),
        to_jax(np.int32(np.nonzero(packed.segment_of >= 0)[1].max() + 1)),
        None if packed.lanes.duration.ndim == 0 else to_jax(np.array([period, longest])),
    )


def _of_rows(columns: list[np.ndarray], packed: Packed) -> np.ndarray:
    """(lane, row) of `columns`, one for each segment."""
    values = np.zeros(packed.row_of.shape)
    for index in np.unique(packed.segment_of[packed.segment_of >= 0]):
        cells = packed.segment_of == index
        values[cells] = columns[index][packed.row_of[cells]]
    return values


def shown(motor: Motor, speeds: Float[Array, " k"], log: Logged) -> Float[Array, "lane row"]:
    """What the recording would show [units] of `motor` whose pieces begin at `speeds` [rad/s]."""
    problem, lanes = log.problem, log.problem.lanes
    duration = jnp.asarray(lanes.duration)
    initial = jnp.asarray(lanes.free) * speeds[lanes.piece]
    rows = Rows(jnp.asarray(lanes.volts), jnp.asarray(lanes.reset), initial, log.time, log.angle, log.warmth)

    def lane(rows: Rows, duration: Float[Array, "*n"]) -> Run:
        return simulate_motor(motor, rows, duration, log.supply, log.steps, used=log.used, lengths=log.lengths)

    run = jax.vmap(lane, (0, None if duration.ndim == 0 else 0))(rows, duration)
    if problem.kind == "turn":
        return run.seen_turn / problem.unit
    return (run.seen_speed if problem.kind == "speed" else _windowed(run, problem)) / problem.unit


def _windowed(run: Run, problem: Problem) -> Float[Array, "lane row"]:
    """Mean speed over the window before each row; in the row in which it begins the speed is a straight line."""
    lanes = problem.lanes
    angle = jnp.cumsum(run.seen_turn, axis=1) - run.seen_turn
    first = jnp.arange(angle.shape[1], dtype=jnp.int32)[None, :] - jnp.asarray(lanes.back, jnp.int32)
    duration = jnp.broadcast_to(jnp.asarray(lanes.duration), angle.shape)
    every = (angle, run.seen_speed, run.seen_turn, duration)
    before, begin, turn, length = (jnp.take_along_axis(values, first, axis=1) for values in every)
    part = jnp.asarray(lanes.part)
    inside = part * begin + (part / length) ** 2 * (turn - begin * length)
    return (angle - before - inside) / problem.window


@program
def off_program(motors: Motor, speeds: Float[Array, "batch k"], log: Logged) -> Arrays:
    """(batch, lane, row) measured minus simulated [units] of each of `motors`; zero where nothing was measured."""

    def off(motor: Motor, speeds: Float[Array, " k"]) -> Float[Array, "lane row"]:
        lanes = log.problem.lanes
        return jnp.where(lanes.valid, jnp.asarray(lanes.observed) - shown(motor, speeds, log), 0.0)

    return {"off": jax.vmap(off)(motors, speeds)}


def follow_motors(motors: Motor, log: Logged, start: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Initial speed of each piece (batch, k) [rad/s], and measured minus simulated (batch, lane, row) [units].

    A piece whose initial speed is not known begins at the one that fits it best, sought from `start` (k,).
    """
    number = len(np.asarray(motors.linear.gain))
    speeds = np.repeat(start[None], number, axis=0)
    if not log.problem.free:
        return speeds, _off(motors, speeds, log)
    piece, pieces = np.asarray(log.problem.lanes.piece).reshape(-1), len(start)

    def summed(values: np.ndarray) -> np.ndarray:
        return np.stack([np.bincount(piece, row.reshape(-1), pieces) for row in values])

    twice = jax.tree.map(lambda leaf: jnp.concatenate([leaf, leaf]), motors)
    step, least = np.zeros_like(speeds), np.full(speeds.shape, np.inf)
    for _ in range(ROUNDS):
        tried = speeds + step
        residual, moved = np.split(_off(twice, np.concatenate([tried, tried + SPEED_STEP]), log), 2)
        square = summed(residual**2)
        # Near rest friction bends what a speed does; a step that makes a piece worse is not taken.
        better = square < least
        speeds, least = np.where(better, tried, speeds), np.where(better, square, least)
        column = (moved - residual) / SPEED_STEP
        size = summed(column**2)
        step = np.where(better, -summed(column * residual) / np.where(size > 1e-12, size, np.inf), 0.5 * step)
    return speeds, _off(motors, speeds, log)


def _off(motors: Motor, speeds: np.ndarray, log: Logged) -> np.ndarray:
    return np.asarray(off_program(motors, to_jax(speeds), log)["off"])


def follow_with_effects(model: Model, recording: Recording, packed: Packed) -> tuple[np.ndarray, np.ndarray]:
    """As `follow`, with the effects of `model`."""
    log = logged(model.whole, recording, packed)
    alone = jax.tree.map(lambda leaf: to_jax(leaf[None]), model.whole)
    speeds, off = follow_motors(alone, log, linear_speeds(model, packed))
    return speeds[0], off[0]


def linear_speeds(model: Model, packed: Packed) -> np.ndarray:
    """(k,) at which the pieces of `packed` begin best, were there no effects [rad/s]."""
    return np.asarray(follow(as_problem(packed), jnp.asarray(psi_of(model)))[0])


def mean_of_motors(
    model: Model, recording: Recording, trials: Trials, number: int, key: Key[Array, ""]
) -> tuple[Float[Array, "number size"], Float[Array, "number size"], np.ndarray]:
    """As `mean_of_trials`, with the effects of `model`."""
    log = logged(model.whole, recording, trials.packed)
    speeds, _ = follow_with_effects(model, recording, trials.packed)
    of_motors, of_encoder = jax.random.split(key)
    motors, keys = draw_motors(model, number, of_motors), jax.random.split(of_encoder, number)
    bins, scale = jnp.asarray(trials.bins), jnp.asarray(trials.scale)
    return *_means(motors, to_jax(speeds), log, bins, scale, len(trials.time_s), keys), speeds


@eqx.filter_jit
def _means(
    motors: Motor,
    speeds: Float[Array, " k"],
    log: Logged,
    bins: Int[Array, "lane row"],
    scale: Float[Array, "lane row"],
    size: int,
    keys: Key[Array, " number"],
) -> tuple[Float[Array, "number size"], Float[Array, "number size"]]:
    def mean(both: tuple[Motor, Key[Array, ""]]) -> tuple[Float[Array, " size"], Float[Array, " size"]]:
        motor, key = both
        return averaged(shown(motor, speeds, log), log.problem, bins, scale, size, key)

    return jax.lax.map(mean, (motors, keys), batch_size=32)
