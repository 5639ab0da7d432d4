"""The sizes of a law with contacts: those that fit best on average over sizes near them.

Which row a contact falls into hangs on the last digits of a size, and the cost with it: it has many minima, and the
deepest may be one whose sizes are a fifth off. Its mean over sizes that differ by some per cent is smooth, with the
minimum near the truth. That is sought by the cross-entropy method [Rubinstein 1999]: sizes are drawn from a normal
distribution of their logarithms, the other parameters go with them as a linearisation says, and the best of each
generation are the distribution of the next. The linearisation is renewed on the way: that of a motor whose sizes are a
fifth off draws the minimum a quarter to a half of the way to these.
"""

import dataclasses
from typing import NamedTuple

import numpy as np

from jaxmotor._balanced import solve_balanced
from jaxmotor.diagnosis._free import OWN, is_wide, motor_at, motors_at
from jaxmotor.diagnosis._solve import Fitted, Solver
from jaxmotor.motor.effects import free_size

GENERATIONS, AVERAGED = 12, 6
"""Of draws; and the last of them, whose means are averaged."""
DRAWS, BEST = 32, 8
"""Motors of a generation, and those of them that the next one is drawn from."""
SPREAD, KEPT = 0.15, 0.85
"""Relative spread of the sizes at first; and the part of their covariance that each generation keeps."""
PLACED = 3
"""Generations after which loads are placed in their gaps anew, and the motor is linearised there."""
DAMPING = 1e-9
"""Of the balanced normal equations of the other parameters."""


def smoothed(solver: Solver, fitted: Fitted, tolerance: float) -> Fitted:
    """The motor whose cost is least on average over sizes near its own, sought from `fitted`; that one where its own is
    no less."""
    rng, sizes = np.random.default_rng(0), _Sizes.of(fitted)
    at, means, speeds = fitted.free, [], fitted.speeds
    covariance = SPREAD**2 * np.eye(sizes.number)
    for generation in range(GENERATIONS):
        steps = rng.multivariate_normal(np.zeros(sizes.number), covariance, DRAWS)
        costs, frees = _costs(solver, fitted, sizes, at, steps, speeds)
        best = np.argsort(costs)[:BEST]
        covariance = KEPT * covariance + (1 - KEPT) * steps[best].T @ steps[best] / BEST
        at = frees[best].mean(axis=0)
        means.append(at)
        if generation % PLACED == PLACED - 1:
            speeds = solver.placed(motor_at(fitted.template, at), speeds, fitted.steps)
            sizes = _Sizes.of(solver.linearised(fitted, np.mean(means[-PLACED:], axis=0), speeds))
    if not np.isfinite(means).all():
        return fitted
    near = dataclasses.replace(fitted, speeds=speeds)
    found = solver.fit(motor_at(fitted.template, np.mean(means[-AVERAGED:], axis=0)), near, tolerance)
    steps = rng.multivariate_normal(np.zeros(sizes.number), covariance, DRAWS)

    def near_to(one: Fitted) -> float:
        return float(_costs(solver, one, _Sizes.of(one), one.free, steps, one.speeds)[0].mean())

    return found if near_to(found) < near_to(fitted) else fitted


class _Sizes(NamedTuple):
    """Which free numbers are drawn, and how the others go with them. p free numbers, d of them drawn."""

    drawn: np.ndarray
    """(p,)"""
    own: np.ndarray
    """(n, p - d) columns of the residual's Jacobian of the others."""
    normal: np.ndarray
    """Their normal equations, with their priors."""
    going: np.ndarray
    """(d, p - d) by how much the others go with each."""

    @staticmethod
    def of(fitted: Fitted) -> "_Sizes":
        sizes = [(is_wide((effect,)), free_size(effect)) for effect in fitted.template.effects]
        drawn = np.array([False] * OWN + [wide for wide, size in sizes for _ in range(size)])
        own, columns = fitted.jacobian[:, ~drawn], fitted.jacobian[:, drawn]
        normal = np.einsum("np,nq->pq", own, own) + np.diag(1 / fitted.layout.spread[~drawn] ** 2)
        return _Sizes(drawn, own, normal, -solve_balanced(normal, np.einsum("nd,np->dp", columns, own), DAMPING))

    @property
    def number(self) -> int:
        return int(self.drawn.sum())


def _costs(
    solver: Solver, fitted: Fitted, sizes: _Sizes, at: np.ndarray, steps: np.ndarray, speeds: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Of motors whose sizes are `steps` (k, d) from `at`, the sum of squares (k,) that the linearisation leaves when
    the other parameters follow, and the free numbers (k, p) then."""
    layout = fitted.layout
    frees = np.repeat(at[None], len(steps), axis=0)
    frees[:, sizes.drawn] += steps
    frees[:, ~sizes.drawn] += steps @ sizes.going
    frees = np.clip(frees, layout.low, layout.high)
    begins = np.repeat(speeds[None], len(steps), axis=0)
    residual = solver.residuals(motors_at(fitted.template, frees), begins, fitted.steps)
    with np.errstate(over="ignore", invalid="ignore"):
        pull = np.einsum("kn,np->kp", residual, sizes.own)
        follow = -solve_balanced(sizes.normal, pull, DAMPING)
        costs = np.einsum("kn,kn->k", residual, residual) + np.einsum("kp,kp->k", follow, pull)
    frees[:, ~sizes.drawn] += follow
    return np.where(np.isfinite(costs), costs, np.inf), np.clip(frees, layout.low, layout.high)
