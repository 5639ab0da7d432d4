"""Rise time, overshoot and final speed of one response, from noise-free, averaged or counted speeds alike."""

from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from jaxmotor.prediction import bucket

LOW, HIGH = 0.1, 0.9
"""Shares of the change between which the rise time is taken."""
TAIL = 0.25
"""Share of the rows at the end that the final speed is the mean of."""


class Rows(NamedTuple):
    """Which rows of a curve belong to the response."""

    time: Float[Array, " n"]
    """[s]"""
    plateau: Bool[Array, " n"]
    """After the change of the command, and measured."""
    tail: Bool[Array, " n"]
    """Those at the end, for the final speed."""
    period: Float[Array, ""]
    """Usual time between rows [s]."""
    initial: Float[Array, ""]
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


def response(curve: Float[Array, " n"], rows: Rows, half: Int[Array, ""]) -> Response:
    """Of one `curve` [rad/s], smoothed over `half` rows on either side first (but for the final speed)."""
    tail = rows.tail.astype(curve.dtype)
    final = (curve * tail).sum() / tail.sum()
    share = (_smooth(curve, rows.plateau, half) - rows.initial) / (final - rows.initial)
    rise = _crossing(share, rows, HIGH) - _crossing(share, rows, LOW)
    overshoot = 100 * jnp.maximum(jnp.where(rows.plateau, share, -jnp.inf).max() - 1, 0.0)
    return Response(rise, jnp.where(jnp.isfinite(rise), overshoot, jnp.nan), final)


@eqx.filter_jit
def _responses(curves: Float[Array, "batch n"], rows: Rows, half: Int[Array, ""]) -> Response:
    return jax.vmap(response, (0, None, None))(curves, rows, half)


def measure(curves: np.ndarray, rows: Rows) -> Response:
    """Rise time, overshoot and final speed of each of `curves` (curve, n) [rad/s], in numpy.

    All are smoothed over a quarter of the rise time of the first, which has no noise.
    """
    # Whole blocks, so that few shapes are compiled.
    blocks = jnp.asarray(np.concatenate([curves, np.zeros((-len(curves) % 64, curves.shape[1]))]))
    first = _responses(blocks, rows, jnp.asarray(0))
    half = _smoothing(float(first.rise_time[0]), rows)
    every = _responses(blocks, rows, jnp.asarray(half))
    return Response(*(np.asarray(values)[: len(curves)] for values in every))


def measure_runs(
    measured: np.ndarray, runs: np.ndarray, time: np.ndarray, initial: float
) -> tuple[Response, Response, Response]:
    """Of a `measured` speed (n,), of the first of `runs` (run, n), which has no noise, and of the others [rad/s].

    `time` (n,) is that of all rows [s], `initial` the speed before them [rad/s].
    """
    number, size = len(time), bucket(len(time))
    curves = np.zeros((len(runs) + 1, size))
    curves[:-1, :number], curves[-1, :number] = runs, measured
    period, used = float(time[1] - time[0]), np.arange(size) < number
    rows = Rows(*map(jnp.asarray, (np.arange(size) * period, used, tail_of(used), period, float(initial))))
    # Drawn motors may diverge.
    every = measure(np.nan_to_num(curves, nan=0.0, posinf=0.0, neginf=0.0), rows)
    return every.of(slice(-1, None)), every.of(slice(0, 1)), every.of(slice(1, -1))


def _smooth(curve: Float[Array, " n"], used: Bool[Array, " n"], half: Int[Array, ""]) -> Float[Array, " n"]:
    """Mean over the used rows within `half` rows."""
    sums = jnp.cumsum(jnp.stack([jnp.where(used, curve, 0.0), used.astype(curve.dtype)]), axis=1)
    sums = jnp.pad(sums, ((0, 0), (1, 0)))
    row = jnp.arange(curve.shape[0])
    total, number = sums[:, jnp.minimum(row + half + 1, curve.shape[0])] - sums[:, jnp.maximum(row - half, 0)]
    return total / jnp.maximum(number, 1.0)


def _crossing(share: Float[Array, " n"], rows: Rows, level: float) -> Float[Array, ""]:
    """Time at which `share` first reaches `level`, on the line from the row before."""
    reached = rows.plateau & (share >= level)
    row = jnp.argmax(reached)
    number = jnp.arange(share.shape[0])
    before = jnp.where(rows.plateau & (number < row), number, -1).max()
    start = jnp.where(before < 0, 0.0, share[before])
    time = jnp.where(before < 0, rows.time[row] - rows.period, rows.time[before])
    part = (level - start) / (share[row] - start)
    return jnp.where(reached.any(), time + part * (rows.time[row] - time), jnp.nan)


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
    return int(np.clip(rise_time / (8 * float(rows.period)), 0, np.asarray(rows.plateau).sum() // 20))
