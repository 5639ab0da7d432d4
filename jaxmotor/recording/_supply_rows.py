"""What the law of a supply is fitted to: rows with duty, speed and perhaps a reading."""

from typing import NamedTuple

import numpy as np

SMOOTH_S = 0.25
"""Over which speeds beyond a simple motor's are averaged."""
JUMP = 0.05
"""Of the largest voltage, from one row to the next."""
WINDOW = 8
"""Rows over which the motor's acceleration is judged."""
DENSE = 0.9
"""Share of rows with a reading from which on every row counts as read."""
LEAST = 20
"""Readings from which on a supply is known; fewer are left alone."""


class SupplyRows(NamedTuple):
    """All rows of a recording (n,), one segment after the other."""

    time: np.ndarray
    """Since the recording began [s]."""
    length: np.ndarray
    """To the next row [s]."""
    first: np.ndarray
    """A segment begins here."""
    at_rest: np.ndarray
    """A segment begins here at rest."""
    share: np.ndarray
    """Of the supply, asked for from this row on [1]."""
    speed: np.ndarray
    """Mean until the next row [rad/s]."""
    reading: np.ndarray
    """Of the supply [V]; NaN where there is none."""
    coasts: bool

    @property
    def read(self) -> np.ndarray:
        """Rows with a reading."""
        return np.flatnonzero(~np.isnan(self.reading))

    @property
    def is_dense(self) -> bool:
        """Every row has a reading, or nearly."""
        return len(self.read) > DENSE * len(self.reading)


class Speeds(NamedTuple):
    """(n,) of each row [rad/s], without the rounding of the encoder."""

    mean: np.ndarray
    end: np.ndarray
    volts_per_speed: float
    """What a steady speed costs [V s/rad]; 0 where it is not known."""


def speeds_of(rows: SupplyRows, volts: np.ndarray) -> Speeds:
    """Of a motor of first order under (n,) `volts`; what was measured beyond it is added as its mean over `SMOOTH_S`.

    Measured speeds alone carry the rounding of the counts, which would enter the volts and with them the estimate.
    """
    motor = _motor(rows, volts)
    if motor is None:
        return Speeds(rows.speed, rows.speed, 0.0)
    mean, end = _simulated(rows, volts, *motor)
    angle = np.append(0.0, np.cumsum((rows.speed - mean) * rows.length))
    clock = np.append(0.0, np.cumsum(rows.length))
    starts = np.flatnonzero(rows.first)
    stops = np.append(starts[1:], len(mean))
    part = np.cumsum(rows.first) - 1
    middle = (clock[1:] + clock[:-1]) / 2
    low = np.maximum(np.searchsorted(clock, middle - SMOOTH_S / 2), starts[part])
    high = np.maximum(np.minimum(np.searchsorted(clock, middle + SMOOTH_S / 2), stops[part]), low + 1)
    beyond = (angle[high] - angle[low]) / (clock[high] - clock[low])
    b, a, _ = motor
    return Speeds(mean + beyond, end + beyond, a / b)


def _motor(rows: SupplyRows, volts: np.ndarray) -> tuple[float, float, float] | None:
    """b, a and f of w' = b u - a w - f sign(w), by least squares over windows of rows; None where that is no motor."""
    size = len(rows.speed)
    if size < 2 * WINDOW + 4:
        return None
    between = np.append(rows.speed[0], (rows.speed[1:] + rows.speed[:-1]) / 2)
    columns = (volts, -rows.speed, -np.sign(rows.speed))
    sums = [np.append(0.0, np.cumsum(column * rows.length)) for column in columns]
    start = np.arange(1, size - WINDOW - 1)
    part = np.cumsum(rows.first)
    start = start[part[start - 1] == part[start + WINDOW + 1]]
    # Where the voltage jumps, the speed between two rows is not the mean of theirs.
    jumps = np.abs(np.diff(volts, prepend=volts[:1])) > JUMP * np.abs(volts).max()
    start = start[~jumps[start] & ~jumps[start + WINDOW]]
    if len(start) < LEAST:
        return None
    regressors = np.stack([column[start + WINDOW] - column[start] for column in sums], axis=1)
    if not np.isfinite(regressors).all():
        return None
    b, a, f = np.linalg.lstsq(regressors, between[start + WINDOW] - between[start], rcond=None)[0].tolist()
    return (b, a, max(f, 0.0)) if a > 0 and b > 0 else None


def _simulated(rows: SupplyRows, volts: np.ndarray, b: float, a: float, f: float) -> tuple[np.ndarray, np.ndarray]:
    """(n,) mean speed of each row and speed at its end: exact but for friction, an implicit step."""
    decay = np.exp(-a * rows.length)
    begins, ends, speed = [], [], 0.0
    columns = (decay, (1 - decay) * b / a * volts, (1 - decay) * f / a, rows.first, rows.at_rest, rows.speed)
    for p, driven, rubbed, first, at_rest, measured in zip(*(column.tolist() for column in columns), strict=True):
        if first:
            speed = 0.0 if at_rest else measured
        begins.append(speed)
        speed = p * speed + driven
        speed = max(speed - rubbed, 0.0) if speed > 0 else min(speed + rubbed, 0.0)
        ends.append(speed)
    begin, end = np.array(begins), np.array(ends)
    share = 1 / (1 - decay) - 1 / (a * rows.length)
    return begin + (end - begin) * share, end
