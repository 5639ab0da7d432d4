"""Readings that a log repeats until the next one comes.

A motor controller that sends its speed every 20 ms to a program that logs every 5 ms, or a board that counts for 50 ms
and prints every 10: most rows say again what is known. A shaft that moves by more than the readings' step from one new
reading to the next does not stand still between them, so such rows are no measurement. They are left out, and the row
of a reading has the mean voltage until the next one. So it is with counts and angles whose cells are mostly empty.
"""

from typing import NamedTuple

import numpy as np

from jaxmotor.recording._log_columns import Log

STEPS = 2.0
"""Of the readings' grid, that a reading must change by to tell motion from rounding."""
FEWEST = 20
"""Changes of that size that show how long readings stay."""
REGULAR = 0.8
"""Share of these that must come after the usual time, to half of it: pulses of a sensor come when they come."""


class Repeats(NamedTuple):
    """How long each reading stays."""

    rows: int
    time_s: float


def without_repeats(log: Log, bounds: np.ndarray) -> tuple[Log, np.ndarray, Repeats | None]:
    """`log` with the rows of new readings, the `bounds` (segments + 1,) of its segments there, and what was seen.

    As it is, where readings are not repeated, or where a supply was measured while duties changed.
    """
    [shaft] = log.shaft.values()
    begins = np.zeros(len(shaft), bool)
    begins[bounds[:-1]] = True
    if log.after_gap is not None:
        begins |= log.after_gap
    begins |= np.diff(shaft, prepend=shaft[:1]) != 0
    repeats = _repeats(log.stamps[0], shaft, np.flatnonzero(begins), bounds)
    if repeats is None:
        return log, bounds, None
    shorter = _with_means(log, _kept(np.flatnonzero(begins), len(shaft), repeats.rows), bounds)
    return (log, bounds, None) if shorter is None else (*shorter, repeats)


def without_unread(log: Log, bounds: np.ndarray) -> tuple[Log, np.ndarray, Repeats | None]:
    """As `without_repeats`, with the rows at which the shaft was read; they are gaps where that cannot be."""
    kept = np.flatnonzero(log.read)
    shorter = _with_means(log, kept, bounds)
    if shorter is None:
        return log.only(log.read), np.searchsorted(kept, bounds), None
    within = ~np.isin(kept[1:], bounds)
    usual_s = float(np.median(np.diff(log.stamps[0][kept])[within]))
    return *shorter, Repeats(int(np.median(np.diff(kept)[within])), usual_s)


def _with_means(log: Log, kept: np.ndarray, bounds: np.ndarray) -> tuple[Log, np.ndarray] | None:
    """The rows `kept` of `log`, each with the mean voltage until the next, and the `bounds` of its segments there; None
    where a supply was measured while duties changed."""
    volts, duty, full = log.input
    if duty is not None and (np.minimum.reduceat(duty, kept) != np.maximum.reduceat(duty, kept)).any():
        if log.supply_V is not None:
            return None
        duty = full = None
    inputs = _means(volts, log.stamps[0], kept, bounds), None if duty is None else duty[kept], full
    after_gap = None if log.after_gap is None else log.after_gap[kept]
    return log.at(kept, inputs, after_gap), np.searchsorted(kept, bounds)


def _repeats(time_s: np.ndarray, shaft: np.ndarray, begins: np.ndarray, bounds: np.ndarray) -> Repeats | None:
    """None where a reading that changes much mostly does so in the row after the last change."""
    change = np.abs(np.diff(shaft.astype(np.float64), prepend=shaft[:1]))
    within = change > 1e-9 * change.max(initial=0.0)
    if not within.any():
        return None
    large = change > STEPS * change[within].min()
    large[bounds[:-1]] = False
    pairs = large[begins[:-1]] & large[begins[1:]]
    rows, length_s = np.diff(begins)[pairs], np.diff(time_s[begins])[pairs]
    if len(rows) < FEWEST or np.median(rows) < 2:
        return None
    usual_s = float(np.median(length_s))
    regular = np.abs(length_s - usual_s) < 0.5 * usual_s
    return Repeats(int(np.median(rows)), usual_s) if regular.mean() >= REGULAR else None


def _kept(begins: np.ndarray, number: int, rows: int) -> np.ndarray:
    """The rows at which a reading `begins`; where one stays longer, those at which an equal one must have come."""
    each = np.maximum(np.rint(np.diff(begins, append=number) / rows).astype(int), 1)
    again = np.arange(each.sum()) - np.repeat(np.cumsum(each) - each, each)
    return np.repeat(begins, each) + rows * again


def _means(volts: np.ndarray, time_s: np.ndarray, kept: np.ndarray, bounds: np.ndarray) -> np.ndarray:
    """(kept,) mean voltage from each kept row to the next [V]."""
    last = bounds[1:] - 1
    length = np.diff(time_s, append=time_s[-1:])
    length[last] = np.median(length)
    return np.add.reduceat(volts * length, kept) / np.add.reduceat(length, kept)
