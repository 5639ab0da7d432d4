"""Whether the speeds of a log were smoothed from row to row, y[k] = y[k-1] + b (x[k] - y[k-1]). Numpy only.

Programs on small boards do this with the speed x of each row, which is what an encoder counted in it: a whole multiple
of one number q. With the right b the speeds x[k] = (y[k] - (1 - b) y[k-1])/b are such multiples again, and with no
other, unless all y are. So b and q are where

    R² = |mean of exp(2πi x/q)|²

is largest: it is 1 of whole multiples, and 1/n or so of n others. For each of many b all q are tried at once, by the
Fourier transform of the histogram of x; the largest R² are sought again more finely.

The speed of a simulated motor without noise goes from row to row in the same way, towards what its voltage would bring,
and voltages may be whole multiples of one, too. But what was counted scatters: counts at both ends of a row are
rounded, so that half of all x are further than 0.29 q from any function of the voltage.
"""

import dataclasses
from typing import NamedTuple

import numpy as np

from jaxmotor.recording import Recording, Segment, are_far_apart

ENOUGH_ROWS, COARSE_ROWS = 3000, 1000
"""The first of a log, which decide; and of these, those whose speeds change least, for which all q are tried."""
FEWEST_ROWS = 100
"""That decide nothing."""
WEIGHTS = 1 / (1 + np.exp(np.linspace(4.0, -4.0, 161)))
"""b that are tried."""
MOST_WEIGHT = 0.97
"""Of what is smoothed at all."""
LEVELS = 4096
"""Multiples of q between the least and the largest speed, at most."""
OF_PRINTED = 3.0
"""q over the standard deviation that rounding to printed digits gives x, at least: less is not seen."""
TRIED = 6
"""Of the best b, those that are sought more finely."""
ROUNDS, POINTS, FINER = 14, 9, 0.6
"""Of grids, the points of each along b and along q, and how wide it is over the one before."""
CLEAR = 0.3
"""R² of whole multiples."""
ROUNDED, AGAIN = 0.15, 5
"""The least of that, half of what rounding alone brings; and fits of the half of the rows that are nearest."""
EVEN = 1e-6
"""Relative difference of times between readings up to which they are equal."""
APART, TIMES = 0.5, 2.0
"""Of log odds of b: those of others, and how many times less their R² must be."""
NEARBY = 1.1
"""Times 1/q up to which speeds are themselves held to be whole multiples: of finer ones they may be as printed."""


class Smoothing(NamedTuple):
    """Each speed is the one before and so much of the way to the mean over its row."""

    weight: float
    """b"""
    count_rad_s: float
    """q, one count in a row [rad/s]."""


class _Steps(NamedTuple):
    """(n,) rows in which the speed changes."""

    now: np.ndarray
    before: np.ndarray
    scale: np.ndarray
    """What makes whole multiples of what was counted: 1, or the row's duration over the usual one."""
    drive: np.ndarray
    """(n, c) what a motor without a lag would follow: the voltages about the row, a constant, the direction."""
    printed: float
    """The least difference of two speeds: one of the last digit that was printed."""

    def of(self, which: np.ndarray) -> "_Steps":
        rows = {name: getattr(self, name)[which] for name in ("now", "before", "scale", "drive")}
        return self._replace(**rows)

    def raw(self, weight: float) -> np.ndarray:
        """(n,) x at b."""
        return (self.now - (1 - weight) * self.before) / weight * self.scale

    def finest(self, weight: float) -> float:
        """The least q that can be seen."""
        return OF_PRINTED * self.printed / np.sqrt(12) * float(np.hypot(1, 1 - weight)) / weight


def smoothing(recording: Recording, segments: tuple[int, ...]) -> Smoothing | None:
    """Of the `segments` (indices) of `recording`; None where it is no log of speeds, where it states how they were
    made, and where they show none."""
    if recording.measured != "speed" or recording.speed_window_s is not None:
        return None
    tried = [_found(steps) for steps in _steps(recording, segments)]
    found = [one for one in tried if one is not None]
    return max(found, key=lambda one: one[0])[1] if found else None


