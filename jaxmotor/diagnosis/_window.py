"""Over how long the speeds of a log were averaged, found with the effects of its motor.

`identify` finds that beside a linear motor, if that explains the rest. Where it does not, the search has taken the
window for lags of the motor. Here these are left out, but for a delay, which does not smooth, and a window W is fitted
beside the other effects; of both the one with the least

    n' ln S + k ln n'

is taken, S the mean square over rows that all windows leave (one that begins before its piece has no mean), k the
number of parameters, n' the rows over those that one independent reading takes
(`Noise.rows_per_reading`).
"""

import functools
import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from jaxmotor._balanced import solve_balanced
from jaxmotor.diagnosis._found import COARSE
from jaxmotor.diagnosis._free import with_effect, without_effect
from jaxmotor.diagnosis._request import Request
from jaxmotor.diagnosis._score_test import late
from jaxmotor.diagnosis._solve import DAMPING, Fitted, square_of
from jaxmotor.diagnosis._study import Study, study_of
from jaxmotor.diagnosis._visited import FAR
from jaxmotor.estimate import UNSURE, SpeedAverage, with_window
from jaxmotor.motor import Motor
from jaxmotor.motor.effects import OF_LOG, ElectricalPole, SensorLag, TransportDelay, free_size
from jaxmotor.prediction import Noise
from jaxmotor.recording import Recording

ROWS = (1.0, 1.6, 2.5, 4.0, 6.0, 9.0, 13.0, 20.0)
"""Windows from which the best one is sought."""
LAG = "lag"
"""The family of effects that a window may be mistaken for."""
CLOSER = 3
"""Times that the best window is sought among its neighbours."""
KEPT = 0.5
"""Part of the rows that a window must leave to be tried."""
STEPS, NEAR = 3, 0.2
"""Steps from the best of these, and part of the window's error that the last one may have."""
STEP = 0.02
"""Part of a window over which residuals are differenced."""


class Windowed(NamedTuple):
    """A motor fitted to readings over one window."""

    window_s: float
    study: Study
    fitted: Fitted

    def square(self, cells: np.ndarray) -> float:
        """Mean square of the residual [standard deviations²] in these `cells` (n,) of the packed rows."""
        own = self.fitted.residual[np.isin(self.study.solver.cells, cells)]
        return square_of(own) / max(len(own), 1)


def window_beside(
    recording: Recording, study: Study, found: Fitted, others: Sequence[Fitted], enough: float = math.inf
) -> SpeedAverage | None:
    """The window of `recording`, of speeds whose average is not stated, with the effects of `found` that are no lags,
    and with a delay beside them if that pays; None where one of the `others`, or a lag in the window's place, explains
    the readings as well, or where more than `enough` (chi2 per sample) is left."""
    noise, solver = study.packed.observation.noise, study.solver
    period_s = float(np.median(study.packed.durations))
    over = functools.partial(_over, recording, found.motor, noise, solver.request)
    studies = {rows * period_s: over(rows * period_s) for rows in ROWS}
    used = {length: its for length, its in studies.items() if len(its.solver.cells) >= KEPT * len(solver.cells)}
    if not used:
        return None
    cells = functools.reduce(np.intersect1d, [its.solver.cells for its in used.values()], solver.cells)
    number = len(cells) / max(noise.rows_per_reading, 1.0)

    def cost(one: Windowed, more: int) -> float:
        square, size = one.square(cells), sum(map(free_size, one.fitted.motor.effects)) + more
        return number * math.log(square) + size * math.log(max(number, 1.0)) if 0 < square < math.inf else math.inf

    fit = functools.partial(_fitted, over, found.speeds)
    tried, bare = [], without_lags(found.motor)
    motor = delayed = with_effect(bare, TransportDelay.of(delay_s=period_s))
    for length, its in used.items():
        least = min((one.fitted.chi2 for one in tried), default=math.inf)
        tried.append(fit(length, motor, its, FAR * least))
        # From one window to the next little changes.
        motor = tried[-1].fitted.motor if tried[-1].fitted.settled else motor
    best = _settled(recording, fit, _closer(fit, tried, cells), cells)
    # A longer window makes speeds as late as a delay beside a shorter one.
    undelayed = [
        fit(best.window_s + more, without_lags(best.fitted.motor)) for more in (0.0, 2 * late(best.fitted.motor))
    ]
    undelayed = _settled(recording, fit, min(undelayed, key=lambda one: one.square(cells)), cells)
    best = min(best, undelayed, key=lambda one: cost(one, 1))
    if best.fitted.chi2 > enough:
        return None
    lags = [with_effect(delayed, lag.of(time_constant_s=period_s)) for lag in (SensorLag, ElectricalPole)]
    instead = (solver.fit(lag, found.speeds, COARSE) for lag in lags)
    least = min(cost(Windowed(0.0, study, other), 0) for other in (found, *others, *instead))
    return _average(recording, best, period_s) if cost(best, 1) < least else None


