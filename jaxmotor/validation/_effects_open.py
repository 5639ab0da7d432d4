"""Open loop of motors with effects: what a recording would show of them under the voltage that was logged."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int, Key

from jaxmotor._precision import to_jax
from jaxmotor._programs import Arrays, program
from jaxmotor.estimate import Model
from jaxmotor.motor import Motor
from jaxmotor.motor.effects import WindingHeating
from jaxmotor.prediction import Log, Packed, as_problem, fit_initial_speeds, log_of, pack, predicted_readings, residuals
from jaxmotor.recording import Recording
from jaxmotor.validation._drawn_motors import draw_motors
from jaxmotor.validation._draws import psi_of
from jaxmotor.validation._follow import follow
from jaxmotor.validation._trials import Trials, averaged


def whole_log(motor: Motor, recording: Recording, packed: Packed) -> Log:
    """`packed` segments of `recording`, for motors like `motor`.

    The winding is followed through all that was measured: what is not scored heats it, too.
    """
    warms = any(isinstance(effect, WindingHeating) for effect in motor.effects)
    everything = pack(recording, tuple(range(len(recording.segments)))) if warms else packed
    return log_of(recording, packed, float(motor.linear.pole), everything)


@program
def off_program(motors: Motor, speeds: Float[Array, "batch k"], log: Log) -> Arrays:
    """(row, batch, lane) measured minus simulated [units] of each of `motors`; zero where nothing was measured."""
    return {"off": residuals(motors, speeds, log)}


def follow_motors(motors: Motor, log: Log, start: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Initial speed of each piece (batch, k) [rad/s], and measured minus simulated (batch, lane, row) [units].

    A piece whose initial speed is not known begins at the one that fits it best, sought from `start` (k,).
    """
    number = len(np.asarray(motors.linear.gain))
    speeds = np.repeat(start[None], number, axis=0)
    if not np.any(log.problem.lanes.free):
        return speeds, _off(motors, speeds, log)
    twice = jax.tree.map(lambda leaf: jnp.concatenate([leaf, leaf]), motors)
    piece = np.asarray(log.problem.lanes.piece).reshape(-1)

    def residual(tried: np.ndarray) -> np.ndarray:
        return _off(twice, tried, log).reshape(len(tried), -1)

    speeds = fit_initial_speeds(residual, speeds, piece)
    return speeds, _off(motors, speeds, log)


def _off(motors: Motor, speeds: np.ndarray, log: Log) -> np.ndarray:
    return np.asarray(off_program(motors, to_jax(speeds), log)["off"]).transpose(1, 2, 0)


def follow_with_effects(model: Model, recording: Recording, packed: Packed) -> tuple[np.ndarray, np.ndarray]:
    """As `follow`, with the effects of `model`."""
    log = whole_log(model.whole, recording, packed)
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
    log = whole_log(model.whole, recording, trials.packed)
    speeds, _ = follow_with_effects(model, recording, trials.packed)
    of_motors, of_encoder = jax.random.split(key)
    motors, keys = draw_motors(model, number, of_motors), jax.random.split(of_encoder, number)
    bins, scale = jnp.asarray(trials.bins), jnp.asarray(trials.scale)
    return *_means(motors, to_jax(speeds), log, bins, scale, len(trials.time_s), keys), speeds


@eqx.filter_jit
def _means(
    motors: Motor,
    speeds: Float[Array, " k"],
    log: Log,
    bins: Int[Array, "lane row"],
    scale: Float[Array, "lane row"],
    size: int,
    keys: Key[Array, " number"],
) -> tuple[Float[Array, "number size"], Float[Array, "number size"]]:
    def mean(both: tuple[Motor, Key[Array, ""]]) -> tuple[Float[Array, " size"], Float[Array, " size"]]:
        motor, key = both
        return averaged(predicted_readings(motor, speeds, log).T, log.problem, bins, scale, size, key)

    return jax.lax.map(mean, (motors, keys), batch_size=32)
