"""Where most of the points are, whatever the others do: the minimum covariance determinant.

Rousseeuw and Van Driessen, "A fast algorithm for the minimum covariance determinant estimator", Technometrics 41, 1999.
"""

import numpy as np

STARTS, STEPS = 50, 30
"""Random subsets to start from, and the most concentration steps from each."""
LEAST = 1e-12
"""Variance, of what is usual, that points which are all the same are given."""


def robust(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Centre (p,) and covariance (p, p) of most of `points` (m, p): the reweighted minimum covariance determinant.

    Of half of the points, the set with the smallest determinant, by concentration steps from random starts; scaled to
    be right for normal points, then once more from all points within the 97.5 % quantile.
    """
    from scipy.special import chdtr, chdtri

    number, size = points.shape
    half = (number + size + 1) // 2
    rng = np.random.default_rng(0)
    away = points - np.median(points, axis=0)
    scale = np.median(np.abs(away), axis=0)
    scale = np.where(scale > 0, scale, away.std(0))  # more than half of them may be equal
    units = away / np.where(scale > 0, scale, 1.0)
    chosen = min(
        (_concentrated(units, rng.choice(number, size + 1, replace=False), half) for _ in range(STARTS)),
        key=lambda subset: float(np.linalg.slogdet(_covariance(units[subset]))[1]),
    )
    centre, covariance = units[chosen].mean(0), _covariance(units[chosen])
    middle = np.median(_squares(units, centre, covariance))
    # `chdtri` is the chi-square value that this share lies above, `chdtr` the share below a value.
    covariance = covariance * (middle if middle > 0 else 1.0) / chdtri(size, 0.5)
    limit = chdtri(size, 0.025)
    kept = units[_squares(units, centre, covariance) <= limit]
    covariance = _covariance(kept) * 0.975 / chdtr(size + 2, limit)
    return kept.mean(0) * scale + np.median(points, axis=0), covariance * np.outer(scale, scale)


def _concentrated(points: np.ndarray, start: np.ndarray, half: int) -> np.ndarray:
    subset = start
    for _ in range(STEPS):
        square = _squares(points, points[subset].mean(0), _covariance(points[subset]))
        after = np.sort(np.argpartition(square, half - 1)[:half])
        if len(after) == len(subset) and (after == subset).all():
            break
        subset = after
    return subset


def _covariance(points: np.ndarray) -> np.ndarray:
    covariance = np.cov(points.T).reshape(points.shape[1], -1)
    return covariance + LEAST * (1 + np.trace(covariance)) * np.eye(len(covariance))


def _squares(points: np.ndarray, centre: np.ndarray, covariance: np.ndarray) -> np.ndarray:
    away = points - centre
    return np.einsum("mi,ij,mj->m", away, np.linalg.inv(covariance), away)
