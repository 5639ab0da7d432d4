"""A recording as the simulation of motors with effects needs it."""

import dataclasses
import math

import equinox as eqx
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from jaxmotor._precision import to_jax
from jaxmotor.motor import steps_for
from jaxmotor.motor.effects import MeasuredLog
from jaxmotor.prediction._packing import Packed
from jaxmotor.prediction._problem import Problem, as_problem
from jaxmotor.prediction._shaft import measured_log, rows_in_log, shaft_angles, supply_of, time_of
from jaxmotor.recording import Recording

MOST_STEPS = 10
"""Per row: with twice as many no law here changes chi2 by more than 0.003."""
STEP_ERROR, SEEN_ERROR = 0.2, 0.05
"""Laws in steps of h change speeds by up to that part of (a h)² of their spread, a the pole (measured: up to 0.1, and
friction in a sector more); and what of it may be left [standard deviations of the noise], 0.0025 of chi2."""


class Log(eqx.Module):
    """One recording, and what must be known of its rig. Static fields choose the program, arrays are its data."""

    problem: Problem
    time: Float[Array, "sequence row"]
    """Since the recording began [s]."""
    angle: Float[Array, "sequence row"] | None
    """Measured [rad]; None where it is not known throughout."""
    measured_log: MeasuredLog
    """All rows in their order, from which the winding's warmth follows."""
    row: Int[Array, "sequence row"]
    """Which of those each row of a sequence is."""
    supply: Float[Array, ""]
    """Nominal [V]."""
    steps: Int[Array, ""]
    """Steps per row."""
    used: Int[Array, ""]
    """Rows of the fullest sequence; the others are padding."""
    lengths: Float[Array, " 2"] | None
    """A typical duration of a row and the longest [s], where rows have durations of their own."""

    @property
    def valid(self) -> Bool[np.ndarray, "sequence row"]:
        return np.asarray(self.problem.batch.valid)


def log_of(recording: Recording, packed: Packed, pole_rad_s: float, everything: Packed | None = None) -> Log:
    """`packed` segments of `recording`, for motors of about this pole; `everything` that was measured warmed them."""
    everything = packed if everything is None else everything
    angles = shaft_angles(recording)
    period, longest = packed.durations
    return Log(
        # One program for all recordings of a size: what only estimates need is made equal.
        dataclasses.replace(as_problem(packed), clusters=0, floor_known=True, free=False),
        to_jax(time_of(recording, packed)),
        None if angles is None else to_jax(_angle(angles, packed)),
        measured_log(recording, everything),
        to_jax(rows_in_log(recording, packed, everything)),
        to_jax(np.float64(supply_of(recording))),
        to_jax(np.int32(_steps(packed, pole_rad_s))),
        to_jax(np.int32(np.nonzero(packed.segment_of >= 0)[1].max() + 1)),
        None if packed.batch.duration.ndim == 0 else to_jax(np.array([period, longest])),
    )


def _angle(columns: list[np.ndarray], packed: Packed) -> np.ndarray:
    """(sequence, row) of `columns`, one for each segment, but for whole turns."""
    angle = np.zeros(packed.row_of.shape)
    for index in np.unique(packed.segment_of[packed.segment_of >= 0]):
        cells = packed.segment_of == index
        angle[cells] = columns[index][packed.row_of[cells]]
    return angle - angle[packed.segment_of >= 0].min(initial=0.0) // (2 * np.pi) * (2 * np.pi)


def _steps(packed: Packed, pole_rad_s: float) -> int:
    """Steps in which rows of `packed` are simulated: of noisy speeds few. An angle adds their errors up."""
    period, observation = packed.durations[0], packed.observation
    most = steps_per_row(period, pole_rad_s)
    if observation.noise.known or observation.noise.measured != "speed":
        return most
    spread = float(np.std(packed.batch.observed[packed.batch.valid])) / math.sqrt(observation.floor)
    return min(most, max(2, math.ceil(pole_rad_s * period * math.sqrt(STEP_ERROR / SEEN_ERROR * spread))))


def steps_per_row(duration_s: float, pole_rad_s: float) -> int:
    """Steps in which rows of `duration_s` are simulated for motors of about this pole."""
    return min(steps_for(duration_s, pole_rad_s), MOST_STEPS)