def unsmoothed(recording: Recording, weight: float) -> Recording:
    """`recording`, each speed of which is the mean over the row before it, or since the reading before it.

    Before a segment that begins at rest the shaft stood still. The first speed of others is left as it is: its window
    reaches back to before the segment, so that it does not count.
    """
    segments, lengths = [], []
    for segment in recording.segments:
        assert segment.speed_rad_s is not None
        (rows, follows), speed = _readings(segment), segment.speed_rad_s.copy()
        own = speed[rows]
        speed[rows] = (own - (1 - weight) * np.append(0.0 if segment.at_rest else own[0], own[:-1])) / weight
        read = np.zeros(len(speed), bool)
        read[rows[np.append(True, follows)]] = True
        segments.append(dataclasses.replace(segment, speed_rad_s=speed, unread=None if read.all() else ~read))
        lengths.append(np.diff(segment.time_s[rows]))
    apart = any(are_far_apart(segment.read) for segment in recording.segments)
    usual_s = float(np.median(np.concatenate(lengths)))
    if apart:
        stated = {"speed_window_s": usual_s, "speed_window_rows": 0}
    else:
        stated = {"speed_window_s": recording.period_s or usual_s}
        stated |= {"speed_window_rows": 1} if recording.period_s is None else {}
    return dataclasses.replace(recording, segments=tuple(segments), **stated)


def _steps(recording: Recording, segments: tuple[int, ...]) -> list[_Steps]:
    """As speeds were counted in even rows, and where rows are not even in those."""
    parts = [_rows_of(recording.segments[index]) for index in segments]
    now, before, length, *drive = (np.concatenate(one)[:ENOUGH_ROWS] for one in zip(*parts, strict=True))
    values = np.unique(np.abs(now))
    gaps = np.diff(values)
    printed = float(gaps[gaps > 1e-9 * values.max(initial=0.0)].min(initial=np.inf))
    changed = np.abs(now - before) > 0.5 * printed
    if changed.sum() < FEWEST_ROWS:
        return []
    columns = np.stack([*drive, np.ones_like(now), np.sign(now)], axis=1)
    uneven = [] if np.ptp(length) < EVEN * np.median(length) else [length / np.median(length)]
    return [_Steps(now, before, scale, columns, printed).of(changed) for scale in (np.ones_like(now), *uneven)]


def _rows_of(segment: Segment) -> tuple[np.ndarray, ...]:
    """(n,) speed, that of the reading before, and the time since then; the voltages from this row on, and from the two
    before it."""
    assert segment.speed_rad_s is not None
    rows, follows = _readings(segment)
    now, before = rows[1:][follows], rows[:-1][follows]
    volts = [segment.volts[np.maximum(now - back, 0)] for back in range(3)]
    return segment.speed_rad_s[now], segment.speed_rad_s[before], segment.time_s[now] - segment.time_s[before], *volts


def _readings(segment: Segment) -> tuple[np.ndarray, np.ndarray]:
    """(m,) rows with a reading, and (m - 1,) whether each comes as usual after the one before it: in the next row, or,
    where few rows have one, after about the usual time."""
    rows = np.flatnonzero(segment.read)
    if are_far_apart(segment.read):
        length = np.diff(segment.time_s[rows])
        return rows, np.abs(length - np.median(length)) < 0.5 * np.median(length)
    follows = np.diff(rows) == 1
    return rows, follows if segment.tick is None else follows & (np.diff(segment.tick[rows]) == 1)


