"""Measured and simulated speed, row by row, and the score of a free simulation."""

import numpy as np

from jaxmotor.estimate._fit import Trace
from jaxmotor.estimate._lanes import Packed


def traces_of(packed: Packed, residual: np.ndarray) -> tuple[Trace, ...]:
    """One trace for each segment of `packed`; `residual` (lane, row) is measured minus simulated [units]."""
    lanes, observation = packed.lanes, packed.observation
    duration = np.broadcast_to(lanes.duration, lanes.volts.shape)
    per_second = (
        observation.unit / duration if observation.kind == "turn" else np.full(duration.shape, observation.unit)
    )
    traces = []
    for segment in np.unique(packed.segment_of[lanes.valid]):
        cells = np.nonzero((packed.segment_of == segment) & lanes.valid)
        order = np.argsort(packed.row_of[cells], kind="stable")
        cells = tuple(axis[order] for axis in cells)
        measured = lanes.observed[cells] * per_second[cells]
        simulated = measured - residual[cells] * per_second[cells]
        traces.append(Trace(int(segment), packed.time_s[cells], measured, simulated))
    return tuple(traces)


def fit_percent(traces: tuple[Trace, ...]) -> float:
    """100 (1 - |y - ŷ|/|y - mean y|) over all rows of `traces`; NaN where the speed never changes."""
    measured = np.concatenate([trace.measured_rad_s for trace in traces])
    simulated = np.concatenate([trace.simulated_rad_s for trace in traces])
    spread = np.linalg.norm(measured - measured.mean())
    if spread <= 1e-9 * np.linalg.norm(measured):
        return float("nan")
    return float(100 * (1 - np.linalg.norm(measured - simulated) / spread))