def beside_all(
    recording: Recording, study: Study, found: Fitted, known: SpeedAverage, *, early: bool
) -> tuple[SpeedAverage, bool]:
    """The window of `recording`, which states the `known` one, with the effects of `found`; and whether it moved so far
    that these have to be found anew. Where it was known `early`, before any effect was, lags among them may be what it
    lacked: it is found without them first."""
    better = known
    for lags in (False, True) if early and any(effect.family == LAG for effect in found.motor.effects) else (True,):
        better = _beside(recording, study, found, known.length_s, lags=lags)
        if abs(better.length_s - known.length_s) > better.standard_error_s:
            return better, True
    return better, False


def _beside(recording: Recording, study: Study, found: Fitted, window_s: float, *, lags: bool) -> SpeedAverage:
    """The window with all effects of `found`, or without its `lags`: in Gauss-Newton steps from `window_s`, judged on
    rows that a window half as long again leaves, too."""
    over = functools.partial(_over, recording, found.motor, study.packed.observation.noise, study.solver.request)
    fit = functools.partial(_fitted, over, found.speeds)
    first = Windowed(window_s, study, found) if lags else fit(window_s, without_lags(found.motor), study)
    best = _settled(recording, fit, first, over(1.5 * window_s).solver.cells)
    return _average(recording, best, float(np.median(study.packed.durations)))


def _fitted(
    over: Callable[[float], Study],
    speeds: np.ndarray,
    window_s: float,
    motor: Motor,
    its: Study | None = None,
    bar: float = math.inf,
) -> Windowed:
    """`motor`, fitted to speeds over that window, or given up where chi2 will not come below `bar`; pieces begin at
    about `speeds` [rad/s], where it leaves them all."""
    its = its or over(window_s)
    starts = speeds if len(speeds) == len(its.solver.starts) else None
    return Windowed(window_s, its, its.solver.fit(motor, starts, COARSE, bar=bar))


def without_lags(motor: Motor) -> Motor:
    """`motor` without those of its effects that are lags, or the log's."""
    for effect in motor.effects:
        if effect.family == LAG or isinstance(effect, OF_LOG):
            motor = without_effect(motor, effect.name)
    return motor


def _over(recording: Recording, motor: Motor, noise: Noise, request: Request, window_s: float) -> Study:
    """`recording` of speeds over that window, in the same unit whatever it is."""
    return study_of(with_window(recording, window_s), float(motor.linear.pole), request=request, noise=noise)


