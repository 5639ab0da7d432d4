"""A recording whose rows were read off the moments at which voltages change: one number, fitted to these data."""

import dataclasses

import jax
import numpy as np

from jaxmotor._precision import to_jax, to_numpy
from jaxmotor.estimate import MOST_ROWS, Model
from jaxmotor.motor import SecondOrder
from jaxmotor.motor.effects import TimingOffset
from jaxmotor.prediction import LAG_S, pack
from jaxmotor.recording import Recording
from jaxmotor.validation._free_simulation import simulate_freely, simulate_model, whole_log

ROUNDS = 4
"""Of the fit of an offset."""
STEP_ROWS = 1e-3
"""Of an offset, over which residuals are differenced."""
ALIKE = 1.02
"""chi2 per sample up to which no offset is looked for."""
SHARE = 0.5
"""Of the unexplained residual that an offset must explain."""


def is_timed(model: Model) -> bool:
    """It holds the timing offset of a recording."""
    return any(isinstance(effect, TimingOffset) for effect in model.effects)


def in_time(model: Model, recording: Recording, segments: tuple[int, ...]) -> tuple[Model, list[str]]:
    """`model` with the timing offset that `segments` of `recording` show, and a note on it.

    Only a linear model, where the header does not state the timing and the offset explains most of what the noise does
    not.
    """
    if model.effects or recording.duty_delay_s is not None or not segments:
        return model, []
    packed = pack(recording, segments, few_shapes=True)
    _, first = simulate_model(model, recording, packed)
    count, floor = packed.batch.valid.sum(), packed.observation.floor if packed.observation.floor_known else 0.0

    def excess(residual: np.ndarray) -> float:
        return float((residual**2).sum() / count - floor)

    if excess(first) < (ALIKE - 1) * floor:
        return model, []
    packed = pack(recording, segments, rest_before=True, few_shapes=True, noise=packed.observation.noise)
    log, row_s = whole_log(model.whole, recording, packed), packed.durations[0]

    def shifted(rows: float) -> Model:
        # A motor without electrical lag sees what it lacks as rows that are read so much earlier.
        lag = 0.0 if isinstance(model.motor, SecondOrder) else LAG_S[0]
        effects = (to_numpy(TimingOffset.of(offset_s=rows * row_s - lag)),)
        return dataclasses.replace(model, effects=effects, effect_errors=({"offset_s": float("nan")},))

    rows = 0.0
    for _ in range(ROUNDS):
        wholes = shifted(rows).whole, shifted(rows + STEP_ROWS).whole
        residual, moved = simulate_freely(jax.tree.map(lambda *leaves: to_jax(np.stack(leaves)), *wholes), log)[1]
        column = (moved - residual) / STEP_ROWS
        rows = float(np.clip(rows - (column * residual).sum() / (column**2).sum(), -MOST_ROWS, MOST_ROWS))
    timed = shifted(rows)
    _, residual = simulate_model(timed, recording, packed)
    if abs(rows) == MOST_ROWS or excess(residual) > (1 - SHARE) * excess(first):
        return model, []
    when = f"{1e3 * abs(rows) * row_s:.3g} ms {'after' if rows > 0 else 'before'} the voltage changes"
    return timed, [f"rows of this recording are read {when}: fitted to these data, and no property of the motor"]
