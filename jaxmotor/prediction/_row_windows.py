"""From how many rows before it each speed of a log of uneven rows is a mean, where the data show it. Numpy only.

Speeds are often made of the counts of the last N rows: over the time that these took, or over N usual rows as if rows
were even. Both differ from a mean over a fixed time as rows happen to be longer and shorter, which nothing in a motor
follows. A first-order motor under the log's voltages, fitted with an offset and friction, is read in each way: of the
fixed window r is the residual, and c what the other way would change. In

    b = Σ r c / Σ c²,   z = Σ r c / √Σ (r c)²

b is near one where speeds were made so and near zero where not, and z is b over its standard error, whatever else the
motor lacks. What another gain and another fixed length would change is taken out of both. The way with the greatest z
is the log's if it leaves less than every fixed window, speeds at the rows, and these smoothed from row to row.
"""

import dataclasses
import functools
from typing import NamedTuple

import numpy as np

from jaxmotor._balanced import solve_balanced
from jaxmotor.prediction._flexible_model import (
    LogRows,
    direction_of,
    first_order,
    late,
    pole_and_delay,
    states,
    without_starts,
)
from jaxmotor.prediction._packing import log_rows, rows_span
from jaxmotor.recording import Recording

MOST_ROWS = 20
"""The longest window that is tried."""
ENOUGH_ROWS = 20_000
"""The first of a log, which decide."""
POLES = 16
"""That are tried at once."""
WITHIN = 2.0
"""Factor by which the pole may differ from that of a motor with a delay in the place of the window."""
DELAYS = (0.0, 0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 6.0, 8.0)
"""Rows by which the voltage may come late, beside the window."""
SURE = 5.0
"""Standard errors."""
LONGER = 1.02
"""Factor by which a window is longer whose change stands for that of any."""
BLOCKS = 20
"""Of rows, whose sums scatter independently."""
WEIGHTS = (0.1, 0.15, 0.2, 0.3, 0.4, 0.5, 0.6, 0.75, 0.9)
"""Of a speed in one that is smoothed from row to row."""
NEAR = 0.5
"""By which the share b may differ from one."""


class RowWindow(NamedTuple):
    """Each speed is a mean over the last `rows` rows."""

    rows: int
    as_even: bool
    """What the shaft turned was divided by as many usual rows, not by the time it took."""
    length_s: float
    """As many usual rows [s]."""
    errors: float = np.inf
    """z"""


def row_window(recording: Recording, segments: tuple[int, ...]) -> RowWindow | None:
    """Of the `segments` (indices) of `recording`; None where it is no log of speeds at uneven times, or shows none.

    Where the header states a window, that many rows alone are tried.
    """
    if recording.measured != "speed" or recording.period_s is not None:
        return None
    if recording.speed_window_rows is not None or recording.speed_pulses_per_rev is not None:
        return None
    rows = log_rows(dataclasses.replace(recording, speed_window_s=None), segments).first(ENOUGH_ROWS)
    usual_s, stated_s = rows.typical_s, recording.speed_window_s
    numbers = range(1, MOST_ROWS + 1) if stated_s is None else [round(stated_s / usual_s)]
    if numbers[0] < 1:
        return None
    pole, delay_s = pole_and_delay(rows)
    poles = np.geomspace(pole / WITHIN, pole * WITHIN, POLES)
    # One at a time: those of a long log take a hundred megabytes.
    motions = functools.lru_cache(1)(lambda late_s: _motions(rows, poles, late_s))
    # A window is half of itself late; the rest of the delay is not the window's.
    found = [
        one
        for number in numbers
        for one in _tried(rows, motions(max(delay_s - number * usual_s / 2, 0.0)), number, usual_s)
    ]
    best = max(found, key=lambda one: one.window.errors, default=None)
    if best is None or best.window.errors < SURE:
        return None
    # Both with the delay that suits them best: the one above is a guess.
    nearest = min(found, key=lambda one: one.fixed_square)
    again = [
        one
        for late_rows in DELAYS
        for number in {best.window.rows, nearest.window.rows}
        for one in _tried(rows, motions(late_rows * usual_s), number, usual_s)
    ]
    alike = [one.square for one in (best, *again) if one.window[:2] == best.window[:2]]
    others = [one.fixed_square for one in (nearest, *again)]
    if stated_s is None:  # else speeds are means
        others += [_read_square(rows, poles, delay_s, (1.0,)), _read_square(rows, poles, 0.0, WEIGHTS)]
    return best.window if min(alike) < min(others) else None


