"""Readings that a log repeats until the next one comes.

A motor controller that sends its speed every 20 ms to a program that logs every 5 ms, or a board that counts for 50 ms
and prints every 10: most rows say again what is known. A shaft that moves by more than the readings' step from one new
reading to the next does not stand still between them, so such rows are no measurement: they are rows without a
reading, which keep their input. Counts and angles say what was turned since the reading before: where the input changed
meanwhile they become mean speeds over that time, and where it did not the rows of readings alone are kept. So it is
with counts and angles whose cells are mostly empty.
"""

import dataclasses
from typing import NamedTuple

import numpy as np

from jaxmotor.recording._log_columns import Inputs, Log

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


def without_repeats(
    log: Log, bounds: np.ndarray, counts_per_rev: float | None
) -> tuple[Log, np.ndarray, Repeats | None]:
    """`log` with rows without a reading for those that repeat one, the `bounds` (segments + 1,) of its segments there,
    and what was seen. As it is, where readings are not repeated."""
    read = np.flatnonzero(log.read)
    seen, ends = (log, bounds) if log.unread is None else (log.only(log.read), np.searchsorted(read, bounds))
    [(measured, shaft)] = seen.shaft.items()
    is_speed = measured == "speed_rad_s"
    begins = np.zeros(len(shaft), bool)
    begins[ends[:-1]] = True
    begins |= np.diff(shaft, prepend=shaft[:1]) != 0
    if is_speed and log.after_gap is not None:
        begins |= log.after_gap[read]
    elif not is_speed and seen.after_gap is not None:
        begins |= seen.after_gap
    repeats = _repeats(seen.stamps[0], shaft, np.flatnonzero(begins), ends)
    if repeats is None:
        return log, bounds, None
    if not is_speed:
        return *_of_turns(seen, _kept(np.flatnonzero(begins), len(shaft), repeats.rows), ends, counts_per_rev), repeats
    rows = read[begins]
    # When a reading came that was first seen after a row without one is not known.
    late = rows[~log.read[rows - 1] & ~np.isin(rows, bounds)]
    kept = _kept(rows, len(log.read), repeats.rows)
    kept = kept[log.read[kept] & ~np.isin(kept, late)]
    return *_with_rows_between(_read_at(log, kept), kept, bounds), repeats


def without_unread(
    log: Log, bounds: np.ndarray, counts_per_rev: float | None
) -> tuple[Log, np.ndarray, Repeats | None]:
    """As `without_repeats`, of counts and angles that were read in few rows."""
    kept = np.flatnonzero(log.read)
    within = ~np.isin(kept[1:], bounds)
    if not within.any():
        return log.only(log.read), np.searchsorted(kept, bounds), None
    usual_s = float(np.median(np.diff(log.stamps[0][kept])[within]))
    return *_of_turns(log, kept, bounds, counts_per_rev), Repeats(int(np.median(np.diff(kept)[within])), usual_s)


def _of_turns(log: Log, kept: np.ndarray, bounds: np.ndarray, counts_per_rev: float | None) -> tuple[Log, np.ndarray]:
    """`log`, whose counts or angles came in the rows `kept`: these alone where the input stayed from each to the next,
    else mean speeds since the row before of these. Where that cannot be, they have the mean voltage until the next."""
    [(measured, shaft)] = log.shaft.items()
    run = np.searchsorted(bounds, np.arange(len(shaft)), side="right")
    run = run + np.cumsum(log.after_gap) if log.after_gap is not None else run
    follows = np.diff(run[kept]) == 0
    alone = bool(np.diff(np.flatnonzero(np.concatenate([[True], ~follows, [True]]))).min() < 2)
    changes = _changes_between(log, kept[:-1][follows], kept)
    if not changes or alone or (measured == "count" and counts_per_rev is None):
        means = Inputs(_means(log.input.volts, log.stamps[0], kept, bounds)) if changes else log.input.at(kept)
        return dataclasses.replace(log.at(kept), input=means), np.searchsorted(kept, bounds)
    rad = 2 * np.pi / counts_per_rev if measured == "count" and counts_per_rev is not None else 1.0
    speeds = np.zeros(len(shaft))
    speeds[kept[1:]] = rad * np.diff(shaft[kept]) / np.diff(log.stamps[0][kept])
    log = _read_at(dataclasses.replace(log, shaft={"speed_rad_s": speeds}), kept[1:][follows])
    return _with_rows_between(log, kept, bounds)


def _changes_between(log: Log, begins: np.ndarray, kept: np.ndarray) -> bool:
    """The input changes after one of the rows `begins` and before the next of the rows `kept`."""
    until = kept[np.searchsorted(kept, begins) + 1]
    for column in _inputs(log):
        changes = np.concatenate([[0], np.cumsum(column[1:] != column[:-1])])
        if (changes[until - 1] > changes[begins]).any():
            return True
    return False


def _inputs(log: Log) -> list[np.ndarray]:
    """(n,) volts, duties and supply, as far as they are there."""
    return [column for column in (*log.input[:2], log.supply_V) if column is not None]


def _read_at(log: Log, rows: np.ndarray) -> Log:
    """`log`, which was read in these rows alone."""
    unread = np.ones(len(log.stamps[0]), bool)
    unread[rows] = False
    return dataclasses.replace(log, unread=unread)


def _with_rows_between(log: Log, kept: np.ndarray, bounds: np.ndarray) -> tuple[Log, np.ndarray]:
    """`log`, of which readings are at or begin at the rows `kept`, and its `bounds`: every so many rows of it as lose
    none of these and no change of the input; or only the rows of these, where they are few."""
    needed = np.zeros(len(log.stamps[0]), bool)
    needed[kept] = True
    for column in _inputs(log):
        needed[1:] |= column[1:] != column[:-1]
    place = np.arange(len(needed)) - np.repeat(bounds[:-1], np.diff(bounds))
    stride = max(int(np.gcd.reduce(place[needed])), 1)
    last = kept[np.searchsorted(kept, bounds[1:]) - 1]
    within = np.arange(len(needed)) <= np.repeat(last, np.diff(bounds))
    rows, few = np.flatnonzero((place % stride == 0) & within), np.flatnonzero(needed & within)
    rows = few if FEW * len(few) < len(rows) else rows
    return log.at(rows), np.searchsorted(rows, bounds)


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
