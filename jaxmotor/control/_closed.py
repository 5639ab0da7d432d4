"""A linear loop in discrete time: its poles, step response, bandwidth."""

import math
from typing import NamedTuple

import numpy as np

FREQUENCIES = 4096
"""Up to the Nyquist frequency, on which a bandwidth is looked for."""
LONGEST_STEP = 4000
"""Ticks that a step response is followed at most."""


class Closed(NamedTuple):
    """s[k+1] = A s[k] + B r[k], y[k] = C s[k], from a reference r to what is controlled."""

    transition: np.ndarray
    drive: np.ndarray
    output: np.ndarray

    @property
    def poles(self) -> np.ndarray:
        """In the z-plane."""
        return np.linalg.eigvals(self.transition)

    @property
    def radius(self) -> float:
        """Of the largest pole; below 1 the loop is stable."""
        return float(np.abs(self.poles).max())

    @property
    def gain(self) -> float:
        """At frequency zero."""
        return float(self.output @ np.linalg.solve(np.eye(len(self.drive)) - self.transition, self.drive))

    def step(self) -> np.ndarray:
        """(n,) response to a step of 1, until it has settled."""
        radius = min(self.radius, 1 - 1e-6)
        ticks = int(min(LONGEST_STEP, 20 + math.log(1e-5) / math.log(max(radius, 1e-3))))
        state, y = np.zeros(len(self.drive)), np.empty(ticks)
        for k in range(ticks):
            y[k] = self.output @ state
            state = self.transition @ state + self.drive
        return y

    @property
    def overshoot(self) -> float:
        """Of the step response above its final value, as a share of it."""
        return max(0.0, float(self.step().max()) / self.gain - 1) if self.gain else math.inf

    def bandwidth_Hz(self, period_s: float) -> float:
        """Where the response has fallen to -3 dB of that at frequency zero; the Nyquist frequency if never."""
        turns = np.linspace(0, 0.5, FREQUENCIES)[1:]
        size = np.abs(self.response(turns)) / abs(self.gain) - math.sqrt(0.5)
        below = np.flatnonzero(size < 0)
        if not len(below):
            return 0.5 / period_s
        k = below[0]
        if k == 0:
            return float(turns[0] / period_s)
        share = size[k - 1] / (size[k - 1] - size[k])
        return float((turns[k - 1] + share * (turns[k] - turns[k - 1])) / period_s)

    def response(self, turns: np.ndarray) -> np.ndarray:
        """At z = exp(2πj `turns`) (f,): by the poles, which is quick where they differ, else by solving."""
        z = np.exp(2j * np.pi * turns)
        values, vectors = np.linalg.eig(self.transition)
        if np.linalg.cond(vectors) < 1e8:
            weights = (self.output @ vectors) * np.linalg.solve(vectors, self.drive.astype(complex))
            return (weights / (z[:, None] - values)).sum(axis=1)
        eye = np.eye(len(self.drive))
        return np.array([self.output @ np.linalg.solve(one * eye - self.transition, self.drive) for one in z])


def largest(passes, low: float, high: float) -> float:
    """The largest number between `low` and `high` that `passes`, where all below one do; `low` where none does."""
    if passes(high):
        return high
    for _ in range(50):
        middle = math.sqrt(low * high)
        low, high = (middle, high) if passes(middle) else (low, middle)
    return low


def highest_of(passes, low: float, high: float) -> float:
    """The end of the numbers from `low` on that all pass, up to `high`; looked for in steps of a tenth."""
    number = max(2, round(math.log(high / low) / math.log(1.1)))
    good = low
    for value in np.geomspace(low, high, number)[1:]:
        if not passes(float(value)):
            return largest(passes, good, float(value))
        good = float(value)
    return high
