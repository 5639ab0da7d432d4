"""A better fit beside a local minimum: the cost of a law with contacts has many, each a little off.

Sizes of such a law are drawn around those found, the other parameters going with them as the linearisation says; the
best of them are fitted, and the next round starts from there.
"""

from collections.abc import Callable

import numpy as np

from jaxmotor._balanced import balanced
from jaxmotor.diagnosis._free import OWN, is_wide, motor_at, motors_at
from jaxmotor.diagnosis._parallel import side_by_side
from jaxmotor.diagnosis._solve import Fitted, Solver, square_of
from jaxmotor.motor.effects import free_size

ROUNDS = 2
"""Without improvement, one after the other, after which nothing better is expected."""
LEAST = 1e-3
"""Part of chi2 that a round must bring to count as an improvement."""
DRAWS = 14
"""Of each spread."""
SPREADS = (0.03, 0.08, 0.2)
"""Relative."""
FITTED = 2
"""Of the motors drawn."""


def polished(solver: Solver, fitted: Fitted, tolerance: float) -> Fitted:
    """`fitted`, or what is better around it, until rounds find nothing."""
    rng = np.random.default_rng(0)
    idle = 0
    while idle < ROUNDS:
        frees = _around(fitted, rng)
        speeds = np.repeat(fitted.speeds[None], len(frees), axis=0)
        found = solver.residuals(motors_at(fitted.template, frees), speeds, fitted.steps)
        order = np.argsort([square_of(residual) for residual in found])[:FITTED]
        near = side_by_side(_fit_from(solver, fitted, tolerance), [frees[k] for k in order])
        best = min(near, key=lambda one: one.chi2)
        idle = 0 if best.chi2 < (1 - LEAST) * fitted.chi2 else idle + 1
        fitted = min(fitted, best, key=lambda one: one.chi2)
    return fitted


def _fit_from(solver: Solver, fitted: Fitted, tolerance: float) -> Callable[[np.ndarray], Fitted]:
    return lambda free: solver.fit(motor_at(fitted.template, free), fitted.speeds, tolerance, bar=fitted.chi2)


def _around(fitted: Fitted, rng: np.random.Generator) -> np.ndarray:
    """(k, p) free vectors."""
    layout = fitted.layout
    sizes = [(is_wide((effect,)), free_size(effect)) for effect in fitted.template.effects]
    drawn = np.array([False] * OWN + [wide for wide, size in sizes for _ in range(size)])
    spread = np.repeat(SPREADS, DRAWS)[:, None]
    moves = np.zeros((len(spread), len(drawn)))
    moves[:, drawn] = spread * rng.normal(size=(len(spread), int(drawn.sum())))
    own, other = fitted.jacobian[:, ~drawn], fitted.jacobian[:, drawn]
    normal = np.einsum("np,nq->pq", own, own) + np.diag((1 / layout.spread[~drawn]) ** 2)
    ones, scale = balanced(normal)
    along = np.einsum("np,nq->pq", own, other) / scale[:, None]
    going = -np.linalg.lstsq(ones, along, rcond=1e-9)[0] / scale[:, None]
    moves[:, ~drawn] = moves[:, drawn] @ going.T
    return np.clip(fitted.free + moves, layout.low, layout.high)
