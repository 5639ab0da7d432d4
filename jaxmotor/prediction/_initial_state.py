"""How pieces begin: in motion at a speed that is fitted, while the voltage before them may still act; and with a load
anywhere within its gap.

Begins (k,) are the speed of each piece [rad/s], zero at rest; for motors with a gap (2k,) followed by the place of the
load within it, from -1 to 1.
"""

import dataclasses
from collections.abc import Callable

import numpy as np

from jaxmotor.motor import Motor
from jaxmotor.motor.effects._substep import parts_of
from jaxmotor.prediction._log import Log
from jaxmotor.prediction._packing import Packed
from jaxmotor.recording import Recording

LATE = 4
"""Ticks for which a voltage may still act: more than a hobby rig's delay, and three times the current's lag."""
SPEED_STEP = 0.05
"""Over which initial speeds are differenced [rad/s]."""
ROUNDS = 3
"""Of Newton's method for the initial speeds."""
FORGOTTEN = 5.0
"""Time constants after which a filter has forgotten where it began: what is left is less than 1 %."""
FIRST_ROWS = 3
"""Of a piece, whose readings say at which speed about it begins."""
PLACES = np.linspace(-1, 1, 8)
"""Of a load within its gap, from one edge to the other, that are tried."""
BETWEEN = np.linspace(-0.25, 0.25, 8)
"""The same about the best of them."""


