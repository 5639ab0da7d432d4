"""Over how long the speeds of a log were averaged, fitted with the effects of its motor.

`identify` finds that beside a linear motor, if that explains the rest. Where it does not, the window W is one more
number of every motor that is tried (`SpeedWindow`), so that no effect is taken for it, nor it for an effect. It is the
log's if blocks of rows that are left out do not prefer the motor without it, nor that with a delay and a lag in its
place, to the motor that was found, with it. What shows in few blocks only counts where it takes up `LEAST` of what is
left, and has a lesser

    n' ln S + k ln n'

with S the mean square of the residual, k the number of parameters, n' the rows over those that one independent reading
takes (`Noise.rows_per_reading`).
"""

import dataclasses
import math
from typing import NamedTuple

import numpy as np

from jaxmotor._balanced import solve_balanced
from jaxmotor.diagnosis._found import COARSE, LEAST
from jaxmotor.diagnosis._free import OWN, with_effect, without_effect
from jaxmotor.diagnosis._request import Request
from jaxmotor.diagnosis._solve import DAMPING, Fitted, Solver, square_of
from jaxmotor.diagnosis._study import Study, study_of
from jaxmotor.diagnosis._trial import of_means, rig_of
from jaxmotor.diagnosis._visited import EQUAL, FAR, Visited
from jaxmotor.estimate import UNSURE, SpeedAverage, longest_average_s
from jaxmotor.motor import Motor
from jaxmotor.motor.effects import (
    ElectricalPole,
    SensorLag,
    SpeedWindow,
    TransportDelay,
    free_size,
)
from jaxmotor.recording import Recording

LONGEST_ROWS = 20
"""Rows after the begin of a piece in motion that do not count: windows may begin before it."""
KEPT = 2 / 3
"""Part of a piece that counts at least."""
LAG = "lag"
"""The family of effects that a window may be mistaken for."""


def is_stated(recording: Recording) -> bool:
    """The header of `recording` says how its readings were made."""
    return recording.measured != "speed" or recording.speed_window_s is not None


def beside_window(
    recording: Recording, linear: Fitted, known: SpeedAverage | None, request: Request
) -> tuple[Study, Fitted]:
    """`recording`, whose speeds are means over a window that is not stated, and its `linear` motor with the window that
    leaves least: sought from the `known` one, or from several."""
    study = _unstated(recording, linear, request)
    rig = rig_of(study.recording, study.trial)
    starts = [float(start.length_s) for start in SpeedWindow.starts(rig)]
    lengths = [length for length in starts if length < longest_average_s(rig.period_s)]
    fits = [_fitted(study, linear, length) for length in ([known.length_s] if known is not None else lengths)]
    return study, min(fits, key=lambda one: one.chi2)


def window_beside(
    recording: Recording, found: Fitted, known: SpeedAverage, request: Request
) -> tuple[SpeedAverage | None, bool]:
    """The window of `recording` with the effects of `found`, which were found with the `known` one, None where it is
    within its error of none; and whether it differs from that by more than its error."""
    study = _unstated(recording, found, request)
    better = average_of(study, _fitted(study, found, known.length_s))
    moved = abs(better.length_s - known.length_s) > better.standard_error_s
    return (better if better.length_s > 1.96 * better.standard_error_s else None), moved


def is_window(study: Study, found: Fitted, visited: Visited) -> bool:
    """The readings of `study` are means over the window that `found` has: nothing in its place explains them better, as
    those that a search has `visited` are judged."""
    bare, length = without_effect(found.motor, SpeedWindow.name), window_s(found)
    lagless = bare
    for effect in bare.effects:
        lagless = without_effect(lagless, effect.name) if effect.family == LAG else lagless
    delayed = with_effect(lagless, TransportDelay.of(delay_s=length / 4))
    others = [bare, *(with_effect(delayed, lag.of(time_constant_s=length / 4)) for lag in (SensorLag, ElectricalPole))]
    bar = FAR * found.chi2
    fits = [study.solver.fit(other, found, COARSE, bar=bar) for other in others]
    return _is_as_good(study, found, fits, visited)


def is_average(study: Study, found: Fitted) -> bool:
    """The window that `found` has, with its error, is no longer than speeds are averaged over: a longer one is the
    motor's, and one that may be as long is not shown by the log."""
    most_s = window_s(found) + 1.96 * _slope(found).error_s(study, found)
    return most_s < longest_average_s(float(np.median(study.packed.durations)))


