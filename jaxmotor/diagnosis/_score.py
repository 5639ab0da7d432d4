"""How well a motor with effects does on chosen segments, none of which it need have been fitted to."""

import dataclasses

import numpy as np

from jaxmotor.diagnosis._solve import SPEED_STEP, Solver, square_of
from jaxmotor.estimate import Packed, Trace, traces_of
from jaxmotor.motor import Motor
from jaxmotor.recording import Recording
from jaxmotor.validation import Score, pooled_score

DRAWS = 400


@dataclasses.dataclass(frozen=True, eq=False)
class Scored:
    """Free simulation of a motor against the segments of a solver."""

    score: Score
    """Pooled; chi2 is of the plain observations."""
    drift: float
    """chi2 per sample of residuals that add up over twenty ticks (`_seen.drift`)."""
    by_segment: dict[int, tuple[float, int]]
    """Sum of squared plain residuals over the floor, and the number of samples."""
    traces: tuple[Trace, ...]


def scored(solver: Solver, motor: Motor, recording: Recording, packed: Packed) -> Scored:
    """`motor` on the solver's rows. Pieces that begin in motion begin at the speed that fits them best."""
    speeds = begins(solver, motor)
    residual = solver.residuals([motor], speeds[None], 4)[0]
    plain = solver.plain_of(motor, speeds)
    used = np.zeros(plain.size, bool)
    used[solver.cells] = True
    used = used.reshape(plain.shape)
    only = _only(packed, used)
    floor = packed.observation.floor
    by_segment = {}
    for index in np.unique(only.segment_of[used]).tolist():
        cells = used & (only.segment_of == index)
        by_segment[int(index)] = (float((plain[cells] ** 2).sum() / floor), int(cells.sum()))
    traces = traces_of(only, plain)
    score = pooled_score(recording, only, plain, traces)
    return Scored(score, square_of(residual) / max(len(residual), 1), by_segment, traces)


def begins(solver: Solver, motor: Motor) -> np.ndarray:
    """The initial speed of each piece that fits it best under `motor` [rad/s]; zero where it begins at rest."""
    speeds = np.zeros(solver.pieces)
    for _ in range(2 if solver.free_pieces else 0):
        both = np.stack([speeds, speeds + SPEED_STEP])
        residual, moved = solver.residuals([motor, motor], both, 4)
        column = (moved - residual) / SPEED_STEP
        size = np.bincount(solver.piece, column**2, solver.pieces)
        right = np.bincount(solver.piece, column * residual, solver.pieces)
        speeds = speeds - right / np.where(size > 1e-12, size, np.inf)
    return speeds


def chi2_interval(by_segment: dict[int, tuple[float, int]], seed: int) -> tuple[float, float]:
    """95 % interval of chi2 per sample if the segments had been others of their kind: they are drawn again."""
    squares, counts = (np.array(column, float) for column in zip(*by_segment.values(), strict=True))
    drawn = np.random.default_rng(seed).integers(0, len(squares), (DRAWS, len(squares)))
    low, high = np.quantile(squares[drawn].sum(1) / counts[drawn].sum(1), [0.025, 0.975])
    return float(low), float(high)


def _only(packed: Packed, used: np.ndarray) -> Packed:
    lanes = packed.lanes._replace(valid=used)
    return dataclasses.replace(packed, lanes=lanes)