def without_transients(recording: Recording, packed: Packed, filter_s: float = 0.0) -> Packed:
    """`packed` without what was observed in the first rows of pieces before which other voltages had been applied, and
    while a filter of the readings with the time constant `filter_s` still shows where it began.

    A piece that does not begin at rest begins at a speed that is fitted. A delay, or the current's lag, carries older
    voltages into it, which the piece does not hold; once they have passed, that speed makes up for them.
    """
    valid = packed.batch.valid.copy()
    for sequence, first in zip(*np.nonzero(packed.batch.free), strict=True):
        segment, row = int(packed.segment_of[sequence, first]), int(packed.row_of[sequence, first])
        late = LATE if row > 0 or _driven_before(recording, segment) else 0
        rows = np.flatnonzero(valid[sequence] & (packed.batch.piece[sequence] == packed.batch.piece[sequence, first]))
        since = packed.time_s[sequence, rows] - packed.time_s[sequence, first]
        first_rows = max(late, int(np.searchsorted(since, FORGOTTEN * filter_s)))
        valid[sequence, rows[: min(first_rows, len(rows) // 3)]] = False
    return dataclasses.replace(packed, batch=packed.batch._replace(valid=valid))


def _driven_before(recording: Recording, index: int) -> bool:
    """A voltage was applied within `LATE` ticks before the segment `index`."""
    if index == 0:
        return False
    before, segment = recording.segments[index - 1], recording.segments[index]
    tick = recording.period_s or float(np.median(np.diff(segment.time_s)))
    ago = segment.start_s - (before.start_s + before.time_s)
    return bool((before.volts[(ago > 0) & (ago < (LATE + 0.5) * tick)] != 0).any())


def first_speeds(log: Log) -> np.ndarray:
    """(k,) of each piece that does not begin at rest, the mean of what its first rows show [rad/s]; else zero."""
    batch = log.problem.batch
    speeds = np.zeros(log.problem.pieces + 1)
    valid, piece = np.asarray(batch.valid), np.asarray(batch.piece)
    for sequence, row in zip(*np.nonzero(np.asarray(batch.free)), strict=True):
        used = np.flatnonzero(valid[sequence] & (piece[sequence] == piece[sequence, row]))[:FIRST_ROWS]
        if used.size:
            speeds[piece[sequence, row]] = float(np.asarray(batch.observed)[sequence, used].mean())
    duration = float(np.asarray(log.measured_log.duration))
    return speeds * float(log.problem.unit) / (duration if log.problem.kind == "turn" else 1.0)


def in_motion(log: Log) -> np.ndarray:
    """(k,) which pieces begin in motion."""
    batch = log.problem.batch
    free = np.zeros(log.problem.pieces + 1, bool)
    free[np.asarray(batch.piece)[np.asarray(batch.free) > 0]] = True
    return free


def as_begins(begins: np.ndarray, pieces: int, motor: Motor) -> np.ndarray:
    """`begins` (..., k or 2k) of k = `pieces` as those of `motor`: of a load that they do not know in the middle."""
    if not parts_of(motor.effects).has_gap:
        return begins[..., :pieces]
    return begins if begins.shape[-1] > pieces else np.concatenate([begins, np.zeros_like(begins)], axis=-1)


def fit_initial_places(
    residuals: Callable[[np.ndarray], np.ndarray], start: np.ndarray, piece: np.ndarray
) -> np.ndarray:
    """`start` (2k,) with the places that fit each piece best.

    Nobody measures where a load is. `residuals` (8, n) of begins (8, 2k) belong to pieces `piece` (n,). A piece by
    itself, on a grid: where contacts come and go there are many minima.
    """
    tried = np.repeat(start[None], len(PLACES), axis=0)
    speeds, best = np.split(tried, 2, axis=1)
    least = _by_piece(residuals(tried)[:1] ** 2, piece, best.shape[1])
    for grid in (PLACES, BETWEEN):
        places = np.clip(grid[:, None] + (best if grid is BETWEEN else 0.0), -1.0, 1.0)
        places = np.broadcast_to(places, best.shape)
        squares = _by_piece(residuals(np.concatenate([speeds, places], axis=1)) ** 2, piece, best.shape[1])
        squares, places = np.concatenate([least, squares]), np.concatenate([best[:1], places])
        chosen = np.argmin(squares, axis=0)[None]
        least = np.take_along_axis(squares, chosen, axis=0)
        best = np.repeat(np.take_along_axis(places, chosen, axis=0), len(PLACES), axis=0)
    return np.concatenate([speeds[0], best[0]])


def fit_initial_speeds(
    residuals: Callable[[np.ndarray], np.ndarray], start: np.ndarray, piece: np.ndarray, moves: np.ndarray
) -> np.ndarray:
    """`start` (batch, k or 2k) with the speeds that fit each piece best which `moves` (k,) at first.

    `residuals` (2 batch, n) of begins as many belong to pieces `piece` (n,). Gauss-Newton, a piece by itself.
    """
    speeds, step, least = start, np.zeros_like(start), np.full(start.shape, np.inf)
    for _ in range(ROUNDS):
        tried = speeds + step
        residual, moved = np.split(residuals(np.concatenate([tried, faster(tried, SPEED_STEP * moves)])), 2)
        square = _by_piece(residual**2, piece, start.shape[1])
        # Near rest friction bends what a speed does; a step that makes a piece worse is not taken.
        better = square < least
        speeds, least = np.where(better, tried, speeds), np.where(better, square, least)
        column = (moved - residual) / SPEED_STEP
        size = _by_piece(column**2, piece, start.shape[1])
        right = _by_piece(column * residual, piece, start.shape[1])
        step = np.where(better, -right / np.where(size > 1e-12, size, np.inf), 0.5 * step)
    return speeds


def faster(begins: np.ndarray, by: np.ndarray | float) -> np.ndarray:
    """`begins` (..., k or 2k) with speeds that are greater `by` (..., k) [rad/s]."""
    more = np.zeros_like(begins)
    speeds = more[..., : np.shape(by)[-1]] if np.ndim(by) else more
    speeds += by
    return begins + more


def without_initial_speeds(
    columns: np.ndarray, starts: np.ndarray, piece: np.ndarray, pieces: int
) -> tuple[np.ndarray, np.ndarray]:
    """`columns` (n, c) without what initial speeds explain, and the speeds (pieces, c) that explain it.

    `starts` (n,) is what one rad/s of initial speed adds to the piece `piece` (n,) that a row belongs to.
    """
    # Of a wild motor columns are infinite, and stay it.
    with np.errstate(invalid="ignore", over="ignore"):
        size = np.bincount(piece, starts**2, pieces)
        each = _by_piece((starts[:, None] * columns).T, piece, pieces).T
        shift = each / np.where(size > 1e-12, size, np.inf)[:, None]
        return columns - starts[:, None] * shift[piece], shift


def _by_piece(values: np.ndarray, piece: np.ndarray, pieces: int) -> np.ndarray:
    """(batch, pieces) sums of `values` (batch, n)."""
    return np.stack([np.bincount(piece, row, pieces) for row in values])
