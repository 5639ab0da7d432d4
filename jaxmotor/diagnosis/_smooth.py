"""Linear least squares for a spline beside a motor's own parameters, as smooth as data it did not see ask for."""

import dataclasses
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float, Int

from jaxmotor._balanced import balanced, solve_balanced
from jaxmotor.diagnosis._solve import Fitted
from jaxmotor.diagnosis._spline import Spline

FOLDS = 5
STRENGTHS = tuple(10.0**power for power in range(-7, 6))
"""Of roughness, relative to the data."""
PAYS = 0.01
"""Part of what is left over that a jump must take away."""
LEAST = 0.1
"""Excess chi2 that a share is taken of at least: less may be the rounding's own."""


@dataclasses.dataclass(frozen=True, eq=False)
class Judged:
    """A spline's coefficients, and what they are worth on held-out rows."""

    weights: Float[np.ndarray, " k"]
    """[V]"""
    covariance: Float[np.ndarray, "k k"]
    """[V²]"""
    jumps: bool
    """The last of them is the spline's jump; otherwise it has none."""
    shift: Float[np.ndarray, " p"]
    """That the motor's free numbers take beside the curve."""
    gain: float
    share: float


class Grams(NamedTuple):
    """Of b blocks of rows, each fitted or held out as a whole."""

    matrices: Float[np.ndarray, "b m m"]
    """MᵀM of M = (responses, -Jacobian, residual)."""
    rows: Float[np.ndarray, " b"]
    """How many rows each has."""
    held: Bool[np.ndarray, " b"]
    fold: Int[np.ndarray, " b"]

    def total(self) -> Float[np.ndarray, "m m"]:
        return self.matrices.sum(0)

    def folds(self, chosen: np.ndarray) -> Float[np.ndarray, "fold m m"]:
        """Sums of the `chosen` blocks (b,), in folds."""
        return np.stack([self.matrices[chosen & (self.fold == number)].sum(0) for number in range(FOLDS)])


