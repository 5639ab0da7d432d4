"""Spread between motors without the spread of their estimates: the normal random-effects model.

Motor i has true parameters θ_i ~ N(μ, T), and its estimate y_i ~ N(θ_i, S_i) with the covariance S_i that its own
recording gives. μ and T maximise the restricted likelihood of y_i ~ N(μ, T + S_i), the one with μ integrated out, by EM
steps (Laird and Ware, "Random-effects models for longitudinal data", Biometrics 38, 1982).
"""

import numpy as np

STEPS, TOLERANCE = 3000, 1e-9
"""Most steps, and the change of T, in units of the estimates' variance, at which they end."""


def random_effects(estimates: np.ndarray, errors: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Mean (p,), its covariance (p, p), and the covariance between motors (p, p) of `estimates` with `errors`.

    With V_i = (T + S_i)⁻¹ and C = (Σ V_i)⁻¹, the EM step of the restricted likelihood is
    T <- mean of T - T V_i T + T V_i (r_i r_iᵀ + C) V_i T with r_i = y_i - μ; it stays positive semidefinite.
    """
    scale = np.sqrt(estimates.var(0) + np.einsum("mii->i", errors) / len(errors))
    y, s = estimates / scale, errors / np.outer(scale, scale)
    between = np.cov(y.T).reshape(y.shape[1], -1)
    mean, spread = y.mean(0), between
    for _ in range(STEPS):
        inverse = np.linalg.inv(between + s)
        spread = np.linalg.inv(inverse.sum(0))
        mean = spread @ np.einsum("mij,mj->i", inverse, y)
        pull = np.einsum("ij,mjk->mik", between, inverse)
        away = y - mean
        square = away[:, :, None] * away[:, None, :] + spread
        after = (between - pull @ between + pull @ square @ pull.transpose(0, 2, 1)).mean(0)
        moved = np.abs(after - between).max()
        between = (after + after.T) / 2
        if moved < TOLERANCE:
            break
    unit = np.outer(scale, scale)
    return mean * scale, spread * unit, between * unit
