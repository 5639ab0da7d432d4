"""At which moment a step in time is: every moment is tried, to first order beside a fitted motor."""

import numpy as np

from jaxmotor.diagnosis._free import with_each, without_effect
from jaxmotor.diagnosis._score_test import without_own
from jaxmotor.diagnosis._solve import Fitted, Solver, square_of
from jaxmotor.motor.effects import AbstractStepInTime, Rig

MOMENTS = 49
"""That are tried at once."""
APART = 0.01
"""Part of what a step changes that no other change of the motor does, at least: from before its first movement on a
larger voltage is a larger gain, and about as much is seen of one that comes in the first hundredth."""


def placed(solver: Solver, base: Fitted, start: AbstractStepInTime, rig: Rig) -> AbstractStepInTime:
    """`start` at the moment of the recording that explains most beside `base`, to a row."""
    middle = float(np.mean(rig.driven_s))
    return nearby(solver, base, start.but(moment_s=middle), rig.driven_s[1] - middle, rig)


def nearby(solver: Solver, base: Fitted, start: AbstractStepInTime, reach_s: float, rig: Rig) -> AbstractStepInTime:
    """`start` at the best moment that is no further than `reach_s` from its own, while voltages are applied: a step
    that is there before the first of them is a larger gain or a load."""
    near, finest = float(start.moment_s), finest_s(rig)
    while True:
        moments = np.clip(near + np.linspace(-reach_s, reach_s, MOMENTS), *rig.driven_s)
        near = float(moments[int(np.argmin(profile(solver, base, start, moments)))])
        if reach_s <= finest:
            return start.but(moment_s=near)
        reach_s = max(4 * reach_s / (MOMENTS - 1), finest)


def finest_s(rig: Rig) -> float:
    """How far around a moment others are a row apart [s]."""
    return MOMENTS // 2 * rig.period_s


def moment_error(solver: Solver, fitted: Fitted, step: AbstractStepInTime, rig: Rig) -> float:
    """Standard error of the moment of `step` [s], as the likelihood of those around it has it."""
    base = solver.fit(without_effect(fitted.motor, step.name), fitted)
    moments = float(step.moment_s) + np.linspace(-1, 1, MOMENTS) * finest_s(rig)
    squares = profile(solver, base, step, moments) / max(fitted.chi2, 1.0)
    weight = np.exp(-0.5 * (squares - squares.min()))
    spread = float(np.sqrt(np.average(np.square(moments - np.average(moments, weights=weight)), weights=weight)))
    return float(np.hypot(spread, rig.period_s / np.sqrt(12)))


def profile(solver: Solver, base: Fitted, start: AbstractStepInTime, moments: np.ndarray) -> np.ndarray:
    """(k,) sum of squares that `base` leaves with a step like `start` at each of `moments` [s], to first order."""
    columns = _columns(solver, base, [start.but(moment_s=float(moment)) for moment in moments])
    left, residual = without_own(base, columns), without_own(base, base.residual)
    whole, own = (np.einsum("nk,nk->k", each, each) for each in (columns, left))
    gain = np.einsum("nk,n->k", left, residual) ** 2 / np.maximum(own, 1e-9)
    return square_of(residual) - np.where(own > APART * whole, gain, 0.0)


def _columns(solver: Solver, base: Fitted, steps: list[AbstractStepInTime]) -> np.ndarray:
    """(n, k) what each of `steps` changes beside `base` [standard deviations]."""
    begins = np.repeat(base.speeds[None], len(steps), axis=0)
    found = solver.residuals(with_each(base.motor, steps), begins)
    return (found - solver.residual_of(base.motor, base.speeds)[1]).T