def grams_of(response: np.ndarray, fitted: Fitted, held: np.ndarray, block: np.ndarray) -> Grams:
    """Of rows of which (n,) `held` are held out, in blocks (n,) whose errors are taken as one."""
    used, group = np.unique(2 * block.astype(int) + held, return_inverse=True)
    columns = np.column_stack([response, -fitted.jacobian, fitted.residual])[np.argsort(group, kind="stable")]
    rows = np.bincount(group)
    parts = np.split(columns, np.cumsum(rows)[:-1])
    fold = np.unique(used // 2, return_inverse=True)[1] % FOLDS
    return Grams(np.stack([part.T @ part for part in parts]), rows.astype(float), used % 2 == 1, fold)


def judged(grams: Grams, spline: Spline, at: np.ndarray, level: bool, fitted: Fitted) -> Judged:
    """The spline over places `at` that `grams` ask for, with a jump only if that predicts better.

    `level`: a straight line through the curve over the data is level.
    """
    choices = [
        _choice(grams, spline, at, level, fitted, jumps) for jumps in (False, True)[: 1 + (spline.jump is not None)]
    ]
    chosen = choices[-1] if choices[-1].error < (1 - PAYS) * choices[0].error else choices[0]
    problem, strength, keep = chosen.problem, chosen.strength, chosen.keep
    gain, excess = problem.held_out(strength)
    _, strength = problem.smoothness(np.ones_like(grams.held))
    weights, covariance = problem.solved(strength)
    share = float(np.clip(gain / max(excess, LEAST), 0.0, 1.0))
    weights, shift = weights[: problem.size], weights[problem.size :]
    return Judged(keep @ weights, keep @ covariance @ keep.T, chosen.jumps, shift, gain, share)


class _Choice(NamedTuple):
    jumps: bool
    keep: np.ndarray
    """Of `_kept`."""
    problem: "_Problem"
    strength: float
    error: float
    """Squares left over of fitted rows by what other fitted rows ask for."""


def _choice(grams: Grams, spline: Spline, at: np.ndarray, level: bool, fitted: Fitted, jumps: bool) -> _Choice:
    keep = _kept(spline, at, level, jumps)
    into = _block(keep, np.eye(fitted.jacobian.shape[1] + 1), grams.matrices.shape[-1])
    grams = grams._replace(matrices=into.T @ grams.matrices @ into)
    constant = keep.T @ np.where(np.arange(len(keep)) < len(keep) - jumps, 1.0, 0.0)
    problem = _Problem(grams, keep.T @ spline.roughness(jumps) @ keep, constant, _prior(fitted))
    error, strength = problem.smoothness(~grams.held)
    return _Choice(jumps, keep, problem, strength, error)


class _Problem:
    def __init__(self, grams: Grams, roughness: np.ndarray, constant: np.ndarray, prior: np.ndarray):
        self.grams, self.size = grams, len(roughness)
        self.constant = constant[:, None]
        """Coefficients of a curve that is one everywhere."""
        self.prior = np.pad(prior, (self.size, 0))
        data = np.trace(grams.total()[: self.size, : self.size])
        self.roughness = np.pad(roughness * data, (0, len(prior) - 1))

    def smoothness(self, chosen: np.ndarray) -> tuple[float, float]:
        """Squares left over of folds of `chosen` blocks by what the others ask for, at the best strength; and that."""
        folds = self.grams.folds(chosen)
        errors = [float(_left(folds, self.solutions(folds.sum(0) - folds, strength)).sum()) for strength in STRENGTHS]
        best = int(np.argmin(errors))
        return errors[best], STRENGTHS[best]

    def held_out(self, strength: float) -> tuple[float, float]:
        """Of held-out rows, chi2 per sample that the curve takes away, and the excess that an offset leaves."""
        apart, prior = self.grams.held, self.prior
        fitted, held = self.grams.matrices[~apart].sum(0), self.grams.matrices[apart].sum(0)
        with_curve = _left(held, self.solutions(fitted, strength))
        flat = _block(self.constant, np.eye(len(held) - self.size), len(held))
        without = _left(flat.T @ held @ flat, _solutions(flat.T @ (fitted + prior) @ flat))
        rows = max(float(self.grams.rows[apart].sum()), 1.0)
        return float(without - with_curve) / rows, float(without) / rows - 1

    def solved(self, strength: float) -> tuple[np.ndarray, np.ndarray]:
        """All coefficients, and the curve's covariance.

        That is, element by element, the larger of one as of a prior of curves of this smoothness [Wahba 1983] and of
        the jackknife over blocks, which also knows what a curve of few knots cannot follow.
        """
        total, k = self.grams.total(), self.size
        weights = self.solutions(total, strength)
        chi2 = max(float(_left(total, weights)) / float(self.grams.rows.sum()), 1.0)
        normal = (total + self.prior)[:-1, :-1] + strength * self.roughness
        ones, scale = balanced(normal, 1e-9)
        own = chi2 * (np.linalg.inv(ones) / np.outer(scale, scale))[:k, :k]
        without = self.solutions(total - self.grams.matrices, strength)[:, :k]
        change = (without - without.mean(0)) * np.sqrt((len(without) - 1) / len(without))
        blocks = change.T @ change
        grow = np.sqrt(np.maximum(np.diag(own) / np.maximum(np.diag(blocks), 1e-300), 1.0))
        return weights, blocks * np.outer(grow, grow)

    def solutions(self, grams: np.ndarray, strength: float) -> np.ndarray:
        return _solutions(grams + self.prior + np.pad(strength * self.roughness, (0, 1)))


def _solutions(grams: np.ndarray) -> np.ndarray:
    """(..., m) least-squares solutions; the last column of each Gram matrix is what is to be explained."""
    return solve_balanced(grams[..., :-1, :-1], grams[..., :-1, -1], 1e-9)


def _left(grams: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Squares left over."""
    signed = np.concatenate([weights, -np.ones((*weights.shape[:-1], 1))], axis=-1)
    return np.asarray(np.einsum("...i,...ij,...j->...", signed, grams, signed))


def _prior(fitted: Fitted) -> np.ndarray:
    """Gram matrix of rows that hold the motor's own parameters to their priors."""
    layout = fitted.layout
    weight = 1 / layout.spread
    rows = np.column_stack([np.diag(weight), (layout.prior - fitted.free) * weight])
    return rows.T @ rows


def _kept(spline: Spline, at: np.ndarray, level: bool, jumps: bool) -> np.ndarray:
    """(k, k or less) columns that span the coefficients that are asked for."""
    columns = spline.columns(at, jumps)
    if not level:
        return np.eye(columns.shape[1])
    slope = columns.T @ (at - at.mean())
    return np.linalg.svd(slope[None])[2][1:].T


def _block(first: np.ndarray, second: np.ndarray, rows: int) -> np.ndarray:
    """Both on a diagonal; rows between them, of a column that is not used, are zero."""
    into = np.zeros((rows, first.shape[1] + second.shape[1]))
    into[: len(first), : first.shape[1]] = first
    into[rows - len(second) :, first.shape[1] :] = second
    return into
