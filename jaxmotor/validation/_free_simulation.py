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
from jaxmotor.motor.effects._substep import parts_of
from jaxmotor.prediction import (
    PLACES,
    Log,
    Packed,
    as_begins,
    first_speeds,
    fit_initial_places,
    fit_initial_speeds,
    in_motion,
    log_of,
    pack,
    residuals,
)
from jaxmotor.recording import Recording


def is_heated(motor: Motor) -> bool:
    """It has a law of its winding's warmth."""
    return any(isinstance(effect, WindingHeating) for effect in motor.effects)


def has_gap(motor: Motor) -> bool:
    """Within it a load may be anywhere as a piece begins."""
    return parts_of(motor.effects).has_gap


def whole_log(motor: Motor, recording: Recording, packed: Packed) -> Log:
    """`packed` segments of `recording`, for motors like `motor`.

    The winding is followed through all that was measured: what is not scored heats it, too.
    """
    everything = pack(recording, tuple(range(len(recording.segments)))) if is_heated(motor) else packed
    return log_of(recording, packed, float(motor.linear.pole), everything)


@program
def residuals_program(motors: Motor, speeds: Float[Array, "batch k"], log: Log) -> Arrays:
    """(row, sequence, motor) measured minus simulated [units] of each of `motors`; zero where nothing was measured."""
    return {"residuals": residuals(motors, speeds, log)}


def simulate_freely(motors: Motor, log: Log) -> tuple[np.ndarray, np.ndarray]:
    """How each piece begins (batch, k): its speed [rad/s], for motors with a gap (batch, 2k) also the place of the load
    in that (-1 to 1); and measured minus simulated (motor, sequence, row) [units].

    What is not known of that is as it fits the piece best.
    """
    number, speeds = len(np.asarray(motors.linear.gain)), first_speeds(log)
    begins, moves = np.repeat(as_begins(speeds, len(speeds), motors)[None], number, axis=0), in_motion(log)
    piece, times = np.asarray(log.problem.batch.piece).reshape(-1), 2 if moves.any() else 1

    def residuals(tried: np.ndarray) -> np.ndarray:
        """Of each motor as often as there are begins tried for it."""
        some = jax.tree.map(lambda leaf: jnp.tile(leaf, len(tried) // number), motors)
        return _residuals(some, tried, log)

    if moves.any():
        begins = fit_initial_speeds(lambda tried: residuals(tried).reshape(len(tried), -1), begins, piece, moves)
    if has_gap(motors):
        each = [jax.tree.map(lambda leaf, k=k: leaf[k], motors) for k in range(number)]
        begins = np.stack([_placed(motor, own, log) for motor, own in zip(each, begins, strict=True)])
    return begins, residuals(np.tile(begins, (times, 1)))[:number]


def _placed(motor: Motor, begins: np.ndarray, log: Log) -> np.ndarray:
    """`begins` (2k,) with the load of `motor` where in its gap it fits best."""
    alike = jax.tree.map(lambda leaf: jnp.repeat(leaf, len(PLACES)), motor)

    def residuals(tried: np.ndarray) -> np.ndarray:
        return _residuals(alike, tried, log).reshape(len(tried), -1)

    return fit_initial_places(residuals, begins, np.asarray(log.problem.batch.piece).reshape(-1))


def _residuals(motors: Motor, speeds: np.ndarray, log: Log) -> np.ndarray:
    return np.asarray(residuals_program(motors, to_jax(speeds), log)["residuals"]).T


def simulate_model(model: Model, recording: Recording, packed: Packed) -> tuple[np.ndarray, np.ndarray]:
    """How each piece begins (k,), and residual (sequence, row) [units] of `model` alone (`simulate_freely`)."""
    alone = jax.tree.map(lambda leaf: to_jax(leaf[None]), model.whole)
    begins, residual = simulate_freely(alone, whole_log(model.whole, recording, packed))
    return begins[0], residual[0]
