"""Readings that a log repeats until the next one comes.

A motor controller that sends its speed every 20 ms to a program that logs every 5 ms, or a board that counts for 50 ms
and prints every 10: most rows say again what is known. A shaft that moves by more than the readings' step from one new
reading to the next does not stand still between them, so such rows are no measurement. Of speeds they are rows without
a reading, which keep their input. Counts and angles are turns from one reading to the next: there they are left out,
and the row of a reading has the mean voltage until the next one. So it is with counts and angles whose cells are mostly
empty.
"""

import dataclasses
from typing import NamedTuple

import numpy as np

from jaxmotor.recording._log_columns import Log

STEPS = 2.0
"""Of the readings' grid, that a reading must change by to tell motion from rounding."""
FEWEST = 20
"""Changes of that size that show how long readings stay."""
FEW = 5
"""Times as many even rows are kept: uneven ones take 1.3 to 3 times as long each (`benchmarks/simulation_speed.py`)."""
REGULAR = 0.8
"""Share of these that must come after the usual time, to half of it: pulses of a sensor come when they come."""


class Repeats(NamedTuple):
    """How long each reading stays."""

    rows: int
    time_s: float


def without_repeats(log: Log, bounds: np.ndarray) -> tuple[Log, np.ndarray, Repeats | None]:
    """`log` with the rows of new readings, the `bounds` (segments + 1,) of its segments there, and what was seen; of
    speeds with the rows between, too.

    As it is, where readings are not repeated, or where a supply was measured while duties changed.
    """
    read = np.flatnonzero(log.read)
    seen, ends = (log, bounds) if log.unread is None else (log.only(log.read), np.searchsorted(read, bounds))
    [(measured, shaft)] = seen.shaft.items()
    is_speed = measured == "speed_rad_s"
    begins = np.zeros(len(shaft), bool)
    begins[ends[:-1]] = True
    after_gap = seen.after_gap if not is_speed or log.after_gap is None else log.after_gap[read]
    begins |= after_gap is not None and after_gap
    begins |= np.diff(shaft, prepend=shaft[:1]) != 0
    repeats = _repeats(seen.stamps[0], shaft, np.flatnonzero(begins), ends)
    if repeats is None:
        return log, bounds, None
    kept = _kept(np.flatnonzero(begins), len(shaft), repeats.rows)
    if is_speed:
        # When a reading came that was first seen after a row without one is not known.
        late = (np.diff(read, prepend=-1) > 1) & ~np.isin(read, bounds)
        return *_with_rows_between(log, read[kept[~late[kept]]], bounds), repeats
    shorter = _with_means(seen, kept, ends)
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


def _with_rows_between(log: Log, kept: np.ndarray, bounds: np.ndarray) -> tuple[Log, np.ndarray]:
    """`log`, which was read in the rows `kept` alone, and its `bounds`: every so many rows of it as lose no reading and
    no change of the input; or only the rows of these, where they are few."""
    columns = [column for column in (*log.input[:2], log.supply_V) if column is not None]
    needed = np.zeros(len(columns[0]), bool)
    needed[kept] = True
    unread = ~needed
    for column in columns:
        needed[1:] |= column[1:] != column[:-1]
    place = np.arange(len(needed)) - np.repeat(bounds[:-1], np.diff(bounds))
    stride = max(int(np.gcd.reduce(place[needed])), 1)
    last = kept[np.searchsorted(kept, bounds[1:]) - 1]
    within = np.arange(len(needed)) <= np.repeat(last, np.diff(bounds))
    rows, few = np.flatnonzero((place % stride == 0) & within), np.flatnonzero(needed & within)
    rows = few if FEW * len(few) < len(rows) else rows
    volts, duty, full = log.input
    inputs = volts[rows], None if duty is None else duty[rows], full
    after_gap = None if log.after_gap is None else log.after_gap[rows]
    return dataclasses.replace(log, unread=unread).at(rows, inputs, after_gap), np.searchsorted(rows, bounds)


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
