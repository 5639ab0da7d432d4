"""How the speeds of a log were averaged, where its header does not say."""

import dataclasses
from typing import Literal

import numpy as np

from jaxmotor._numbers import plainly
from jaxmotor.estimate._timing import Timing
from jaxmotor.prediction import RowWindow, Smoothing, by_rows, row_window, smoothing, unsmoothed
from jaxmotor.recording import Recording

LOGS_OWN = "a property of the log, which its header does not state (speed_window_s)"
UNSURE = 0.5
"""Of a window: half an interval from which it is not told from readings that are early."""


@dataclasses.dataclass(frozen=True)
class SpeedAverage:
    """A property of the log, not of the motor: each speed is a mean over a window before its row, or was filtered."""

    kind: Literal["window", "filter"]
    """A moving average, or a filter of first order."""
    length_s: float
    """Of the window, or the filter's time constant [s]."""
    standard_error_s: float
    """1.96 of them each way hold the truth 95 times of 100 [s]."""
    lateness_s: float
    """By how much speeds are late in all: half the window, or the time constant, and the timing offset [s]."""
    lateness_error_s: float
    """Its standard error [s]."""
    separable: bool
    """The log shows the window itself; otherwise only `lateness_s`, which readings as much before the voltage changes
    would have as well."""
    gain_per_s: float
    """By how much the gain moves with `length_s` [rad/s/V per s]."""
    pole_per_s: float
    """The same of the pole [rad/s per s]."""
    rows: int | None = None
    """Each is a mean over so many last rows, in however long: then `length_s` is their usual length. None: over a fixed
    time."""
    as_even: bool = False
    """What the shaft turned in `rows` rows was divided by their usual length, not by the time that they took."""
    weight: float | None = None
    """Each speed is so much [1] of the mean over its row, and the rest of the speed before it (exponential smoothing);
    this is undone before anything is fitted. None: it was not smoothed so."""

    @property
    def is_fitted(self) -> bool:
        """A window of any length was fitted beside the motor."""
        return self.kind == "window" and self.rows is None

    @property
    def sentence(self) -> str:
        """For people."""
        if self.weight is not None:
            return (
                f"each speed is {self.weight:.4g} of the mean over its row and {1 - self.weight:.4g} of the speed "
                "before it (exponential smoothing): a property of the log, which its header does not state; the "
                "smoothing is undone"
            )
        if self.rows is not None:
            return _by_rows(self.rows, self.as_even, self.length_s)
        length = _ms(self.length_s, self.standard_error_s)
        if self.kind == "filter":
            through = f"went through a first-order filter of {length}"
            if 1.96 * self.standard_error_s >= self.length_s:
                most = plainly(1e3 * (self.length_s + 1.96 * self.standard_error_s), 2)
                through = f"may have gone through a first-order filter, of no more than {most} ms"
            return (
                f"the speeds {through}: {LOGS_OWN}; a motor and a filter of each "
                "other's time constants look the same, the slower one is taken for the motor"
            )
        late = _ms(self.lateness_s, self.lateness_error_s)
        if self.separable:
            offset = abs(self.lateness_s - self.length_s / 2) > 1e-9 * self.length_s
            beside = f" (late by {late} in all, with when rows are read)" if offset else ""
            return f"the speeds are means over {length} before each row{beside}: {LOGS_OWN}"
        over = f"means over {length}, or " if self.standard_error_s < UNSURE * self.length_s / 1.96 else "means, or "
        if 1.96 * self.lateness_error_s >= self.lateness_s:
            most = max(self.lateness_s, 0.0) + 1.96 * self.lateness_error_s
            late = f"no more than {plainly(1e3 * most, 2)} ms"
        return (
            f"the speeds are late by {late} in all: {over}read as much before the voltage changes; here the two look "
            f"the same. It is {LOGS_OWN}"
        )


