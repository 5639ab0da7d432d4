"""Over how long the speeds of a log were averaged, found with the effects of its motor.

`identify` finds that beside a linear motor, if that explains the rest. Where it does not, the search has taken the
window for lags of the motor. Here these are left out, and a window W is fitted beside the other effects; of both the
one with the least

    n' ln S + k ln n'

is taken, S the mean square, k the number of parameters (of the lags, or one), n' the rows over those that one
independent reading takes (`Noise.rows_per_reading`).
"""

import functools
import math
from typing import NamedTuple

import numpy as np

from jaxmotor._balanced import solve_balanced
from jaxmotor.diagnosis._found import COARSE
from jaxmotor.diagnosis._free import without_effect
from jaxmotor.diagnosis._request import Request
from jaxmotor.diagnosis._solve import DAMPING, Fitted
from jaxmotor.diagnosis._study import Study, study_of
from jaxmotor.estimate import UNSURE, SpeedAverage, with_window
from jaxmotor.motor import Motor
from jaxmotor.motor.effects import OF_LOG, free_size
from jaxmotor.prediction import Noise
from jaxmotor.recording import Recording

ROWS = (1.0, 1.6, 2.5, 4.0, 6.0, 9.0, 13.0, 20.0)
"""Windows from which the best one is sought."""
LAG = "lag"
"""The family of effects that a window may be mistaken for."""
CLOSER = 3
"""Times that the best window is sought among its neighbours."""
STEP = 0.02
"""Part of a window over which residuals are differenced."""


class Windowed(NamedTuple):
    """A motor fitted to readings over one window."""

    window_s: float
    study: Study
    fitted: Fitted


def window_beside(recording: Recording, study: Study, found: Fitted, enough: float = math.inf) -> SpeedAverage | None:
    """The window of `recording`, of speeds whose average is not stated, with the effects of `found`; None where their
    lags explain the readings as well, or where more than `enough` (chi2 per sample) is left."""
    motor = found.motor
    lags = [effect for effect in motor.effects if effect.family == LAG or isinstance(effect, OF_LOG)]
    for effect in lags:
        motor = without_effect(motor, effect.name)
    noise = study.packed.observation.noise
    fit = functools.partial(_windowed, recording, motor, found.speeds, noise)
    period_s = float(np.median(study.packed.durations))
    best = _closer(fit, [fit(rows * period_s) for rows in ROWS])
    number = len(found.residual) / max(noise.rows_per_reading, 1.0)
    parameters = sum(map(free_size, lags))
    gain = number * math.log(found.chi2 / best.fitted.chi2)
    if gain + (parameters - 1) * math.log(number) <= 0 or best.fitted.chi2 > enough:
        return None
    return _average(recording, best, period_s)


def _windowed(recording: Recording, motor: Motor, speeds: np.ndarray, noise: Noise, window_s: float) -> Windowed:
    study = _over(recording, motor, noise, window_s)
    own = speeds if len(speeds) == len(study.solver.starts) else None
    return Windowed(window_s, study, study.solver.fit(motor, own, COARSE))


def _over(recording: Recording, motor: Motor, noise: Noise, window_s: float) -> Study:
    """`recording` of speeds over that window, in the same unit whatever it is."""
    return study_of(with_window(recording, window_s), float(motor.linear.pole), request=Request(), noise=noise)


def _closer(fit, tried: list[Windowed]) -> Windowed:
    """The best of `tried` and of windows between its neighbours."""
    for _ in range(CLOSER):
        tried.sort(key=lambda one: one.window_s)
        at = min(range(len(tried)), key=lambda k: tried[k].fitted.chi2)
        if not 0 < at < len(tried) - 1:
            break
        near = tried[at - 1 : at + 2]
        curve = np.polyfit([one.window_s for one in near], [one.fitted.chi2 for one in near], 2)
        lowest = float(-curve[1] / (2 * curve[0]))
        if not near[0].window_s < lowest < near[2].window_s:
            break
        tried.append(fit(lowest))
    return min(tried, key=lambda one: one.fitted.chi2)


def _average(recording: Recording, best: Windowed, period_s: float) -> SpeedAverage:
    """`best` with its error (by blocks), and what gain and pole move by with the window."""
    fitted, solver, window_s = best.fitted, best.study.solver, best.window_s
    sides = [_residuals(recording, best, share * window_s) for share in (1 - STEP, 1 + STEP)]
    column = np.nan_to_num((sides[1] - sides[0]) / (2 * STEP * window_s))
    normal = np.einsum("np,nq->pq", fitted.jacobian, fitted.jacobian) + np.diag(1 / fitted.layout.spread**2)
    moved = -solve_balanced(normal, np.einsum("np,n->p", fitted.jacobian, column), DAMPING)
    own = column + np.einsum("np,p->n", fitted.jacobian, moved)
    pulls = np.bincount(solver.block, own * fitted.residual)
    error = math.sqrt(float(pulls @ pulls)) / float(own @ own)
    motor = fitted.motor.linear
    return SpeedAverage(
        "window",
        window_s,
        error,
        window_s / 2,
        error / 2,
        window_s > period_s and 1.96 * error < UNSURE * window_s,
        float(motor.gain * moved[0]),
        float(motor.pole * moved[1]),
    )


def _residuals(recording: Recording, best: Windowed, window_s: float) -> np.ndarray:
    """Of the rows of `best`, what its motor leaves of speeds over `window_s`; NaN where a window begins too early."""
    motor, rows = best.fitted.motor, np.full(best.study.trial.valid.size, np.nan)
    study = _over(recording, motor, best.study.packed.observation.noise, window_s)
    rows[study.solver.cells] = study.solver.residual_of(motor, best.fitted.speeds)[1]
    return rows[best.study.solver.cells]
