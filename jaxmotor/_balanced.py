"""Symmetric equations whose unknowns have units of their own, brought to ones on the diagonal (Jacobi)."""

import numpy as np


def balanced(normal: np.ndarray, damping: float | np.ndarray = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """`normal` (..., p, p) over a scale (..., p) on both sides, with `damping` on its diagonal; and the scale."""
    scale = np.sqrt(np.maximum(np.diagonal(normal, axis1=-2, axis2=-1), 1e-300))
    return normal / (scale[..., :, None] * scale[..., None, :]) + damping * np.eye(scale.shape[-1]), scale


def solve_balanced(normal: np.ndarray, right: np.ndarray, damping: float | np.ndarray) -> np.ndarray:
    """x (..., p) of `normal` x = `right` (..., p)."""
    ones, scale = balanced(normal, damping)
    return np.linalg.solve(ones, (right / scale)[..., None])[..., 0] / scale