def does_as_well(study: Study, windowed: Fitted, late: Motor, visited: Visited) -> bool:
    """The motor `windowed`, whose speeds are means, predicts the readings of `study` about as well as the motor `late`,
    whose speeds are none."""
    return _is_as_good(study, windowed, [study.solver.fit(late, windowed, COARSE)], visited)


def _is_as_good(study: Study, found: Fitted, others: list[Fitted], visited: Visited) -> bool:
    def is_better(other: Fitted) -> bool:
        return other.chi2 < (1 - LEAST) * found.chi2 and _cost(study, other) < _cost(study, found)

    return visited.odds(found, others) > EQUAL and not any(map(is_better, others))


def _cost(study: Study, one: Fitted) -> float:
    number = len(one.residual) / max(study.packed.observation.noise.rows_per_reading, 1.0)
    size = sum(map(free_size, one.template.effects))
    return number * math.log(max(one.chi2, 1e-300)) + size * math.log(max(number, 1.0))


def average_of(study: Study, fitted: Fitted) -> SpeedAverage:
    """The window that `fitted` has, with its error, and what gain and pole move by with it."""
    slope, motor = _slope(fitted), fitted.motor.linear
    length_s, period_s = window_s(fitted), float(np.median(study.packed.durations))
    error = slope.error_s(study, fitted)
    return SpeedAverage(
        "window",
        length_s,
        error,
        length_s / 2,
        error / 2,
        length_s > period_s and 1.96 * error < UNSURE * length_s,
        float(motor.gain * slope.moved[0]),
        float(motor.pole * slope.moved[1]),
    )


def _unstated(recording: Recording, near: Fitted, request: Request) -> Study:
    """`recording` without the rows whose windows may begin before a piece that begins in motion."""
    study = study_of(recording, float(near.motor.linear.pole), request=request)
    batch, rows = study.packed.batch, np.ones(study.trial.valid.shape, bool)
    for sequence, first in zip(*np.nonzero(batch.free), strict=True):
        own = np.flatnonzero(batch.piece[sequence] == batch.piece[sequence, first])
        rows[sequence, own[: min(LONGEST_ROWS, int((1 - KEPT) * len(own)))]] = False
    trial = of_means(study.trial)
    request.seeks_window = True
    return dataclasses.replace(
        study, trial=trial, solver=Solver(trial, rows, study.solver.noise_known, request, study.solver.rig)
    )


def _fitted(study: Study, near: Fitted, length_s: float) -> Fitted:
    """The motor of `near` with a window, fitted from that `length_s`."""
    return study.solver.fit(with_window(near.motor, length_s), near, COARSE)


def with_window(motor: Motor, length_s: float) -> Motor:
    """`motor`, whose speeds are seen as means over `length_s`."""
    return with_effect(motor, SpeedWindow.of(length_s=length_s))


def window_s(fitted: Fitted) -> float:
    """The length of the window that `fitted` has."""
    return float(_place(fitted.motor)[0].length_s)


def _place(motor: Motor) -> tuple[SpeedWindow, int]:
    """The window of `motor`, and which of the free numbers it is."""
    at = OWN
    for effect in motor.effects:
        if isinstance(effect, SpeedWindow):
            return effect, at
        at += free_size(effect)
    raise ValueError("the motor has no window of speeds")


class _Slope(NamedTuple):
    """What a longer window changes. n rows, p free numbers of the motor but the window."""

    own: np.ndarray
    """(n,) of the residual, beside what the motor takes up of that [standard deviations/s]."""
    moved: np.ndarray
    """(p,) of the free numbers [1/s]."""

    def error_s(self, study: Study, fitted: Fitted) -> float:
        """Of the window of `fitted` [s]: by blocks, and never less than by its rows alone."""
        pulls = np.bincount(study.solver.block, self.own * fitted.residual)
        per_reading = max(study.packed.observation.noise.rows_per_reading, 1.0)
        least = square_of(self.own) * fitted.chi2 * per_reading
        return math.sqrt(max(square_of(pulls), least)) / max(square_of(self.own), 1e-300)


def _slope(fitted: Fitted) -> _Slope:
    window, at = _place(fitted.motor)
    rest = np.delete(fitted.jacobian, at, axis=1)
    column = fitted.jacobian[:, at] / float(window.length_s)
    spread = np.delete(fitted.layout.spread, at)
    normal = np.einsum("np,nq->pq", rest, rest) + np.diag(1 / spread**2)
    moved = -solve_balanced(normal, np.einsum("np,n->p", rest, column), DAMPING)
    return _Slope(column + np.einsum("np,p->n", rest, moved), moved)
