"""The noise of one reading: known of counts, estimated of angles and speeds. Numpy only.

Of counts it is the rounding. Of other logs it is what the voltages do not explain (`_flexible_model`), never less than
the step of the readings, where they have one. It may be coloured. What of it is new in each row comes from an
autoregression e_k = Σ a_i e_{k-i} + w_k, of the order that BIC asks for; its spectrum at zero over its variance,
σ_w² / (1 - Σ a_i)² / σ², says how many rows together are worth one independent reading.
"""

import dataclasses
from typing import Any, Literal

import numpy as np

from jaxmotor.prediction._autoregression import autoregression
from jaxmotor.prediction._flexible_model import LogRows, flexible_model
from jaxmotor.recording import LogUnit, Recording, log_unit

FEWEST = 20
"""Differences of values that make a grid."""
FEWEST_REPEATED = 8
"""The same where the values come again."""
MOST_ROWS = 1000.0
"""Rows that one independent reading may take: more cannot be told from a drift."""


@dataclasses.dataclass(frozen=True)
class Noise:
    """The error of one reading. Angles and counts are read as the turn from one row to the next."""

    measured: Literal["count", "angle", "speed"]
    level: float
    """Standard deviation on rows that move [rad, or rad/s of speeds]."""
    row_to_row: float
    """Part of it that is new in each row [as `level`]."""
    rows_per_reading: float
    """Rows that together are worth one independent reading; 1 of white noise, less where neighbours' errors cancel."""
    step: float | None
    """Step of the grid that the readings lie on [as `level`]; None where there is none."""
    known: bool
    """It follows from the encoder; otherwise it was estimated."""
    unit: LogUnit
    """Of the log."""


def rounding(recording: Recording) -> Noise:
    """Of counts: a difference of two has the mean variance 1/6."""
    unit = log_unit(recording)
    spread = float(unit.si / np.sqrt(6))
    return Noise("count", spread, spread, 0.0, unit.si, True, unit)


def unknown(recording: Recording) -> Noise:
    """Before the rows have been seen."""
    return Noise(recording.measured, np.nan, np.nan, np.nan, None, False, log_unit(recording))


def estimated(recording: Recording, segments: tuple[int, ...], rows: LogRows) -> Noise:
    """Of the `segments` of a log of angles or speeds, all of whose speeds are `rows`."""
    is_angle = recording.measured == "angle"
    chosen = [recording.segments[index] for index in segments]
    columns = [segment.shaft[segment.read] for segment in chosen]
    per_row = float(np.median(rows.duration[rows.valid])) if is_angle else 1.0
    step = common_step(columns)
    flexible = flexible_model(rows)
    innovation, ratio = _colour(rows, flexible.residual)
    least = max(1e-9 * float(np.ptp(rows.speed[rows.valid], axis=0)), 1e-300)
    level = max(flexible.level, least, rounding_level(step, rows.turn) / per_row)
    new = min(max(innovation, least), level)
    return Noise(recording.measured, level * per_row, new * per_row, ratio, step, False, log_unit(recording))


def lowered(noise: Noise, share: float, turn: bool) -> Noise:
    """`noise` that was estimated, of which a motor leaves but a `share` of the mean square; at least what the step of
    readings makes of it, which are `turn`s or not."""
    level = max(noise.level * float(np.sqrt(share)), rounding_level(noise.step, turn))
    return dataclasses.replace(noise, level=level, row_to_row=min(noise.row_to_row, level))


def rounding_level(step: float | None, turn: bool) -> float:
    """Standard deviation of readings rounded to this `step`, 0 without one. A difference of two, which a turn is, has
    twice the variance of one."""
    return 0.0 if step is None else float(step / np.sqrt(6 if turn else 12))


def noise_to_json(noise: Noise) -> dict[str, Any]:
    """`noise` in the log's unit, and its level in SI."""
    si = "rad_s" if noise.measured == "speed" else "rad"
    of_log = {name: getattr(noise, name) for name in ("level", "row_to_row", "step")}
    return {
        "of": "each speed" if noise.measured == "speed" else "the turn from row to row",
        "known": noise.known,
        "unit": noise.unit.name,
        **{name: None if value is None else value / noise.unit.si for name, value in of_log.items()},
        "rows_per_reading": noise.rows_per_reading,
        f"level_{si}": noise.level,
    }


def common_step(columns: list[np.ndarray]) -> float | None:
    """`grid_step` of the column that holds the middle row when columns are in its order.

    Columns may come from several logs, each with its own digits; a constant one, a steady state, has none.
    """
    own = sorted((grid_step(column) or 0.0, len(column)) for column in columns if np.ptp(column) > 0)
    if not own:
        return None
    rows = np.cumsum([size for _, size in own])
    return own[int(np.searchsorted(rows, rows[-1] / 2))][0] or None


def grid_step(values: np.ndarray) -> float | None:
    """Step of the grid that all `values` lie on, in their unit; None where they lie on none.

    A grid of so many decimals is that of the text, unless its values come again and again.
    """
    distinct = np.unique(values)
    away = distinct - distinct[0]
    steps = np.diff(distinct)
    # Equal numbers may be written with other last digits.
    steps = steps[steps > 1e-6 * away[-1]]
    if len(steps) < FEWEST_REPEATED:
        return None
    repeated = distinct.size < 0.5 * values.size
    for first in np.quantile(steps, [0.0, 0.02, 0.1, 0.25, 0.5], method="lower"):
        step = _refined(float(first), away)
        off = np.abs(away / step - np.round(away / step))
        # Values that lie on no grid are off by a quarter in the mean.
        if np.quantile(off, 0.99) < 0.2 and off.mean() < 0.06:
            return step if repeated or (len(steps) >= FEWEST and not _is_decimal(step)) else None
    return None


def _refined(step: float, away: np.ndarray) -> float:
    """`step` by least squares from values ever farther `away`, so that no multiple is miscounted."""
    reach = 3 * step
    while True:
        near = away[away <= reach]
        multiple = np.round(near / step)
        square = float(multiple @ multiple)
        step = float(multiple @ near) / square if square else step
        if reach >= away[-1]:
            return step
        reach *= 2


def _is_decimal(step: float) -> bool:
    """1, 2 or 5 of some decimal place, in SI, degrees or revolutions."""
    units = np.array([step, np.degrees(step), step / (2 * np.pi)])
    place = np.log10(units[:, None] / np.array([1.0, 2.0, 5.0]))
    return bool((np.abs(place - np.round(place)) < 1e-3).any())


def _colour(rows: LogRows, residual: np.ndarray) -> tuple[float, float]:
    """Standard deviation of what is new in each row, in the unit of `residual`, and the rows per reading."""
    found = autoregression(residual, rows.piece, rows.counts)
    if found.variance == 0:
        return 0.0, 1.0
    ratio = found.variance / max((1 - found.weights.sum()) ** 2, 1e-12) / found.whole
    return float(np.sqrt(found.variance)), float(min(ratio, MOST_ROWS))
