"""How often in a turn what a motor leaves repeats, judged without simulating any law.

A torque sin(nθ) of the measured angle θ, averaged over each row, passes a first-order lag of the motor's pole and the
filter of the residuals (`_residuals.drift`). For each n the part of the residual's square that such a sine and cosine
take up is compared with that of other n.
"""

import math

import numpy as np

from jaxmotor._balanced import solve_balanced
from jaxmotor.diagnosis._score_test import without_own
from jaxmotor.diagnosis._solve import DAMPING, Fitted, Solver, square_of
from jaxmotor.prediction._flexible_model import states

LEAST, MOST = 13, 120
"""Cycles in a turn; fewer are tried whatever shows."""
AT_ONCE = 18
"""Numbers of cycles whose waves are made together: those of a long log take a hundred megabytes."""
ENOUGH_ROWS = 20_000
"""The first of a log, which decide."""
CHANCE = 12.0
"""Times the median of all n, that one must take up."""
SEEN = 0.3
"""Mean square that averaging over the rows in motion must leave of a wave, over what it is without: one of which whole
cycles are in most rows would need a torque that no motor has."""
STILL = 0.02
"""Turn in a row, over the largest one, up to which the shaft hardly moves."""
TRIED = 2
"""Numbers of cycles at most."""
NEAR = 0.7
"""Change of log pole up to which waves are good for another motor."""


class Waves:
    """The responses to sin(nθ) and cos(nθ) of a motor with one pole, in the rows of a solver."""

    def __init__(self, solver: Solver, pole_rad_s: float):
        batch, angle = solver.trial.problem.batch, np.asarray(solver.trial.angle)
        shape = np.asarray(batch.volts).shape
        last = np.asarray(batch.piece) != np.roll(np.asarray(batch.piece), -1, axis=1)
        turn = np.where(last, 0.0, np.roll(angle, -1, axis=1) - angle).reshape(-1)
        used = np.flatnonzero(np.asarray(batch.piece).reshape(-1) < solver.trial.problem.pieces)[:ENOUGH_ROWS]
        self.middle, self.turn = (angle.reshape(-1) + 0.5 * turn)[used], turn[used]
        self.rows = np.flatnonzero(np.isin(used, solver.cells, assume_unique=True))
        begins = np.asarray(batch.reset).reshape(-1)[used]
        duration = np.broadcast_to(np.asarray(batch.duration), shape).reshape(-1)[used]
        self.lag = np.where(begins, 0.0, np.exp(-pole_rad_s * duration))
        self.memory = np.where(begins, 0.0, float(solver.trial.memory))
        turns = self.turn[np.abs(self.turn) > STILL * np.abs(self.turn).max(initial=0.0)]
        seen = [n for n in range(LEAST, MOST + 1) if len(turns) and np.mean(_smear(turns, n) ** 2) > SEEN]
        self.numbers = np.array(seen, int)
        parts = [self.numbers[begin : begin + AT_ONCE] for begin in range(0, len(self.numbers), AT_ONCE)]
        self.columns = np.concatenate([np.zeros((len(self.rows), 0)), *map(self._of, parts)], axis=1)

    def _of(self, numbers: np.ndarray) -> np.ndarray:
        """(n, 2 numbers) sine and cosine of each number, one number after the other."""
        phase = self.middle[:, None] * numbers
        smear = _smear(self.turn[:, None], numbers)
        waves = np.stack([np.sin(phase) * smear, np.cos(phase) * smear], axis=2).reshape(len(phase), -1)
        for decay, drive in ((self.lag, 1 - self.lag), (self.memory, np.ones_like(self.memory))):
            keep = np.broadcast_to(decay[:, None], waves.shape)
            waves = keep * states(keep, drive[:, None] * waves, np.zeros(waves.shape[1])) + drive[:, None] * waves
        return waves[self.rows]

    def shares(self, left: np.ndarray) -> np.ndarray:
        """(number,) part of the square of `left` (n,) that the waves of each number take up, both freed of what each
        row has in common with the one before."""
        left = left[: len(self.columns)]
        alike = float(left[1:] @ left[:-1]) / max(square_of(left), 1e-300)
        left, columns = (one[1:] - alike * one[:-1] for one in (left, self.columns))
        pairs = columns.reshape(len(columns), -1, 2)
        along = np.einsum("nkc,n->kc", pairs, left)
        normal = np.einsum("nkc,nkd->kcd", pairs, pairs)
        taken = np.einsum("kc,kc->k", along, solve_balanced(normal, along, DAMPING))
        return taken / max(square_of(left), 1e-300)


def _smear(turn: np.ndarray, cycles: np.ndarray | int) -> np.ndarray:
    """What a mean over a row leaves of a wave while the shaft turns so far [rad]."""
    return np.sinc(turn * cycles / (2 * np.pi))


class Repeats:
    """Numbers of cycles, looked for in what motors of one search leave."""

    def __init__(self, solver: Solver):
        self.solver = solver
        self.waves: list[tuple[float, Waves]] = []
        """By log pole."""

    def of(self, base: Fitted) -> tuple[float, ...]:
        """Numbers of cycles in a turn at which what `base` leaves repeats, the clearest first; none where the angle is
        not known."""
        if self.solver.trial.angle is None:
            return ()
        waves = self._waves(float(base.free[1]))
        shares = waves.shares(without_own(base, base.residual))
        if not len(shares):
            return ()
        order = np.argsort(-shares)[:TRIED]
        return tuple(float(waves.numbers[place]) for place in order if shares[place] > CHANCE * np.median(shares))

    def _waves(self, log_pole: float) -> Waves:
        known = next((waves for near, waves in self.waves if abs(near - log_pole) < NEAR), None)
        if known is None:
            known = Waves(self.solver, math.exp(log_pole))
            self.waves.append((log_pole, known))
        return known
