"""Rise time, overshoot and final speed of responses, from noise-free, averaged or counted speeds alike."""

from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float

LOW, HIGH = 0.1, 0.9
"""Shares of the change between which the rise time is taken."""
TAIL = 0.25
"""Share of the rows at the end that the final speed is the mean of."""


class Rows(NamedTuple):
    """Which rows of a curve belong to the response."""

    time: np.ndarray
    """(n,) [s]"""
    plateau: np.ndarray
    """(n,) after the change of the command, and measured."""
    period: float
    """Usual time between rows [s]."""
    initial: float
    """Speed before the change [rad/s]."""


class Response(NamedTuple):
    """Of one curve or many; NaN where the speed does not change or does not get there."""

    rise_time: Float[Any, "*batch"]
    """[s]"""
    overshoot: Float[Any, "*batch"]
    """Above the final speed [% of the change]."""
    final: Float[Any, "*batch"]
    """[rad/s]"""

    def of(self, curves: slice) -> "Response":
        """Of some of the curves."""
        return Response(*(values[curves] for values in self))


def response(curves: np.ndarray, rows: Rows, half: int) -> Response:
    """Of each of `curves` (curve, n) [rad/s], smoothed over `half` rows on either side (but for the final speed).

    NaN where all rows of the plateau are lost.
    """
    if not rows.plateau.any():
        return Response(*np.full((3, len(curves)), np.nan))
    final = curves[:, tail_of(rows.plateau)].mean(axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        share = (_smooth(curves, rows.plateau, half) - rows.initial) / (final - rows.initial)[:, None]
        rise = _crossing(share, rows, HIGH) - _crossing(share, rows, LOW)
    overshoot = 100 * np.maximum(share[:, rows.plateau].max(axis=1) - 1, 0.0)
    return Response(rise, np.where(np.isfinite(rise), overshoot, np.nan), final)


def measure(curves: np.ndarray, rows: Rows) -> Response:
    """Rise time, overshoot and final speed of each of `curves` (curve, n) [rad/s].

    All are smoothed over a quarter of the rise time of the first, which has no noise.
    """
    return response(curves, rows, _smoothing(float(response(curves[:1], rows, 0).rise_time[0]), rows))


def measure_runs(
    measured: np.ndarray, runs: np.ndarray, time: np.ndarray, initial: float
) -> tuple[Response, Response, Response]:
    """Of a `measured` speed (n,), of the first of `runs` (run, n), which has no noise, and of the others [rad/s].

    `time` (n,) is that of all rows [s], `initial` the speed before them [rad/s].
    """
    rows = Rows(time, np.ones(len(time), bool), float(time[1] - time[0]), initial)
    # Drawn motors may diverge.
    curves = np.nan_to_num(np.concatenate([runs, measured[None]]), nan=0.0, posinf=0.0, neginf=0.0)
    every = measure(curves, rows)
    return every.of(slice(-1, None)), every.of(slice(0, 1)), every.of(slice(1, -1))


def _smooth(curves: np.ndarray, used: np.ndarray, half: int) -> np.ndarray:
    """Mean over the used rows within `half` rows."""
    sums = np.cumsum(np.pad(np.where(used, curves, 0.0), ((0, 0), (1, 0))), axis=1)
    counts = np.cumsum(np.pad(used, (1, 0)))
    row = np.arange(len(used))
    first, end = np.maximum(row - half, 0), np.minimum(row + half + 1, len(used))
    return (sums[:, end] - sums[:, first]) / np.maximum(counts[end] - counts[first], 1)


def _crossing(share: np.ndarray, rows: Rows, level: float) -> np.ndarray:
    """(curve,) time at which each `share` (curve, n) first reaches `level`, on the line from the row before."""
    share, time = share[:, rows.plateau], rows.time[rows.plateau]
    reached = share >= level
    row = np.argmax(reached, axis=1)
    # Before the plateau the speed is the initial one.
    share, time = np.pad(share, ((0, 0), (1, 0))), np.concatenate([[time[0] - rows.period], time])
    start, end = (np.take_along_axis(share, (row + k)[:, None], axis=1)[:, 0] for k in (0, 1))
    part = (level - start) / (end - start)
    return np.where(reached.any(axis=1), time[row] + part * (time[row + 1] - time[row]), np.nan)


def tail_of(plateau: np.ndarray) -> np.ndarray:
    """The last quarter of the rows in `plateau`."""
    rows = np.flatnonzero(plateau)
    tail = np.zeros_like(plateau)
    tail[rows[-max(1, int(TAIL * len(rows))) :]] = True
    return tail


def _smoothing(rise_time: float, rows: Rows) -> int:
    """Rows on either side to smooth over: a quarter of the rise time in all, at most a tenth of the rows."""
    if not np.isfinite(rise_time):
        return 0
    return int(np.clip(rise_time / (8 * rows.period), 0, rows.plateau.sum() // 20))
