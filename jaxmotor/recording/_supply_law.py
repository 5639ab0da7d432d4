"""A law of the supply, fitted to its readings.

Readings v of a supply are few and coarse (a board's converter: every 100 ms, 20 mV), and within a row it changes as the
current does. So a law with few parameters is fitted to them, and its mean over each row is what was applied:

    v = E(t) - r₁ max(x, 0) + r₂ min(x, 0),    x = D R i = D (D v - k w),

with the duty D (as a share of the supply), the speed w, the unloaded supply E(t), piecewise linear, and the current
D i that the bridge draws: in the winding D v = R i + k w. A bridge that lets the motor coast draws
x = |D| max(v - k |w|, 0). r₁ and r₂ are the supply's resistance over the winding's where it gives current and where it
takes current back.

BIC decides whether there is a load at all, of how many pieces E is, and to which moment a reading belongs. Where each
row has a reading, with a resolution below what the law leaves, that is added as it was read.
"""

from typing import NamedTuple

import numpy as np

from jaxmotor.recording._supply_rows import Speeds, SupplyRows, speeds_of

MOST = 4000
"""Readings among which the law is chosen; of more, evenly spread ones."""
CONVERTED_S = 1e-3
"""Between two conversions of which such an average is made."""
KNOTS = (1, 2, 3, 5, 9, 17, 33)
"""Of E(t); one is a constant."""
USUAL_KNOTS = 5
"""Of E(t) while other parts of the law are chosen."""
ON_KNOT = 3.0
"""Readings that a knot needs."""
USUAL_BACK_EMF = 0.93
"""k at first, as a share of the volts that a steady speed costs: friction takes the rest."""
AVERAGES_S = ((8e-3, 0.0), (15.5e-3, 0.0), (15.5e-3, 1e-3), (15.5e-3, 2e-3), (15.5e-3, 3e-3), (32e-3, 0.0))
"""Time constants and delays that a reading may have, if it is an average; 15.5 ms is that of our board."""
ROUNDS = 8
"""Of solving for v, which is on both sides; each leaves r D² of the error."""
FARTHEST = (0.5, 1.5)
"""Of the lowest and the highest reading: beyond lies no supply."""
STEP = 1e-3
"""Of k, for the derivative by it."""
PASSES = 3
"""Of the law for the speeds that its supply gives."""
PLATEAU_S = 0.35
"""A reading that stays this long is a level of the converter."""
ON_LEVEL = 0.12
"""Of the step: readings this close to a level are on it."""
MOSTLY = 0.6
"""Share of readings on levels from which on a converter has levels."""
APART_S = 0.1
"""Readings closer than this do not count as independent of each other."""


def resolution_V(rows: SupplyRows) -> float:
    """The step between levels of the converter, where most readings are on levels; else the least step of readings.

    Averages between levels are printed finer than the converter tells.
    """
    readings, time = rows.reading[rows.read], rows.time[rows.read]
    values = np.unique(readings)
    if len(values) < 2:
        return 0.0
    least = float(np.diff(values).min())
    changes = np.flatnonzero(np.diff(readings) != 0)
    begins, ends = np.append(0, changes + 1), np.append(changes, len(readings) - 1)
    levels = np.unique(readings[begins[time[ends] - time[begins] > PLATEAU_S]])
    if len(levels) < 2:
        return least
    apart = np.diff(levels)
    # An average creeps up to its level, and levels are rounded when printed: a step is the usual large gap.
    step = float(np.median(apart[apart > apart.max() / 4]))
    step = float((levels[-1] - levels[0]) / np.rint(apart / step).sum())
    off = (readings - levels[0]) / step
    return step if np.mean(np.abs(off - np.rint(off)) < ON_LEVEL) > MOSTLY else least


def _weights(rows: SupplyRows) -> np.ndarray:
    """(n,) of each reading: those that stay the same together count as one, since they share one rounding error."""
    readings = rows.reading[rows.read]
    run = np.cumsum(np.diff(readings, prepend=readings[0]) != 0)
    weights = np.zeros(len(rows.reading))
    weights[rows.read] = 1 / np.bincount(run)[run]
    return weights


class _Moment(NamedTuple):
    """What the bridge did (n,) at the moment to which each row's reading is said to belong."""

    share: np.ndarray
    speed: np.ndarray
    known: np.ndarray
    """False where the row before is not known."""
    before: bool
    """The reading belongs to the time before its row."""
    average_s: tuple[float, float] | None = None
    """Time constant of the average that it is, and its delay."""


class _Fit(NamedTuple):
    """The law's parameters, and how well it fits the readings."""

    moment: _Moment
    back_emf_V_s: float
    """k; irrelevant without a load."""
    knots_V: np.ndarray
    """E at even times."""
    resistance: np.ndarray
    """(2,) r₁ and r₂; empty without a load."""
    variance: float
    """Of what the law leaves [V²]."""


