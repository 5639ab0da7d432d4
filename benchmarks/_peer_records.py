"""What peers are given of a motor, in numpy alone: peers live in environments of their own."""

from typing import Any, NamedTuple

import numpy as np


class Record(NamedTuple):
    """One recording, its segments one after the other."""

    volts: np.ndarray
    """(n,) held from each tick to the next [V]."""
    counts: np.ndarray
    """(n,) at the tick."""
    first: np.ndarray
    """(s,) index of each segment's first tick; the motor is at rest there."""
    kind: np.ndarray
    frequency_Hz: np.ndarray
    """(s,) of a sine, else NaN."""
    amplitude_V: np.ndarray
    """(s,) of a sine or a step, else NaN."""
    period_s: float
    rad_per_count: float

    @property
    def segments(self) -> list[tuple[str, np.ndarray, np.ndarray]]:
        """Kind, volts (n,) and angle (n,) [rad] of each."""
        ends = [*self.first[1:], len(self.volts)]
        return [
            (str(kind), self.volts[a:b], (self.counts[a:b] - self.counts[a]) * self.rad_per_count)
            for kind, a, b in zip(self.kind, self.first, ends, strict=True)
        ]


Found = tuple[float, float, float]
"""Gain [rad/s/V], pole [rad/s], friction [V]; NaN where it is not estimated."""


def load(path: str) -> Record:
    with np.load(path) as held:
        values: dict[str, Any] = {name: held[name] for name in Record._fields}
    for name in ("period_s", "rad_per_count"):
        values[name] = float(values[name])
    return Record(**values)


def mean_speeds(record: Record) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Voltage (n,), mean speed over the tick in which it is held (n,) [rad/s], and where a segment begins."""
    volts, speed, begins = [], [], []
    for _, u, angle in record.segments:
        volts.append(u[:-1])
        speed.append(np.diff(angle) / record.period_s)
        begins.append(np.arange(len(u) - 1) == 0)
    return np.concatenate(volts), np.concatenate(speed), np.concatenate(begins)


def from_discrete(p: float, b: float, c: float, period_s: float) -> Found:
    """Of v[k] = p v[k-1] + b0 u[k] + b1 u[k-1] + c sgn v[k-1] with b = b0 + b1, which the mean speeds over the ticks of
    a motor obey exactly while it does not reverse: K = b/(1 - p), a = -log(p)/T, friction -c/b."""
    return b / (1 - p), -np.log(p) / period_s if 0 < p < 1 else np.nan, -c / b
