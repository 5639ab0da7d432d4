"""What a learned curve can be over (speed, voltage, shaft angle, time), and which rows of a trial judge it."""

import dataclasses
from typing import NamedTuple

import numpy as np
from jaxtyping import Array, Bool

from jaxmotor._precision import to_jax
from jaxmotor.diagnosis._learned_law import LearnedCoordinate
from jaxmotor.diagnosis._solve import Fitted, Solver
from jaxmotor.diagnosis._spline import Spline
from jaxmotor.diagnosis._split import split
from jaxmotor.diagnosis._trial import Trial
from jaxmotor.recording import Recording

SMOOTH_S = 0.03
"""Half of the window over which the measured speed corrects the simulated one."""
FEWEST = 8
"""Different values of a coordinate that a curve needs."""


class Places(NamedTuple):
    """A coordinate over (lane, row)."""

    at: np.ndarray
    """In the middle of each row."""
    span: np.ndarray
    """By how much it changes over the row."""

    def columns(self, spline: Spline, used: np.ndarray, jump: bool = True) -> np.ndarray:
        """(used rows, k) means over each row, by Gauss's rule of two points."""
        at, span = self.at[used], self.span[used]
        if not span.any():
            return spline.columns(at, jump)
        away = span / np.sqrt(12)
        return 0.5 * (spline.columns(at - away, jump) + spline.columns(at + away, jump))


def rows_of_experiments(trial: Trial) -> Bool[np.ndarray, "lane row"]:
    return np.asarray(trial.problem.lanes.piece) < trial.problem.pieces


def under(trial: Trial, volts: Array) -> Trial:
    """`trial` with other `volts` (lane, row)."""
    lanes = trial.problem.lanes._replace(volts=volts)  # pyright: ignore[reportArgumentType]
    return dataclasses.replace(trial, problem=dataclasses.replace(trial.problem, lanes=lanes))


def coordinates(solver: Solver, fitted: Fitted) -> dict[LearnedCoordinate, Places]:
    """Those that the recording can show."""
    trial, lanes, used = solver.trial, solver.trial.problem.lanes, rows_of_experiments(solver.trial)
    none = np.zeros(used.shape)
    found: dict[LearnedCoordinate, Places] = {"speed": speed(solver, fitted)}
    found["voltage"] = Places(np.asarray(lanes.volts), none)
    if trial.angle is not None and np.ptp(np.asarray(trial.angle)[used]) > 2 * np.pi:
        turned = np.where(trial.valid, np.asarray(lanes.observed) * float(trial.problem.unit), 0.0)
        turned = turned if trial.problem.kind == "turn" else none
        found["angle"] = Places(np.mod(np.asarray(trial.angle) + 0.5 * turned, 2 * np.pi), turned)
    found["time"] = Places(np.asarray(trial.time) + 0.5 * np.asarray(lanes.duration), none)
    return {name: one for name, one in found.items() if len(np.unique(np.round(one.at[used], 9))) >= FEWEST}


def speed(solver: Solver, fitted: Fitted, added: np.ndarray | None = None) -> Places:
    """Simulated, corrected by a smoothed difference to the measured one: rounding to counts does not blur it.

    `added` (lane, row) is a voltage beside the applied one [V].
    """
    trial, lanes, used = solver.trial, solver.trial.problem.lanes, rows_of_experiments(solver.trial)
    if added is not None:
        solver = Solver(under(trial, to_jax(np.asarray(lanes.volts) + added)))
    plain, _ = solver.residual_of(fitted.motor, fitted.speeds)
    duration = np.broadcast_to(np.asarray(lanes.duration), used.shape)
    reach = max(2, round(SMOOTH_S / float(np.median(duration[used]))))
    piece = np.asarray(lanes.piece)
    total, weight = np.zeros(plain.shape), np.full(plain.shape, 1e-12)
    for shift in range(-reach, reach + 1):
        bell = 0.5 + 0.5 * np.cos(np.pi * shift / (reach + 1))
        near = bell * (np.roll(trial.valid, shift, axis=1) & (np.roll(piece, shift, axis=1) == piece))
        total, weight = total + near * np.roll(plain, shift, axis=1), weight + near
    seen = (np.asarray(lanes.observed) - plain + total / weight) * float(trial.problem.unit)
    at = seen / duration if trial.problem.kind == "turn" else seen
    # A row without a measurement goes on as the one before it.
    at = np.where(trial.valid, at, np.roll(at, 1, axis=1))
    inside = (np.roll(piece, 1, axis=1) == piece) & (np.roll(piece, -1, axis=1) == piece)
    return Places(at, np.where(inside, 0.5 * (np.roll(at, -1, axis=1) - np.roll(at, 1, axis=1)), 0.0))


def held_rows(recording: Recording, solver: Solver) -> np.ndarray:
    """(n,) of each of the solver's rows: it is held out. Every third block of a recording too short to split."""
    parts, segments = split(recording)
    time = np.asarray(solver.trial.time).reshape(-1)[solver.cells]
    held = np.zeros(len(time), bool)
    for index in segments:
        part = parts.segments[index]
        margin = 0.25 * float(np.diff(part.time_s).min())
        held |= (time > part.start_s - margin) & (time < part.start_s + part.time_s[-1] + margin)
    block = np.asarray(solver.trial.problem.lanes.cluster).reshape(-1)[solver.cells]
    return held if held.any() and not held.all() else block % 3 == 2
