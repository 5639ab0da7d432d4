"""How well a motor with effects does on chosen segments, none of which it need have been fitted to."""

import dataclasses
import functools

import numpy as np

from jaxmotor.diagnosis._free import together
from jaxmotor.diagnosis._solve import Solver, square_of
from jaxmotor.estimate import Trace, floors, traces_of
from jaxmotor.motor import Motor
from jaxmotor.prediction import Packed, fit_initial_speeds
from jaxmotor.recording import Recording
from jaxmotor.validation import Score, score_of

DRAWS = 400
"""Of segments, for intervals."""


@dataclasses.dataclass(frozen=True, eq=False)
class Scored:
    """Free simulation of a motor against the segments of a solver."""

    score: Score
    """Pooled; chi2 is of the plain observations."""
    drift: float
    """chi2 per sample of residuals that add up over twenty ticks (`_residuals.drift`)."""
    by_segment: dict[int, tuple[float, float]]
    """Sum of squared plain residuals, and what rounding alone would make it [units²]."""
    traces: tuple[Trace, ...]


def scored(
    solver: Solver, motor: Motor, recording: Recording, packed: Packed, speeds: np.ndarray | None = None
) -> Scored:
    """`motor` on the solver's rows. Pieces that begin in motion begin at the speed that fits them best, sought from
    `speeds` (k,) [rad/s] or from what their first rows show."""
    speeds = begins(solver, motor, speeds)
    plain, residual = solver.residual_of(motor, speeds)
    used = np.zeros(plain.size, bool)
    used[solver.cells] = True
    used = used.reshape(plain.shape)
    only = _only(packed, used)
    floor = floors(only, plain)
    by_segment = {}
    for index in np.unique(only.segment_of[used]).tolist():
        cells = used & (only.segment_of == index)
        by_segment[int(index)] = (float((plain[cells] ** 2).sum()), float(floor[cells].sum()))
    traces = traces_of(only, plain)
    score = score_of(recording, only, plain, traces)
    return Scored(score, square_of(residual) / max(len(residual), 1), by_segment, traces)


def begins(solver: Solver, motor: Motor, speeds: np.ndarray | None = None) -> np.ndarray:
    """How each piece begins under `motor`: at the speed that fits it best [rad/s], or at rest; and with the place of a
    load within its gap that does."""
    found = solver.starts if speeds is None else speeds
    if solver.free_pieces:
        of_pair = functools.partial(solver.residuals, together([motor, motor]))
        [found] = fit_initial_speeds(of_pair, found[None], solver.piece, solver.moves)
    return solver.placed(motor, found)


def chi2_interval(by_segment: dict[int, tuple[float, float]], seed: int) -> tuple[float, float]:
    """95 % interval of chi2 per sample if the segments had been others of their kind: they are drawn again."""
    squares, floor = (np.array(column, float) for column in zip(*by_segment.values(), strict=True))
    drawn = _drawn(len(squares), seed)
    floor = floor[drawn].sum(1)
    return _limits(squares[drawn].sum(1) / np.where(floor > 0, floor, np.nan))


def speed_intervals(traces: tuple[Trace, ...], seed: int) -> tuple[tuple[float, float], tuple[float, float]]:
    """The same of the RMSE [rad/s] and of the fit [%] of `traces`."""
    off, size, count = np.zeros((3, max((trace.segment for trace in traces), default=-1) + 1))
    speeds = np.concatenate([trace.measured_rad_s for trace in traces]) if traces else np.zeros(1)
    for trace in traces:
        off[trace.segment] += np.sum(trace.residual_rad_s**2)
        size[trace.segment] += np.sum((trace.measured_rad_s - speeds.mean()) ** 2)
        count[trace.segment] += len(trace.measured_rad_s)
    used = count > 0
    if not used.any():
        nothing = float("nan"), float("nan")
        return nothing, nothing
    off, size, count = (column[used] for column in (off, size, count))
    drawn = _drawn(len(off), seed)
    rmse = np.sqrt(off[drawn].sum(1) / count[drawn].sum(1))
    varies = np.where(size[drawn].sum(1) > 0, size[drawn].sum(1), np.nan)
    return _limits(rmse), _limits(100 * (1 - np.sqrt(off[drawn].sum(1) / varies)))


def _drawn(number: int, seed: int) -> np.ndarray:
    return np.random.default_rng(seed).integers(0, number, (DRAWS, number))


def _limits(values: np.ndarray) -> tuple[float, float]:
    known = values[np.isfinite(values)]
    if not known.size:
        return float("nan"), float("nan")
    low, high = np.quantile(known, [0.025, 0.975])
    return float(low), float(high)


def _only(packed: Packed, used: np.ndarray) -> Packed:
    batch = packed.batch._replace(valid=used)
    return dataclasses.replace(packed, batch=batch)
