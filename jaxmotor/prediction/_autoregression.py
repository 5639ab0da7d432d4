"""Colour of a residual: e_k = Σ a_i e_{k-i} + w_k, of the order that Schwarz's criterion asks for. Numpy only."""

from typing import NamedTuple

import numpy as np

ORDER = 20
"""Highest order."""
ROWS_PER_WEIGHT = 10
"""The fewest."""


class Autoregression(NamedTuple):
    """What the rows before say of a row."""

    weights: np.ndarray
    """(order,) a, the latest row's first."""
    variance: float
    """Of w [squared unit of e]."""
    whole: float
    """Of e [the same]."""


def autoregression(residual: np.ndarray, piece: np.ndarray, used: np.ndarray | None = None) -> Autoregression:
    """Of `residual` (n,), whose rows belong to pieces `piece` (n,), those of one piece next to each other.

    `used` (n,) chooses rows; all before them in their piece are taken as they are.
    """
    used = np.ones(len(residual), bool) if used is None else used
    size = int(used.sum())
    most = min(ORDER, size // ROWS_PER_WEIGHT)
    since = np.arange(len(piece)) - np.maximum.accumulate(
        np.where(np.diff(piece, prepend=-1) != 0, np.arange(len(piece)), 0)
    )
    full = used & (since >= most)
    if most < 1 or full.sum() < 4 * most:
        whole = float((residual[used] ** 2).mean()) if size else 0.0
        return Autoregression(np.zeros(0), whole, whole)
    rows = np.flatnonzero(full)
    past = np.stack([residual[rows - lag] for lag in range(most + 1)])
    # As a sum of products, not by a library whose threads wait for each other while fits run side by side.
    return _by_schwarz(np.einsum("pn,qn->pq", past, past), len(rows))


def _by_schwarz(gram: np.ndarray, size: int) -> Autoregression:
    """From the Gram matrix of e_k, e_{k-1}, ... over `size` rows."""
    whole = max(float(gram[0, 0]) / size, 1e-300)
    best = (np.inf, Autoregression(np.zeros(0), whole, whole))
    for order in range(len(gram)):
        chosen = np.arange(1, order + 1)
        normal = gram[np.ix_(chosen, chosen)] + 1e-12 * np.trace(gram) * np.eye(order)
        weights = np.linalg.solve(normal, gram[chosen, 0])
        variance = max(float(gram[0, 0] - weights @ gram[chosen, 0]), 1e-300) / (size - order)
        cost = size * np.log(variance) + order * np.log(size)
        if cost < best[0]:
            best = (cost, Autoregression(weights, variance, whole))
    return best[1]


def one_step(columns: np.ndarray, weights: np.ndarray, piece: np.ndarray) -> np.ndarray:
    """Φ(L) of `columns` (n, c): what is new in each row; before a piece there is nothing."""
    return columns - _lagged_sum(columns, weights, piece)


def k_steps(columns: np.ndarray, weights: np.ndarray, piece: np.ndarray, steps: int) -> np.ndarray:
    """The error of a prediction `steps` rows ahead: what is new in each row, weighed by 1/Φ up to there."""
    response = np.zeros(steps)
    response[0] = 1.0
    for k in range(1, steps):
        reach = min(k, len(weights))
        response[k] = weights[:reach] @ response[k - reach : k][::-1]
    return columns + _lagged_sum(columns, response[1:], piece)


def _lagged_sum(columns: np.ndarray, weights: np.ndarray, piece: np.ndarray) -> np.ndarray:
    """Σ weights_i columns_{k-i} within pieces."""
    total = np.zeros_like(columns)
    for lag, weight in enumerate(weights, start=1):
        same = (piece[lag:] == piece[:-lag])[:, None]
        total[lag:] += weight * np.where(same, columns[:-lag], 0.0)
    return total
