"""Time stamps become ticks where they are even, and stay time where they are not."""

import dataclasses

import numpy as np

JITTER = 1e-6
"""Time stamps this close to a multiple of the period, relative to it, are even."""
ROUGHEST = 0.25
"""Time stamps printed in steps above this share of the period prove nothing about being even."""


@dataclasses.dataclass(frozen=True)
class Timing:
    """Ticks of segments, each from its own start."""

    period_s: float | None
    """Of all [s]; None where the stamps are uneven."""
    ticks: list[np.ndarray] | None
    """(n,) int64 each; a lost sample is a skipped tick. None where the stamps are uneven."""


def timing(stamps_s: list[np.ndarray], resolution_s: float = 0.0) -> Timing:
    """Ticks for the increasing `stamps_s` of each segment, printed in steps of `resolution_s`.

    Even means that every stamp is a whole multiple of one period from the segment's start, to a millionth of the
    period or to the rounding of its last printed digit. All segments share the period.
    """
    times = [stamps - stamps[0] for stamps in stamps_s]
    steps = np.concatenate([np.diff(stamps) for stamps in stamps_s])
    if len(steps) == 0:
        return Timing(None, None)
    usual = float(np.median(steps))
    # Stamps that count from 1970 have no more digits than this.
    largest = max(float(np.abs(stamps).max()) for stamps in stamps_s)
    resolution_s = max(resolution_s, 4 * float(np.spacing(largest)))
    ticks = [np.concatenate([[0], np.cumsum(np.rint(np.diff(time) / usual))]) for time in times]
    # Each rounded difference may be off where the period is printed too roughly: refine once.
    ticks = [np.rint(time / _period(times, ticks, usual)) for time in times]
    period = _nice(_period(times, ticks, usual), times, ticks, resolution_s)
    tolerance = _tolerance(period, resolution_s)
    even = all(_misfit(time, tick, period) <= tolerance for time, tick in zip(times, ticks, strict=True))
    if not even or any((np.diff(tick) < 1).any() for tick in ticks) or max(tick[-1] for tick in ticks) > 1e7:
        return Timing(None, None)
    return Timing(period, [tick.astype(np.int64) for tick in ticks])


def _period(times: list[np.ndarray], ticks: list[np.ndarray], otherwise: float) -> float:
    """Least squares with one offset per segment; `otherwise` where no segment has two ticks."""
    tick = np.concatenate([tick - tick.mean() for tick in ticks])
    time = np.concatenate([time - time.mean() for time in times])
    weight = float(tick @ tick)
    return float(tick @ time) / weight if weight > 0 else otherwise


def _nice(period: float, times: list[np.ndarray], ticks: list[np.ndarray], resolution_s: float) -> float:
    """The period to nine digits, where the stamps do not tell the difference."""
    nice = float(f"{period:.9g}")
    fits = all(
        _misfit(time, tick, nice) <= _tolerance(nice, resolution_s) for time, tick in zip(times, ticks, strict=True)
    )
    return nice if fits else period


def _misfit(time: np.ndarray, tick: np.ndarray, period: float) -> float:
    """Half the spread of what is left of `time`; the segment's own start is rounded as well."""
    return float(np.ptp(time - tick * period)) / 2


def _tolerance(period: float, resolution_s: float) -> float:
    rounding = 0.5000001 * resolution_s if resolution_s <= ROUGHEST * period else 0.0
    return max(JITTER * period, rounding)