def by_rows(recording: Recording, window: RowWindow) -> Recording:
    """`recording` with a header that states `window`, and with speeds that were divided by the time they took."""
    stated = {"speed_window_s": window.length_s, "speed_window_rows": window.rows}
    if not window.as_even:
        return dataclasses.replace(recording, **stated)
    segments = []
    for segment in recording.segments:
        assert segment.speed_rad_s is not None
        spans = rows_span(segment.time_s, window.rows, window.length_s)
        segments.append(dataclasses.replace(segment, speed_rad_s=segment.speed_rad_s * window.length_s / spans))
    return dataclasses.replace(recording, segments=tuple(segments), **stated)


class _Tried(NamedTuple):
    window: RowWindow
    square: float
    """Mean square of the residual with it [rad²/s²]."""
    fixed_square: float
    """The same with a fixed window of about its length."""


class _Motions(NamedTuple):
    """First-order motors of unit gain with several poles."""

    poles: np.ndarray
    """(pole,) [rad/s]."""
    drives: np.ndarray
    """(n, c) voltage, an offset of 1 V, friction of 1 V [V]."""
    angle: np.ndarray
    """(n, pole, c) under each of the drives [rad]."""
    start: np.ndarray
    """(n, pole) of pieces that begin at 1 rad/s [rad]."""


def _motions(rows: LogRows, poles: np.ndarray, late_s: float) -> _Motions:
    drives = np.stack([late(rows, late_s), np.ones_like(rows.volts), direction_of(rows)], axis=1)
    wide = np.concatenate([np.repeat(drives, POLES, axis=1), np.zeros((len(drives), POLES))], axis=1)
    _, turned = first_order(rows, wide[:, : 3 * POLES], np.tile(poles, 3))
    _, begun = first_order(rows, wide[:, 3 * POLES :], poles, 1.0)
    angle = np.moveaxis(_until(turned).reshape(len(drives), 3, POLES), 1, 2)
    return _Motions(poles, drives, angle, _until(begun))


def _read_square(rows: LogRows, poles: np.ndarray, late_s: float, weights: tuple[float, ...]) -> float:
    """The least mean square that speeds y[k] = y[k-1] + b (x[k] - y[k-1]) leave of all b = `weights`, x those of the
    motor at the rows under voltages that act `late_s` later."""
    drives = np.stack([late(rows, late_s), np.ones_like(rows.volts), direction_of(rows)], axis=1)
    begins, least = rows.reset[1:, None], np.inf
    for pole in poles[:, None]:
        speed, _ = first_order(rows, drives, pole)
        begun, _ = first_order(rows, 0 * drives[:, :1], pole, 1.0)
        speed = np.concatenate([speed, begun], axis=1)
        for weight in weights:
            decay, inject = np.where(begins, 0.0, 1 - weight), np.where(begins, 1.0, weight) * speed[1:]
            smooth = states(np.append(decay, [[0.0]], axis=0), np.append(inject, inject[-1:], axis=0), speed[0])
            least = min(least, _fit(rows, rows.valid, smooth[:, :3], smooth[:, 3])[0])
    return least / float(rows.valid.sum())


def _until(turned: np.ndarray) -> np.ndarray:
    """The sum of the rows before each."""
    return np.cumsum(turned, axis=0) - turned


class _Window(NamedTuple):
    """(n,) of the last rows of each row."""

    valid: np.ndarray
    first: np.ndarray
    """The row in which it begins, or with which its piece does."""
    span_s: np.ndarray


def _window(rows: LogRows, number: int, usual_s: float) -> _Window:
    each, first = np.arange(len(rows.volts)), np.flatnonzero(rows.reset)[rows.piece]
    time = _until(rows.duration)
    begin = np.maximum(each - number, first)
    missing = np.maximum(first - (each - number), 0)
    valid = rows.valid & ((missing == 0) | (rows.free[first] == 0))
    return _Window(valid, begin, time - time[begin] + usual_s * missing)


