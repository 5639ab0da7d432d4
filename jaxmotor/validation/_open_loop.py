"""Open loop: the model simulated freely under the voltage that was logged."""

import numpy as np

from jaxmotor.estimate import Model, Trace, chi2_per_sample, fit_percent, traces_of
from jaxmotor.motor.effects import LogFilter
from jaxmotor.prediction import Packed, log_rows, pack, pieces_of, without_transients
from jaxmotor.recording import Recording
from jaxmotor.validation._free_simulation import simulate_model
from jaxmotor.validation._timed import is_timed
from jaxmotor.validation._validation import OpenLoop, Score


def score_open_loop(model: Model, recording: Recording, segments: tuple[int, ...]) -> OpenLoop:
    """Scores of `segments`, pooled and one by one.

    Nothing of the motor is fitted. A piece that begins in motion, or after lost ticks, begins at the speed that fits
    it best: one number for each. The model's voltage offset counts as part of the rig.
    """
    packed = pack(recording, segments, rest_before=is_timed(model), few_shapes=True)
    if model.effects:
        filters = [float(effect.time_constant_s) for effect in model.effects if isinstance(effect, LogFilter)]
        packed = without_transients(recording, packed, max(filters, default=0.0))
    _, residual = simulate_model(model, recording, packed)
    scored = np.unique(packed.segment_of[packed.batch.valid])
    free = packed.segment_of[packed.batch.free > 0]
    traces = traces_of(packed, residual)
    return OpenLoop(
        pooled=score_of(recording, packed, residual, traces),
        segments={
            int(index): score_of(recording, packed, residual, (trace,), int(index))
            for index, trace in zip(scored, traces, strict=True)
        },
        initial_speed_estimated=tuple(int(index) for index in np.unique(free)),
        floor_known=packed.observation.floor_known,
        traces=traces,
    )


def initial_speed(model: Model, recording: Recording, segment: int) -> float:
    """Speed [rad/s] at the first row of `segment` that fits its first piece best under the logged voltage."""
    packed = pack(recording, (segment,), few_shapes=True)
    speeds, _ = simulate_model(model, recording, packed)
    return float(speeds[0])


def has_pieces(recording: Recording, segment: int) -> bool:
    """Two rows of `segment` follow each other without a lost tick, and say something of the speed."""
    return bool(pieces_of(recording, segment)) and bool(log_rows(recording, (segment,)).valid.any())


def score_of(
    recording: Recording, packed: Packed, residual: np.ndarray, traces: tuple[Trace, ...], segment: int | None = None
) -> Score:
    """Of all rows of `packed`, or of one segment's; `residual` (sequence, row) is measured minus simulated [units]."""
    cells = packed.batch.valid if segment is None else packed.batch.valid & (packed.segment_of == segment)
    square = float((residual[cells] ** 2).mean())
    off = np.concatenate([trace.residual_rad_s for trace in traces])
    return Score(
        samples=int(cells.sum()),
        fit_percent=fit_percent(traces),
        rmse_rad_s=float(np.sqrt((off**2).mean())),
        rmse_counts=float(np.sqrt(square)) if recording.measured == "count" else float("nan"),
        chi2_per_sample=chi2_per_sample(packed, residual, cells),
    )