def mean_supply(rows: SupplyRows) -> tuple[np.ndarray | None, float]:
    """(n,) mean of the supply from each row to the next [V], and the unloaded one when the recording began [V].

    None where it stands still within the resolution of its readings.
    """
    readings = rows.reading[rows.read]
    step = resolution_V(rows)
    if np.ptp(readings) <= 1.1 * step:
        return None, float(np.mean(readings))
    with np.errstate(all="ignore"):
        supply, begin = _by_law(rows, step)
    low, high = FARTHEST[0] * readings.min(), FARTHEST[1] * readings.max()
    if not low <= begin <= high:
        return None, float(np.mean(readings))
    return None if supply is None else np.clip(np.nan_to_num(supply, nan=begin), low, high), begin


def _by_law(rows: SupplyRows, step: float) -> tuple[np.ndarray | None, float]:
    """As `mean_supply`; what the law leaves is added where it is more than the rounding of its readings."""
    fit, speeds = _settled(rows, step)
    begin = float(fit.knots_V[0])
    left = rows.reading - _supply(rows, fit, fit.moment, averaged=True)
    if not (rows.is_dense and np.nanstd(left) > step):
        still = len(fit.knots_V) == 1 and not fit.resistance.size
        return (None if still else _supply(rows, fit, _within(rows, speeds))), begin
    left = np.interp(np.arange(len(left)), rows.read, left[rows.read])
    begin += float(left[rows.time - rows.time[0] < APART_S].mean())
    if not fit.moment.before:
        return _supply(rows, fit, fit.moment) + left, begin
    follows = ~np.append(rows.first[1:], True)
    left = np.where(follows, np.append(left[1:], left[-1]), left)
    return _supply(rows, fit, _within(rows, speeds)) + left, begin


def _settled(rows: SupplyRows, step: float) -> tuple[_Fit, Speeds]:
    """The law, and the speeds that the motor has under the supply that follows from it."""
    supply = np.full(len(rows.time), float(np.nanmean(rows.reading)))
    speeds = speeds_of(rows, rows.share * supply)
    fit = _best(rows, speeds, supply, step)
    for _ in range(PASSES - 1 if fit.resistance.size else 0):
        supply = _supply(rows, fit, _within(rows, speeds))
        speeds = speeds_of(rows, rows.share * supply)
        fit = _best(rows, speeds, supply, step)
    return fit, speeds


