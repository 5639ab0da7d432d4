"""Free simulation: what a recording would show of motors under the voltage that was logged."""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxmotor._precision import to_jax
from jaxmotor._programs import Arrays, program
from jaxmotor.estimate import Model
from jaxmotor.motor import Motor
from jaxmotor.motor.effects import WindingHeating
from jaxmotor.prediction import Log, Packed, first_speeds, fit_initial_speeds, log_of, pack, residuals
from jaxmotor.recording import Recording


def is_heated(motor: Motor) -> bool:
    """It has a law of its winding's warmth."""
    return any(isinstance(effect, WindingHeating) for effect in motor.effects)


def whole_log(motor: Motor, recording: Recording, packed: Packed) -> Log:
    """`packed` segments of `recording`, for motors like `motor`.

    The winding is followed through all that was measured: what is not scored heats it, too.
    """
    everything = pack(recording, tuple(range(len(recording.segments)))) if is_heated(motor) else packed
    return log_of(recording, packed, float(motor.linear.pole), everything)


@program
def residuals_program(motors: Motor, speeds: Float[Array, "batch k"], log: Log) -> Arrays:
    """(row, motor, sequence) measured minus simulated [units] of each of `motors`; zero where nothing was measured."""
    return {"residuals": residuals(motors, speeds, log)}


def simulate_freely(motors: Motor, log: Log) -> tuple[np.ndarray, np.ndarray]:
    """Initial speed of each piece (batch, k) [rad/s], and measured minus simulated (motor, sequence, row) [units].

    A piece whose initial speed is not known begins at the one that fits it best.
    """
    number = len(np.asarray(motors.linear.gain))
    speeds = np.repeat(first_speeds(log)[None], number, axis=0)
    if not np.any(log.problem.batch.free):
        return speeds, _residuals(motors, speeds, log)
    twice = jax.tree.map(lambda leaf: jnp.concatenate([leaf, leaf]), motors)
    piece = np.asarray(log.problem.batch.piece).reshape(-1)

    def residual(tried: np.ndarray) -> np.ndarray:
        return _residuals(twice, tried, log).reshape(len(tried), -1)

    speeds = fit_initial_speeds(residual, speeds, piece)
    return speeds, _residuals(twice, np.concatenate([speeds, speeds]), log)[:number]


def _residuals(motors: Motor, speeds: np.ndarray, log: Log) -> np.ndarray:
    return np.asarray(residuals_program(motors, to_jax(speeds), log)["residuals"]).transpose(1, 2, 0)


def simulate_model(model: Model, recording: Recording, packed: Packed) -> tuple[np.ndarray, np.ndarray]:
    """Initial speed of each piece (k,) [rad/s], and residual (sequence, row) [units] of `model` alone."""
    alone = jax.tree.map(lambda leaf: to_jax(leaf[None]), model.whole)
    speeds, residual = simulate_freely(alone, whole_log(model.whole, recording, packed))
    return speeds[0], residual[0]
