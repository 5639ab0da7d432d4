"""Numbers of a model file, and covariances: what can be meant, and what is damage."""

from typing import Any, TypeGuard

import numpy as np
from jaxtyping import Float

LARGEST = 1e12
"""No parameter, standard error or response is greater, in SI: what is leads only to overflow."""
RANGES = {
    "gain_rad_s_V": (1e-6, 1e9),
    "pole_rad_s": (1e-6, 1e9),
    "electrical_time_constant_s": (1e-9, 1e6),
    "voltage_offset_V": (0.0, 1e6),
    "viscous_share": (0.0, 1.0),
    "period_s": (1e-8, 1e4),
    "speed_window_s": (0.0, 1e4),
    "counts_per_rev": (1e-3, 1e9),
    "supply_V": (1e-3, 1e6),
    "duty_full_scale": (1e-6, 1e12),
    "duty_delay_s": (0.0, 1e4),
}
"""The least and the greatest magnitude of each number of a model."""
ROUNDING = 1e-6
"""Of correlations: a matrix that is less symmetric, or less positive, is damaged."""


def is_number(value: Any) -> TypeGuard[float | int]:
    """Whether `value` is a finite number that can be meant, not true or false."""
    return not isinstance(value, bool) and isinstance(value, int | float) and abs(value) <= LARGEST


def numbers(table: Any, shape: tuple[int | None, ...]) -> np.ndarray | None:
    """The numbers of nested lists of `shape`, None for any length; None where they are something else."""
    try:
        array = np.array(table)
    except (ValueError, OverflowError, RecursionError):
        return None
    if array.dtype.kind not in "iuf" or array.ndim != len(shape):
        return None
    if any(size not in (None, found) for size, found in zip(shape, array.shape, strict=True)):
        return None
    array = array.astype(float)
    return array if (np.abs(array) <= LARGEST).all() else None


def covariance_of(table: Any, size: int, name: str) -> Float[np.ndarray, "p p"]:
    """The covariance of `size` parameters that `table`, the value of `name`, holds.

    **Raises:** `ValueError`, a sentence, where it is none.
    """
    covariance = numbers(table, (size, size))
    if covariance is None:
        raise ValueError(f"{name} is not a table of {size} x {size} numbers")
    scale = np.sqrt(np.maximum(np.diag(covariance), 1e-100))
    correlation = covariance / scale / scale[:, None]
    if np.abs(correlation - correlation.T).max(initial=0.0) > ROUNDING:
        raise ValueError(f"{name} is not symmetric")
    if np.diag(covariance).min(initial=0.0) < 0 or np.linalg.eigvalsh(correlation).min() < -ROUNDING * size:
        raise ValueError(f"{name} is none: it has a negative variance")
    return (covariance + covariance.T) / 2


def in_range(key: str, value: float | int) -> bool:
    """Whether the number `key` of a model can be `value`."""
    low, high = RANGES[key]
    return low <= abs(value) <= high
