"""A cubic spline over a coordinate, periodic over a turn where that is asked for, with room for one jump."""

import dataclasses

import numpy as np
from jaxtyping import Float

INTERVALS = 24
"""Of a spline that is not periodic."""


@dataclasses.dataclass(frozen=True, eq=False)
class Spline:
    """Cubic, on `knots`; on one turn and periodic where `turn` says so; with a jump at one place if that is given."""

    knots: np.ndarray
    turn: bool = False
    jump: float | None = None
    width: float = 0.0
    """Half of the distance over which the jump is taken."""

    def columns(self, at: Float[np.ndarray, " n"], jump: bool = True) -> Float[np.ndarray, "n k"]:
        """Of each basis function, the jump (-1 to 1) last; places outside the knots count as the nearest knot."""
        smooth = _periodic(self.knots, at) if self.turn else _clamped(self.knots, at)
        if self.jump is None or not jump:
            return smooth
        return np.column_stack([smooth, steps(at, np.array([self.jump]), self.width)])

    def roughness(self, jump: bool = True) -> Float[np.ndarray, "k k"]:
        """c' R c is the integral of the squared second derivative, in units of its own; a jump costs nothing."""
        grid = np.linspace(self.knots[0], self.knots[-1], 20 * len(self.knots))
        smooth = self.columns(grid, jump=False)
        bends = np.diff(np.vstack([smooth, smooth[1:3]]) if self.turn else smooth, 2, axis=0)
        cost = bends.T @ bends
        size = len(cost) + int(jump and self.jump is not None)
        return np.pad(cost / np.trace(cost), (0, size - len(cost)))


def spline_over(at: np.ndarray, intervals: int = INTERVALS) -> Spline:
    """Knots half-way between evenly spread over the range and evenly over the data."""
    part = np.linspace(0, 1, intervals + 1)
    even = at.min() + part * np.ptp(at)
    return Spline(0.5 * (even + np.quantile(at, part)))


def steps(at: Float[np.ndarray, " n"], where: Float[np.ndarray, " k"], width: float = 0.0) -> Float[np.ndarray, "n k"]:
    """-1 before and 1 after each of `where`, a straight line over `width` on both sides of it."""
    return np.clip((at[:, None] - where) / max(width, 1e-12), -1.0, 1.0)


def _clamped(knots: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Cox and de Boor's recursion, of the four functions that are not zero at a place."""
    size, at = len(knots) - 1, np.clip(at, knots[0], knots[-1])
    whole = np.concatenate([np.full(3, knots[0]), knots, np.full(3, knots[-1])])
    cell = np.clip(np.searchsorted(knots, at, side="right") - 1, 0, size - 1)
    local = [np.ones_like(at)]
    for degree in range(1, 4):
        above, carried = [], np.zeros_like(at)
        for k, value in enumerate(local):
            right, left = whole[cell + 4 + k], whole[cell + 4 + k - degree]
            share = value / (right - left)
            above.append(carried + (right - at) * share)
            carried = (at - left) * share
        local = [*above, carried]
    columns = np.zeros((len(at), size + 3))
    for k, value in enumerate(local):
        columns[np.arange(len(at)), cell + k] = value
    return columns


def _periodic(knots: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Evenly spaced, one function about each knot but the last, which is the first again."""
    size = len(knots) - 1
    place = (at - knots[0]) / (knots[-1] - knots[0]) * size
    away = np.abs((place[:, None] - np.arange(size) + size / 2) % size - size / 2)
    near, far = 2 / 3 - away**2 + away**3 / 2, np.maximum(2 - away, 0.0) ** 3 / 6
    return np.where(away < 1, near, far)