def _by_rows(rows: int, as_even: bool, length_s: float) -> str:
    last = "the last row" if rows == 1 else f"the last {rows} rows"
    each = f"{1e3 * length_s:.4g} ms"
    over = f"divided by {each}, however long they took" if as_even else f"in however long they took (mostly {each})"
    return (
        f"each speed is what the shaft turned in {last}, {over}: a property of the log, which its header does not "
        "state (speed_window_rows)"
    )


def average_seen(recording: Recording, segments: tuple[int, ...]) -> SpeedAverage | None:
    """How the speeds of `segments` (indices) were averaged from row to row, as their values or the uneven rows show it
    whatever the motor; None where nothing shows. Numpy only."""
    smoothed = smoothing(recording, segments)
    if smoothed is not None:
        return _smoothed(recording, smoothed)
    window = row_window(recording, segments)
    return None if window is None else _over_rows(window)


def _over_rows(window: RowWindow) -> SpeedAverage:
    """Of speeds that are means over the last rows, which is exact."""
    late = window.length_s / 2
    return SpeedAverage(
        "window", window.length_s, 0.0, late, 0.0, True, 0.0, 0.0, rows=window.rows, as_even=window.as_even
    )


def _smoothed(recording: Recording, smoothed: Smoothing) -> SpeedAverage:
    """Of smoothed speeds, whose weight is as good as exact."""
    length = unsmoothed(recording, smoothed.weight).speed_window_s
    assert length is not None
    late = length * (0.5 + (1 - smoothed.weight) / smoothed.weight)
    return SpeedAverage("window", length, 0.0, late, 0.0, True, 0.0, 0.0, rows=1, weight=smoothed.weight)


def properties_of(
    psi: np.ndarray, covariance: np.ndarray, of_log: tuple[str, ...], row_s: float, alike: bool
) -> tuple[Timing | None, SpeedAverage | None]:
    """Timing offset and average of speeds from the end of ψ, as `assess` has it, and the `covariance` of ψ."""
    place = {name: len(psi) - len(of_log) + number for number, name in enumerate(of_log)}
    timing, late = None, np.zeros(len(psi))
    if "offset" in place:
        late[place["offset"]] = -row_s
        timing = Timing(row_s * float(psi[-1]), row_s * float(np.sqrt(covariance[-1, -1])))
    kind = "window" if "window" in place else "filter"
    if kind not in place:
        return timing, None
    at = place[kind]
    length = float(np.exp(psi[at])) * (row_s if kind == "window" else 1.0)
    error = length * float(np.sqrt(covariance[at, at]))
    whole = length * (0.5 if kind == "window" else 1.0)
    late[at] = whole
    slope = covariance[[0, 2], at] / covariance[at, at] / length
    average = SpeedAverage(
        kind,
        length,
        error,
        whole - (timing.offset_s if timing else 0.0),
        float(np.sqrt(late @ covariance @ late)),
        kind == "filter" or not (alike or 1.96 * error > UNSURE * length),
        float(slope[0]),
        float(slope[1] * np.exp(psi[2])),
    )
    return timing, average


def stated_window(recording: Recording, length_s: float) -> float:
    """`length_s`, but never just the period: a mean over that is taken as a difference of angles."""
    period = recording.period_s
    return length_s * (1 + 1e-5) if period is not None and abs(length_s - period) < 2e-6 * period else length_s


def stated(recording: Recording, average: SpeedAverage | None) -> Recording:
    """`recording` with a header that states what `average` found."""
    if average is None:
        return recording
    if average.weight is not None:
        return unsmoothed(recording, average.weight)
    if average.rows is not None:
        return by_rows(recording, RowWindow(average.rows, average.as_even, average.length_s))
    window_s = 0.0 if average.kind == "filter" else stated_window(recording, average.length_s)
    return dataclasses.replace(recording, speed_window_s=window_s)


def _ms(value_s: float, error_s: float) -> str:
    return f"{1e3 * value_s:.4g} ± {plainly(1e3 * 1.96 * error_s, 2)} ms"