def _best(rows: SupplyRows, speeds: Speeds, supply: np.ndarray, step: float) -> _Fit:
    """The fit of the least BIC: load or none first, at a usual number of knots, then the knots."""
    chosen = rows.read[:: -(-len(rows.read) // MOST)]
    fits = [_fitted(rows, chosen, _within(rows, speeds), 0.0, supply, USUAL_KNOTS)]
    if speeds.volts_per_speed > 0:
        k = USUAL_BACK_EMF * speeds.volts_per_speed
        fits += [_fitted(rows, chosen, moment, k, supply, USUAL_KNOTS) for moment in _moments(rows, speeds)]
    count = min(float(_weights(rows)[rows.read].sum()), (rows.time.max() - rows.time[0]) / APART_S)
    best = min(fits, key=lambda fit: _bic(fit, count, step))
    known = [knots for knots in KNOTS if (_hats(rows, rows.time[rows.read], knots).sum(axis=0) >= ON_KNOT).all()]
    more = [_fitted(rows, rows.read, best.moment, best.back_emf_V_s, supply, knots) for knots in known]
    return min(more, key=lambda fit: _bic(fit, count, step))


def _bic(fit: _Fit, count: float, step: float) -> float:
    """Of `count` readings; what is finer than their `step` is not counted."""
    floor = max(step**2 / 12, 1e-18)
    # Moment, back-EMF and the two resistances.
    parameters = len(fit.knots_V) + (4 if fit.resistance.size else 0)
    return count * np.log(max(fit.variance, floor)) + parameters * np.log(count)


def _fitted(
    rows: SupplyRows, chosen: np.ndarray, moment: _Moment, back_emf_V_s: float, supply: np.ndarray, knots: int
) -> _Fit:
    """Least squares over the `chosen` readings (Gauss-Newton in k); v in x is `supply` at first."""
    used = chosen[moment.known[chosen]]
    hats, reading, weight = _hats(rows, rows.time[used], knots), rows.reading[used], _weights(rows)[used]
    if not back_emf_V_s:
        values, variance = _least_squares(hats, reading, weight)
        return _Fit(moment, 0.0, values, np.zeros(0), variance)
    all_hats, k, resistance = _hats(rows, rows.time, knots), back_emf_V_s, np.zeros(2)
    values, variance = np.zeros(knots), 0.0
    for _ in range(ROUNDS):
        columns, moved = (_columns(rows, moment, each, supply) for each in (k, k + STEP * back_emf_V_s))
        turned = (moved - columns) @ resistance / (STEP * back_emf_V_s)
        parts = [hats, _averaged(rows, moment, columns)[used]]
        if resistance.any():
            parts.append(_averaged(rows, moment, turned[:, None])[used])
        values, variance = _least_squares(np.concatenate(parts, axis=1), reading, weight)
        resistance = values[knots : knots + 2]
        if len(values) > knots + 2:
            k = float(np.clip(k + values[knots + 2], 0.5 * back_emf_V_s, 1.5 * back_emf_V_s))
        supply = all_hats @ values[:knots] + columns @ resistance
    return _Fit(moment, k, values[:knots], resistance, variance)


def _least_squares(regressors: np.ndarray, reading: np.ndarray, weight: np.ndarray) -> tuple[np.ndarray, float]:
    """Coefficients, and the weighted mean square of what they leave."""
    if not np.isfinite(regressors).all():
        return np.zeros(regressors.shape[1]), np.inf
    weighed = regressors.T * weight
    values = np.linalg.lstsq(weighed @ regressors, weighed @ reading, rcond=1e-14)[0]
    return values, float(np.average((reading - regressors @ values) ** 2, weights=weight))


def _supply(rows: SupplyRows, fit: _Fit, moment: _Moment, *, averaged: bool = False) -> np.ndarray:
    """(n,) supply by the law of `fit` at `moment` [V]; `averaged` as its readings are."""
    unloaded = _hats(rows, rows.time, len(fit.knots_V)) @ fit.knots_V
    if not fit.resistance.size:
        return unloaded
    supply, columns = unloaded, np.zeros((len(unloaded), 2))
    for _ in range(ROUNDS):
        columns = _columns(rows, moment, fit.back_emf_V_s, supply)
        supply = unloaded + columns @ fit.resistance
    return unloaded + _averaged(rows, moment, columns) @ fit.resistance if averaged else supply


def _hats(rows: SupplyRows, time: np.ndarray, knots: int) -> np.ndarray:
    """(n, knots) the values at `time` of the piecewise linear functions that are 1 at one knot and 0 at the others."""
    if knots == 1:
        return np.ones((len(time), 1))
    at = (time - _begin(rows)) / max(rows.time.max() - _begin(rows), 1e-9) * (knots - 1)
    return np.maximum(1 - np.abs(at[:, None] - np.arange(knots)), 0.0)


def _begin(rows: SupplyRows) -> float:
    """When the recording began, or its first row where that is too far from it to tell."""
    first, last = float(rows.time[0]), float(rows.time.max())
    return 0.0 if 0 <= first < (last - first) / KNOTS[-1] else first


def _columns(rows: SupplyRows, moment: _Moment, back_emf_V_s: float, supply: np.ndarray) -> np.ndarray:
    """(n, 2) -max(x, 0) and min(x, 0)."""
    share, back = moment.share, back_emf_V_s * moment.speed
    if rows.coasts:
        drawn = np.abs(share) * np.maximum(supply - back * np.sign(share), 0.0)
    else:
        drawn = share * (share * supply - back)
    return np.stack([-np.maximum(drawn, 0.0), np.minimum(drawn, 0.0)], axis=1)


def _averaged(rows: SupplyRows, moment: _Moment, columns: np.ndarray) -> np.ndarray:
    """(n, k) `columns` as `moment` averages them: at each row, of the rows before it."""
    if moment.average_s is None or not columns.size:
        return columns
    (constant, delay), length = moment.average_s, float(np.median(rows.length))
    ages = np.arange(int((delay + 12 * constant) / length) + 3) * length
    weights = np.append(0.0, -np.diff(np.exp(-np.maximum(ages - delay, 0.0) / constant)))
    out = np.zeros_like(columns)
    starts = np.flatnonzero(rows.first)
    for start, stop in zip(starts, [*starts[1:], len(columns)], strict=True):
        for column in range(columns.shape[1]):
            out[start:stop, column] = np.convolve(columns[start:stop, column], weights)[: stop - start]
    return out


def _within(rows: SupplyRows, speeds: Speeds) -> _Moment:
    """The mean over each row."""
    return _Moment(rows.share, speeds.mean, np.ones(len(rows.share), bool), before=False)


def _moments(rows: SupplyRows, speeds: Speeds) -> list[_Moment]:
    """To which a reading may belong: its own row, the end of the row before, an average over the time before.

    Within a row it cannot be told to which moment: the current dies away as the speed does.
    """
    within = _within(rows, speeds)
    share = np.where(rows.first, 0.0, np.append(0.0, rows.share[:-1]))
    end = np.where(rows.first, 0.0, np.append(0.0, speeds.end[:-1]))
    known = ~rows.first | rows.at_rest
    # A converter that reads at the end of each millisecond sees a row half of one later than the row's mean.
    late = speeds.mean + (speeds.end - speeds.mean) * np.minimum(CONVERTED_S / rows.length, 1.0)
    averages = [_Moment(rows.share, late, known, before=True, average_s=time) for time in AVERAGES_S]
    return [within, _Moment(share, end, known, before=True), *averages]