def _tried(rows: LogRows, motions: _Motions, number: int, usual_s: float) -> list[_Tried]:
    """Both ways in which speeds may be means over the last `number` rows, where the data want them."""
    window = _window(rows, number, usual_s)
    if window.valid.sum() < 100:
        return []
    spans = window.span_s[:, None]
    read = (motions.angle - motions.angle[window.first]) / spans[..., None]
    start = (motions.start - motions.start[window.first]) / spans
    fits = [_fit(rows, window.valid, read[:, k], start[:, k]) for k in range(POLES)]
    best = int(np.argmin([square for square, _, _ in fits]))
    _, gains, speeds = fits[best]
    drive = motions.drives @ gains
    turning, turned = first_order(rows, drive[:, None], motions.poles[best : best + 1], speeds[rows.piece])
    by_row = (_until(turned)[:, 0] - _until(turned)[window.first, 0]) / window.span_s
    whole = number * usual_s
    motion = drive, float(motions.poles[best]), turning[:, 0], _until(turned)[:, 0]
    fixed, longer = (_fixed(rows, *motion, factor * whole)[window.valid] for factor in (1.0, LONGER))
    by_row, speed, spans_s = by_row[window.valid], rows.speed[window.valid], window.span_s[window.valid]
    changes = [by_row * (spans_s / whole if as_even else 1.0) - fixed for as_even in (False, True)]
    # Another gain and another fixed window explain as much of each as they can.
    residual, *changes = _without(np.stack([fixed, longer - fixed], axis=1), speed - fixed, *changes)
    windows = [
        RowWindow(number, as_even, whole, _errors(residual, change))
        for as_even, change in zip((False, True), changes, strict=True)
    ]
    squares = [float(np.mean((residual - change) ** 2)) for change in changes]
    fixed_square = float(np.mean(residual**2))
    return [_Tried(one, square, fixed_square) for one, square in zip(windows, squares, strict=True)]


def _without(columns: np.ndarray, *several: np.ndarray) -> list[np.ndarray]:
    """What least squares on `columns` (n, c) leaves of each (n,)."""
    return [one - columns @ solve_balanced(columns.T @ columns, columns.T @ one, 1e-10) for one in several]


def _fit(
    rows: LogRows, valid: np.ndarray, columns: np.ndarray, start: np.ndarray
) -> tuple[float, np.ndarray, np.ndarray]:
    """Sum of squares, (c,) factors of the columns and (pieces,) initial speeds, by least squares of the speed."""
    start = start * valid
    both = np.concatenate([rows.speed[:, None], columns], axis=1) * valid[:, None]
    alone = without_starts(rows, both, start)
    error, matrix = alone[:, 0], alone[:, 1:]
    gains = solve_balanced(matrix.T @ matrix, matrix.T @ error, 1e-10)
    begin = np.flatnonzero(rows.reset)
    size = np.add.reduceat(start**2, begin)
    left = both[:, 0] - both[:, 1:] @ gains
    speeds = np.add.reduceat(start * left, begin) / np.where(size > 0, size, 1.0)
    return float(((error - matrix @ gains) ** 2).sum()), gains, speeds


def _fixed(
    rows: LogRows, drive: np.ndarray, pole: float, speed: np.ndarray, angle: np.ndarray, length_s: float
) -> np.ndarray:
    """(n,) means over a fixed time before each row."""
    time, first = _until(rows.duration), np.flatnonzero(rows.reset)[rows.piece]
    begin = time - length_s
    row = np.clip(np.searchsorted(time, begin, side="right") - 1, first, None)
    part = np.maximum(begin - time[row], 0.0)
    inside = drive[row] * part + (speed[row] - drive[row]) * (1 - np.exp(-part * pole)) / pole
    return (angle - angle[row] - inside) / length_s


def _errors(residual: np.ndarray, change: np.ndarray) -> float:
    """z; none where b is not near one."""
    each, squares = residual * change, change**2
    scatter, size = float(np.sqrt((each**2).sum())), float(squares.sum())
    if not scatter > 0 or not size > 0:
        return 0.0
    share = float(each.sum()) / size
    # Neighbours may belong together: a motion that is not followed well, in rows that are longer by turns.
    edges = np.linspace(0, len(each), BLOCKS, endpoint=False).astype(int)
    of_blocks = np.add.reduceat(each - share * squares, edges)
    scatter = max(scatter, float(np.sqrt((of_blocks**2).sum())))
    return share * size / scatter if abs(share - 1) < NEAR else 0.0