def _closer(fit: Callable[[float, Motor], Windowed], tried: list[Windowed], cells: np.ndarray) -> Windowed:
    """The best of `tried`, by what they leave in `cells`, and of windows between its neighbours."""
    for _ in range(CLOSER):
        tried.sort(key=lambda one: one.window_s)
        squares = [one.square(cells) for one in tried]
        at = int(np.argmin(squares))
        if not 0 < at < len(tried) - 1:
            break
        near = tried[at - 1 : at + 2]
        if not np.isfinite(squares[at - 1 : at + 2]).all():
            break
        curve = np.polyfit([one.window_s for one in near], squares[at - 1 : at + 2], 2)
        lowest = float(-curve[1] / (2 * curve[0])) if curve[0] > 0 else near[1].window_s
        if lowest == near[1].window_s or not near[0].window_s < lowest < near[2].window_s:
            break
        tried.append(fit(lowest, near[1].fitted.motor))
    return min(tried, key=lambda one: one.square(cells))


def _settled(
    recording: Recording, fit: Callable[[float, Motor], Windowed], best: Windowed, cells: np.ndarray
) -> Windowed:
    """`best`, and from there Gauss-Newton steps of the window as long as they bring something."""
    for _ in range(STEPS):
        slope = _slope(recording, best)
        step = float(np.clip(slope.step_s(best.fitted.residual), -0.5 * best.window_s, best.window_s))
        if abs(step) < NEAR * slope.error_s(best):
            break
        new = fit(best.window_s + step, best.fitted.motor)
        if not new.square(cells) < best.square(cells):
            break
        best = new
    return best


class _Slope(NamedTuple):
    """What a longer window changes. n rows, p free numbers of the motor."""

    own: np.ndarray
    """(n,) of the residual, beside what the motor takes up of that [standard deviations/s]."""
    moved: np.ndarray
    """(p,) of the free numbers [1/s]."""

    def step_s(self, residual: np.ndarray) -> float:
        """To the window that leaves least of `residual` [s]."""
        return -float(np.einsum("n,n->", self.own, residual)) / max(square_of(self.own), 1e-300)

    def error_s(self, best: Windowed) -> float:
        """Of the window `best` [s]: by blocks, and never less than its rows are worth."""
        solver, residual = best.study.solver, best.fitted.residual
        pulls = np.bincount(solver.block, self.own * residual)
        per_reading = max(best.study.packed.observation.noise.rows_per_reading, 1.0)
        least = square_of(self.own) * best.fitted.chi2 * per_reading
        return math.sqrt(max(square_of(pulls), least)) / max(square_of(self.own), 1e-300)


def _slope(recording: Recording, best: Windowed) -> _Slope:
    fitted, window_s = best.fitted, best.window_s
    sides = [_residuals(recording, best, share * window_s) for share in (1 - STEP, 1 + STEP)]
    column = np.nan_to_num((sides[1] - sides[0]) / (2 * STEP * window_s))
    normal = np.einsum("np,nq->pq", fitted.jacobian, fitted.jacobian) + np.diag(1 / fitted.layout.spread**2)
    moved = -solve_balanced(normal, np.einsum("np,n->p", fitted.jacobian, column), DAMPING)
    return _Slope(column + np.einsum("np,p->n", fitted.jacobian, moved), moved)


def _average(recording: Recording, best: Windowed, period_s: float) -> SpeedAverage:
    """`best` with its error, and what gain and pole move by with the window."""
    slope, window_s = _slope(recording, best), best.window_s
    error, motor = slope.error_s(best), best.fitted.motor.linear
    return SpeedAverage(
        "window",
        window_s,
        error,
        window_s / 2,
        error / 2,
        window_s > period_s and 1.96 * error < UNSURE * window_s,
        float(motor.gain * slope.moved[0]),
        float(motor.pole * slope.moved[1]),
    )


def _residuals(recording: Recording, best: Windowed, window_s: float) -> np.ndarray:
    """Of the rows of `best`, what its motor leaves of speeds over `window_s`; NaN where a window begins too early."""
    motor, rows = best.fitted.motor, np.full(best.study.trial.valid.size, np.nan)
    noise, request = best.study.packed.observation.noise, best.study.solver.request
    study = _over(recording, motor, noise, request, window_s)
    rows[study.solver.cells] = study.solver.residual_of(motor, best.fitted.speeds)[1]
    return rows[best.study.solver.cells]