def _found(steps: _Steps) -> tuple[float, Smoothing] | None:
    """The clearest b with its R²."""
    size = np.abs(steps.now - steps.before)
    order = np.argsort(size, kind="stable")
    small = steps.of(order[: min(len(order) // 2, COARSE_ROWS)])
    peaks = [(*_best_q(small, float(weight)), float(weight)) for weight in WEIGHTS]
    found = []
    for _, rate, weight in sorted(peaks, reverse=True)[:TRIED]:
        weight, rate = _finer(steps.of(order), weight, rate)
        large = steps.of(order[len(order) // 2 :])
        clear = _clear(large, weight, rate)
        others = max(_clear(large, other, rate) for other in WEIGHTS if abs(_odds(other) - _odds(weight)) > APART)
        # Speeds on a grid are whole multiples for many b: x is a sum of them.
        others = max(others, _of_speeds(large, NEARBY * rate))
        if clear > max(CLEAR, TIMES * others) and weight < MOST_WEIGHT and _scatters(steps, weight, 1 / rate):
            found.append((clear, Smoothing(weight, 1 / rate)))
    return max(found, default=None)


def _best_q(steps: _Steps, weight: float) -> tuple[float, float]:
    """The largest R² of one b, and its 1/q [s/rad]."""
    x = steps.raw(weight)
    power, rates = _each_q(x, min(1 / steps.finest(weight), LEVELS / max(float(np.ptp(x)), 1e-300)))
    best = int(np.argmax(power))
    return float(power[best]), float(rates[best])


def _of_speeds(steps: _Steps, most: float) -> float:
    """The largest R² of the speeds themselves, of q with a 1/q of `most`."""
    power, rates = _each_q(steps.now, 4 * most)
    return float(power[rates <= most].max())


def _each_q(x: np.ndarray, most: float) -> tuple[np.ndarray, np.ndarray]:
    """R² of q with a 1/q of up to `most`, and the 1/q."""
    bins = np.rint((x - x.min()) * 2 * most).astype(int)
    size = 1 << int(bins.max() + 1).bit_length()
    power = np.abs(np.fft.rfft(np.bincount(bins, minlength=size))) ** 2 / len(x) ** 2
    rates = np.arange(len(power)) * 2 * most / size
    # Of few levels anything is a multiple.
    power[rates < 3 / max(float(np.std(x)), 1e-300)] = 0.0
    return power, rates


def _finer(steps: _Steps, weight: float, rate: float) -> tuple[float, float]:
    """b and 1/q near these with the largest R². In rows whose speed changes little, which come first, it depends least
    on them: the others join in from round to round."""
    odds, grid = _odds(weight), np.linspace(-1, 1, POINTS)
    wide = np.array([_odds(WEIGHTS[1]) - _odds(WEIGHTS[0]), 0.5 / float(np.ptp(steps.raw(weight)))])
    for number in range(ROUNDS):
        used = steps.of(np.arange(len(steps.now) * (ROUNDS + number) // (2 * ROUNDS - 1)))
        odds_each, rates = odds + wide[0] * grid, rate + wide[1] * grid
        found = np.stack([_clear_each(used, _weight(one), rates) for one in odds_each])
        found[:, rates < 0.1 * rate] = 0.0
        row, column = np.unravel_index(np.argmax(found), found.shape)
        odds, rate, wide = float(odds_each[row]), float(rates[column]), FINER * wide
    return _weight(odds), rate


def _clear(steps: _Steps, weight: float, rate: float) -> float:
    """R²"""
    return float(np.abs(np.exp(2j * np.pi * rate * steps.raw(weight)).mean()) ** 2)


def _clear_each(steps: _Steps, weight: float, rates: np.ndarray) -> np.ndarray:
    """(k,) R² at `rates` (k,) that are equally far apart: each term of the one before is turned by as much."""
    turns = 2j * np.pi * steps.raw(weight)
    terms, turn, found = np.exp(turns * rates[0]), np.exp(turns * (rates[1] - rates[0])), np.empty(len(rates))
    for number in range(len(rates)):
        found[number] = np.abs(terms.mean()) ** 2
        terms *= turn
    return found


def _scatters(steps: _Steps, weight: float, count: float) -> bool:
    """x is not nearer to a function of the voltage than rounding lets it."""
    x, near = steps.raw(weight), np.ones(len(steps.now), bool)
    left = np.abs(x)
    # A motor that turns back does not follow: half of the rows may be such.
    for _ in range(AGAIN):
        left = np.abs(x - steps.drive @ np.linalg.lstsq(steps.drive[near], x[near], rcond=None)[0])
        near = left <= np.median(left)
    return float(np.median(left)) > ROUNDED * count


def _odds(weight: float) -> float:
    return float(np.log(weight / (1 - weight)))


def _weight(odds: float) -> float:
    return float(1 / (1 + np.exp(-odds)))
