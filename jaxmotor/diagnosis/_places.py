"""At which of its places an effect is: those around the fitted one are tried, to first order in all else."""

import numpy as np

from jaxmotor.diagnosis._free import with_each, with_effect, without_effect
from jaxmotor.diagnosis._score_test import without_own
from jaxmotor.diagnosis._solve import Fitted, Solver, square_of
from jaxmotor.motor.effects import AbstractEffect, Rig

BETTER = 1e-3
"""Part of the sum of squares that another place must take up."""


def at_best_place(solver: Solver, fitted: Fitted, rig: Rig, tolerance: float) -> Fitted:
    """`fitted`, or the same effects at better places."""
    for effect in fitted.motor.effects:
        others = effect.around(rig)
        if others and np.isfinite(fitted.jacobian).all():
            fitted = moved(solver, fitted, others, tolerance, BETTER)
    return fitted


def moved(
    solver: Solver, fitted: Fitted, others: tuple[AbstractEffect, ...], tolerance: float, better: float
) -> Fitted:
    """`fitted`, or the best of `others` in the place of its effect of their name where that takes up a part `better` of
    the sum of squares."""
    name = others[0].name
    motors = with_each(without_effect(fitted.motor, name), others)
    found = solver.residuals(motors, np.repeat(fitted.speeds[None], len(others), axis=0), fitted.steps)
    squares = [square_of(left) for left in without_own(fitted, found.T).T]
    best = int(np.argmin(squares))
    if not squares[best] < (1 - better) * square_of(without_own(fitted, fitted.residual)):
        return fitted
    new = solver.fit(with_effect(without_effect(fitted.motor, name), others[best]), fitted, tolerance)
    return min(fitted, new, key=lambda one: one.chi2)
