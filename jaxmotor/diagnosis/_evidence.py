"""How well a model predicts rows that it was not fitted to: block after block left out, at several horizons.

With e the residual of the free simulation, J its Jacobian, H = JᵀJ + P (P the prior's) and b a block of rows, the
motor fitted to the other blocks leaves in b, to first order,

    e_b + J_b δ,   δ = (H - J_bᵀJ_b)⁻¹ J_bᵀ e_b.

That is judged as it is, as the error of a prediction one row ahead, and twenty rows ahead, with the colour of the
model's own residual (`autoregression`). The score of a block is the mean over the horizons of log(S_b/n_b + f), S_b
the sum of squares over its n_b rows, f a small share of what the best model leaves: logarithms keep a loud block from
deciding alone. Models are compared block by block.

Where the noise is not known and rows are so close that twenty of them are but a small part of a time constant, a row
ahead tells of the sensor alone: then the rows of e and J are means over several (`groups_of`).
"""

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from jaxmotor.diagnosis._found import LEAST, NEARLY
from jaxmotor.prediction import autoregression, k_steps, one_step

BLOCKS = 30
"""At most."""
FEWEST_ROWS = 8
"""Of a block."""
AHEAD = 20
"""Rows."""
SHARE = 0.05
"""f, as a share of the mean square that the best model leaves."""
NOTHING = 0.004
"""Difference of scores that means nothing: laws are not that exact, and rounding is not quite white."""
WORST = 4.0
"""Times its residual, which the error of a block left out is taken to be at most: a block that holds the only rows of
their kind is predicted badly by any model that has a law for them."""
FINEST = 25
"""Rows in a time constant, at most: `AHEAD` of them are nearly one."""


class Evidence(NamedTuple):
    """Mean squares (horizon, block) of the errors in blocks left out [variances of the encoder's own]."""

    squares: np.ndarray
    rows: int = 0
    """Of all blocks."""

    @property
    def mean(self) -> np.ndarray:
        """(horizon,)"""
        return self.squares.mean(axis=1)


class Limits(NamedTuple):
    """(model,) least and most logarithm of the odds of each model against one of them."""

    least: np.ndarray | float = -np.inf
    most: np.ndarray | float = np.inf


