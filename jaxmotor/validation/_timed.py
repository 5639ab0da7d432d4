"""A recording whose rows were read off the moments at which voltages change: one number, fitted to these data."""

import dataclasses

import jax.numpy as jnp
import numpy as np

from jaxmotor._precision import to_numpy
from jaxmotor.estimate import MOST_ROWS, Model
from jaxmotor.motor import SecondOrder
from jaxmotor.motor.effects import TimingOffset
from jaxmotor.prediction import LAG_S, as_problem, pack
from jaxmotor.recording import Recording
from jaxmotor.validation._draws import psi_of
from jaxmotor.validation._follow import follow

ROUNDS = 4
STEP_ROWS = 1e-3
ALIKE = 1.02
"""chi2 per sample up to which no offset is looked for."""
SHARE = 0.5
"""Of what is left over that an offset must explain."""


def is_timed(model: Model) -> bool:
    """It holds the timing offset of a recording."""
    return any(isinstance(effect, TimingOffset) for effect in model.effects)


def in_time(model: Model, recording: Recording, segments: tuple[int, ...]) -> tuple[Model, list[str]]:
    """`model` with the timing offset that `segments` of `recording` show, and a note on it.

    Only a linear model, where the header does not state the timing and the offset explains most of what is left over.
    """
    if model.effects or recording.duty_delay_s is not None or not segments:
        return model, []
    packed = pack(recording, segments, rest_before=True)
    problem, row_s = as_problem(packed, timed=True), packed.durations[0]
    count, floor = packed.lanes.valid.sum(), packed.observation.floor if packed.observation.floor_known else 0.0

    def off(rows: float) -> np.ndarray:
        return np.asarray(follow(problem, jnp.asarray(np.append(psi_of(model), rows)))[1])

    def excess(residual: np.ndarray) -> float:
        return float((residual**2).sum() / count - floor)

    rows, first = 0.0, off(0.0)
    if excess(first) < (ALIKE - 1) * floor:
        return model, []
    residual = first
    for _ in range(ROUNDS):
        column = (off(rows + STEP_ROWS) - residual) / STEP_ROWS
        rows = float(np.clip(rows - (column * residual).sum() / (column**2).sum(), -MOST_ROWS, MOST_ROWS))
        residual = off(rows)
    if abs(rows) == MOST_ROWS or excess(residual) > (1 - SHARE) * excess(first):
        return model, []
    # A motor without electrical lag sees what it lacks as rows that are read so much earlier.
    offset = rows * row_s - (0.0 if isinstance(model.motor, SecondOrder) else LAG_S[0])
    effects = (to_numpy(TimingOffset.of(offset_s=offset)),)
    when = f"{1e3 * abs(rows) * row_s:.3g} ms {'after' if rows > 0 else 'before'} the voltage changes"
    note = f"rows of this recording are read {when}: fitted to these data, and no property of the motor"
    return dataclasses.replace(model, effects=effects, effect_errors=({"offset_s": float("nan")},)), [note]
