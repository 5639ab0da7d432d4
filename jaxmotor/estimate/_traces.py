"""Measured and simulated motion, row by row, and the scores of a free simulation."""

import itertools

import numpy as np

from jaxmotor.estimate._fit import Trace
from jaxmotor.prediction import Packed

LEAST = 0.02
"""Of the mean rounding error: a floor is not taken to be lower."""
AT_REST = 1e-6
"""Units of a reading that are no motion."""


def traces_of(packed: Packed, residual: np.ndarray) -> tuple[Trace, ...]:
    """One trace for each segment of `packed`; `residual` (sequence, row) is measured minus simulated [units]."""
    batch, observation = packed.batch, packed.observation
    cells = np.nonzero(batch.valid)
    order = np.lexsort((packed.row_of[cells], packed.segment_of[cells]))
    cells = tuple(axis[order] for axis in cells)
    segment, time = packed.segment_of[cells], packed.time_s[cells]
    per_second = observation.unit
    if observation.kind == "turn":
        per_second = observation.unit / np.broadcast_to(batch.duration, batch.volts.shape)[cells]
    measured = batch.observed[cells] * per_second
    simulated = measured - residual[cells] * per_second
    bounds = [0, *(np.flatnonzero(segment[1:] != segment[:-1]) + 1).tolist(), len(segment)]
    return tuple(
        Trace(int(segment[begin]), time[begin:end], measured[begin:end], simulated[begin:end])
        for begin, end in itertools.pairwise(bounds)
        if end > begin
    )


def fit_percent(traces: tuple[Trace, ...]) -> float:
    """100 (1 - |y - ŷ|/|y - mean y|) over all rows of `traces`; NaN where the speed never changes."""
    return _percent([(trace.measured_rad_s, trace.simulated_rad_s) for trace in traces])


def angle_fit_percent(traces: tuple[Trace, ...]) -> float:
    """100 (1 - |y - ŷ|/|y - mean y|) of the angle turned since each of `traces` began; NaN where it never changes."""
    return _percent([_turned(trace) for trace in traces])


def _percent(pairs: list[tuple[np.ndarray, np.ndarray]]) -> float:
    """Of measured and simulated values together, all `pairs` of them."""
    measured, simulated = np.concatenate(pairs, axis=1) if pairs else np.zeros((2, 0))
    spread = np.linalg.norm(measured - measured.mean()) if measured.size else 0.0
    if spread <= 1e-9 * np.linalg.norm(measured):
        return float("nan")
    return float(100 * (1 - np.linalg.norm(measured - simulated) / spread))


def _turned(trace: Trace) -> tuple[np.ndarray, np.ndarray]:
    if len(trace.time_s) < 2:
        return np.zeros(0), np.zeros(0)
    each = np.diff(trace.time_s)
    # A row that lost ticks follow counts for itself.
    each = np.append(np.minimum(each, 1.5 * np.median(each)), np.median(each))
    return np.cumsum(trace.measured_rad_s * each), np.cumsum(trace.simulated_rad_s * each)


def chi2_per_sample(packed: Packed, residual: np.ndarray, cells: np.ndarray) -> float:
    """Mean square of `residual` [units] in the chosen `cells` (sequence, row), over that of the encoder alone."""
    # A motor that hardly ever moves shows hardly anything of its encoder.
    least = LEAST * packed.observation.floor * int(cells.sum())
    return float((residual[cells] ** 2).sum() / max(floors(packed, residual)[cells].sum(), least))


def floors(packed: Packed, residual: np.ndarray) -> np.ndarray:
    """(sequence, row) variance that each `residual` would have if the motor did exactly what the model says [units²].

    A turn of n + f counts, n whole and 0 <= f < 1, is seen as n or n + 1: with the variance f (1 - f), which is 1/6
    in the mean over f, but 0 at rest and anything up to 1/4 at a constant speed. Where the noise was estimated, it is
    that of rows that move; where the reading is at rest and the model within a unit of it there is none.
    """
    observation = packed.observation
    observed = np.asarray(packed.batch.observed)
    turn = observed - residual
    if observation.kind != "turn" or not observation.floor_known:
        rests = (np.abs(observed) < AT_REST) & (np.abs(turn) < 1.0)
        return np.where(rests, 0.0, observation.floor)
    part = turn - np.floor(turn)
    return part * (1 - part)
