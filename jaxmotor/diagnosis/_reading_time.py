"""When the rows of a log of counts or angles were read, beside a motor with effects.

Readings y_k that come d after their voltages are as they would be at the voltages with y_k - d y'(t_k), as where the
header states a delay of duties of -d (`at_duty`). The motor is fitted to the log for d - h, d and d + h: a parabola
through the sums of squares S has its least where the rows were read, with the variance 2 v / S'', v that of residuals
in sums over blocks.
"""

import dataclasses
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from jaxmotor.diagnosis._found import FINE
from jaxmotor.diagnosis._solve import Fitted, square_of
from jaxmotor.diagnosis._study import Study, study_of
from jaxmotor.diagnosis._window import LAG
from jaxmotor.estimate import EVIDENCE, MOST_ROWS, Timing
from jaxmotor.motor.effects import OF_LOG

STEP = 0.1
"""h, in rows."""
TOLD = 0.02
"""Rows, from which an offset is told."""
INEXACT = 0.05
"""Standard deviation of the offset, over it, that comes from y': where a voltage has changed it is not the slope of the
rows on either side."""
ROUNDS = 3
"""Times that d is moved to the least, at most."""


class ReadingTime(NamedTuple):
    """What was found."""

    timing: Timing
    study: Study
    """Of readings as they would be at the voltages."""
    linear: Fitted
    fitted: Fitted
    moved_per_s: Float[np.ndarray, " p"]
    """By how much the free numbers of `fitted` move with the offset."""


def reading_time(study: Study, linear: Fitted, fitted: Fitted, begin_s: float = 0.0) -> ReadingTime | None:
    """Of the rows of `study`, by a motor like `fitted`, sought from `begin_s` on; None where it is stated, is that of
    the voltages, or is not told from a lag of the motor."""
    if study.recording.measured == "speed" or study.recording.duty_delay_s is not None or study.timed:
        return None
    if any(effect.family == LAG or isinstance(effect, OF_LOG) for effect in fitted.motor.effects):
        return None
    row_s = study.packed.durations[0]
    most, at = MOST_ROWS * row_s, _around(study, fitted, begin_s, STEP * row_s)
    for _ in range(ROUNDS):
        if not at.bend > 0:
            return None
        offset_s = float(np.clip(at.offset_s - at.rise / at.bend, -most, most))
        is_near = abs(offset_s - at.offset_s) < STEP * row_s
        at = _around(study, at.fitted, offset_s, STEP * row_s)
        if is_near:
            break
    _, still = _read(study, 0.0, at.fitted)
    gain = (square_of(still.residual) - square_of(at.fitted.residual)) / at.fitted.variance
    if not (gain > EVIDENCE and at.bend > 0 and TOLD * row_s < abs(at.offset_s) < most):
        return None
    error_s = float(np.hypot(np.sqrt(2 * at.fitted.variance / at.bend), INEXACT * at.offset_s))
    timing = Timing(at.offset_s, error_s)
    own = at.study.solver.fit(linear.motor, linear, FINE, ties=linear.ties)
    return ReadingTime(timing, at.study, own, at.fitted, at.moved_per_s)


def with_reading(spread: np.ndarray, reading: ReadingTime | None) -> np.ndarray:
    """`spread` (p, p) of the free numbers, wider by what another time of `reading` would move."""
    if reading is None:
        return spread
    return spread + np.outer(reading.moved_per_s, reading.moved_per_s) * reading.timing.standard_error_s**2


class _Around(NamedTuple):
    """The motor at an offset, and how the sum of squares changes there."""

    offset_s: float
    study: Study
    fitted: Fitted
    rise: float
    bend: float
    """First and second derivative of the sum of squares by the offset [1/s, 1/s²]."""
    moved_per_s: np.ndarray


def _around(study: Study, near: Fitted, offset_s: float, step_s: float) -> _Around:
    own, at = _read(study, offset_s, near)
    (_, before), (_, after) = (_read(study, offset_s + way * step_s, at) for way in (-1.0, 1.0))
    below, middle, above = (square_of(one.residual) for one in (before, at, after))
    rise, bend = (above - below) / (2 * step_s), (above - 2 * middle + below) / step_s**2
    return _Around(offset_s, own, at, rise, bend, (after.free - before.free) / (2 * step_s))


def _read(study: Study, offset_s: float, near: Fitted) -> tuple[Study, Fitted]:
    """The motor `near` to one, fitted to the readings of `study` if they came `offset_s` after their voltages."""
    recording = dataclasses.replace(study.recording, duty_delay_s=-offset_s)
    shifted = study_of(recording, study.pole_rad_s, False, study.solver.request, study.packed.observation.noise)
    return shifted, shifted.solver.fit(near.motor, near, FINE, ties=near.ties)