def blocks_of(rows: int) -> np.ndarray:
    """(rows,) number of the block of each row."""
    number = int(np.clip(rows // FEWEST_ROWS, 2, BLOCKS))
    return np.arange(rows) * number // max(rows, 1)


def groups_of(piece: np.ndarray, time_constant_rows: float) -> np.ndarray:
    """(n,) number of the group of each row in pieces `piece` (n,): neighbours, of which a time constant has `FINEST` at
    most; alone where that leaves too few for full blocks."""
    most = len(piece) // (BLOCKS * AHEAD)
    rows = int(np.clip(time_constant_rows / FINEST, 1, max(most, 1)))
    return np.cumsum((np.arange(len(piece)) - begin_of(piece)) % rows == 0) - 1


def begin_of(piece: np.ndarray) -> np.ndarray:
    """(n,) the row at which the piece of each row in pieces `piece` (n,) begins."""
    return np.maximum.accumulate(np.where(np.diff(piece, prepend=-1) != 0, np.arange(len(piece)), 0))


def means(columns: np.ndarray, group: np.ndarray) -> np.ndarray:
    """(groups, ...) of `columns` (n, ...) over the rows of each group, which stand together."""
    begin = np.flatnonzero(np.diff(group, prepend=-1))
    size = np.diff(begin, append=len(group))
    return np.add.reduceat(columns, begin, axis=0) / size.reshape(-1, *[1] * (columns.ndim - 1))


def evidence(residual: np.ndarray, jacobian: np.ndarray, spread: np.ndarray, piece: np.ndarray) -> Evidence:
    """Of a model with this `residual` (n,) and `jacobian` (n, p), priors of this `spread` (p,), infinite where there is
    none, and rows in pieces `piece` (n,)."""
    block = blocks_of(len(residual))
    jacobian = np.where(np.isfinite(jacobian), jacobian, 0.0)
    shifts = _left_out(residual, jacobian, spread, block)
    both = np.column_stack([residual, jacobian])
    colour = autoregression(residual, piece).weights
    new = one_step(both, colour, piece)
    seen = [_mean_squares(columns, shifts, block) for columns in (both, new, k_steps(new, colour, piece, AHEAD))]
    return Evidence(np.stack(seen), len(block))


def _left_out(residual: np.ndarray, jacobian: np.ndarray, spread: np.ndarray, block: np.ndarray) -> np.ndarray:
    """(block, p) by how much the free numbers of the model move without each block."""
    prior = 1 / np.square(spread)
    normal = np.einsum("np,nq->pq", jacobian, jacobian) + np.diag(prior)
    scale = np.sqrt(np.maximum(np.diag(normal), 1e-300))
    least = 1e-9 * np.eye(len(scale))
    shifts = []
    for number in range(int(block[-1]) + 1):
        own = jacobian[block == number]
        right = np.einsum("np,n->p", own, residual[block == number])
        left = (normal - np.einsum("np,nq->pq", own, own)) / np.outer(scale, scale) + least
        shifts.append(np.linalg.solve(left, right / scale) / scale)
    return np.stack(shifts)


def _mean_squares(columns: np.ndarray, shifts: np.ndarray, block: np.ndarray) -> np.ndarray:
    """(block,) of the error `columns` [e, J] (n, 1 + p) in each block that was left out."""
    error = columns[:, 0] + np.einsum("np,np->n", columns[:, 1:], shifts[block])
    size = np.bincount(block)
    inside, outside = (np.bincount(block, np.square(one)) / size for one in (columns[:, 0], error))
    return np.where(np.isfinite(outside), np.minimum(outside, WORST * inside), WORST * inside)


def weights(
    found: Sequence[Evidence],
    prices: Sequence[float],
    bounds: np.ndarray | float = 0.0,
    limits: Callable[[int], Limits] = lambda other: Limits(),
) -> np.ndarray:
    """Probability of each model among those given, each with its price in logarithms of probability.

    They are compared with the most probable one, found from that of the best score on: a model that hardly anything
    speaks for does not decide between two others. By what they leave in blocks the odds of a model against it are

        (1 + t²/(B - 1))^(∓B/2),

    t the difference of their scores over that difference's standard error and `NOTHING` together, B the number of
    blocks (Student's distribution: few blocks say little). Their logarithm has between two models the difference of
    their `bounds` (model,), as from `beyond_noise` or `beyond_others`, if that is further from 0, and is within the
    `limits` that are given for the number of the other one. From it the difference of their prices is taken.
    """
    left = np.min([one.mean for one in found], axis=0)
    scores = np.stack([np.log(one.squares + SHARE * left[:, None]).mean(axis=0) for one in found])
    price, bound = np.asarray(prices), np.broadcast_to(bounds, (len(found),))

    def against(other: int) -> np.ndarray:
        least, most = limits(other)
        odds = _at_least_as_far(_by_blocks(scores, other), bound - bound[other])
        return np.clip(odds, least, most) - price

    most_probable, seen = int(np.argmin(scores.mean(axis=1))), set[int]()
    while most_probable not in seen:
        seen.add(most_probable)
        most_probable = int(np.argmax(against(most_probable)))
    log = against(most_probable)
    weight = np.exp(log - log.max())
    return weight / weight.sum()


def _by_blocks(scores: np.ndarray, other: int) -> np.ndarray:
    """(model,) logarithm of the odds of each against one of them by `scores` (model, block)."""
    apart = scores - scores[other]
    blocks = apart.shape[1]
    spread = apart.std(axis=1, ddof=1) / math.sqrt(blocks)
    t = apart.mean(axis=1) / np.hypot(spread, NOTHING)
    return -0.5 * blocks * np.sign(t) * np.log1p(np.square(t) / (blocks - 1))


def _at_least_as_far(odds: np.ndarray, bound: np.ndarray) -> np.ndarray:
    """(model,) `odds` as far from 0 as `bound`, to its side, where it is not 0."""
    return np.where(bound < 0, np.minimum(odds, bound), np.where(bound > 0, np.maximum(odds, bound), odds))


def beyond_noise(found: Sequence[Evidence], explained: Sequence[bool], noise: float = NEARLY) -> np.ndarray:
    """(model,) bounds where the noise is known and some models leave nothing else (`explained`). Of those that leave
    more

        -n (S/S* - c)/2

    of one row ahead, n rows, S the mean square in blocks left out, S* the least of the explained, c the chi2 per sample
    that `noise` alone may have: what shows in few blocks only is no less there if it is that far beyond the noise.
    """
    known = np.asarray(explained)
    if not known.any():
        return np.zeros(len(found))
    ahead = np.array([one.mean[1] for one in found])
    excess = ahead / ahead[known].min() - noise
    return np.where(known, 0.0, -0.5 * found[0].rows * np.maximum(excess, 0.0))


def beyond_others(found: Sequence[Evidence], chi2: Sequence[float]) -> np.ndarray:
    """(model,) bounds where the noise is as the log itself says. For a model with a `chi2` of which another one leaves
    all but `LEAST`

        -n (S/S* - 1 - NOTHING)/2

    of one row ahead, S* of that other one, both without the block that speaks most for it: what
    happened once is no law.
    """
    ahead, left = np.stack([one.squares[1] for one in found]), np.asarray(chi2)
    bounds = np.zeros(len(found))
    for number, own in enumerate(ahead):
        others = ahead[left <= (1 - LEAST) * left[number]]
        loudest = np.argmax(own - others, axis=1)[:, None]
        rest = others.sum(axis=1) - np.take_along_axis(others, loudest, axis=1)[:, 0]
        excess = (own.sum() - own[loudest[:, 0]]) / rest - 1 - NOTHING
        bounds[number] = -0.5 * found[0].rows * max(excess.max(initial=0.0), 0.0)
    return bounds
