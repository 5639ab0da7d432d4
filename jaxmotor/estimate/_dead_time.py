"""A dead time of many rows that the linear motor lacks: the voltage acts, or the shaft is read, so much later.

To first order a law is known that moves the motor a little; a delay of more than a few rows is none of these. Voltages
are therefore moved by each of several delays, the linear motor is fitted anew, and the delay d is sought that leaves
the least sum of squares,

    min over d of min over K, b, a of Σ (y - y(K, b, a; u(t - d)))².
"""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from jaxmotor._errors import JaxmotorError
from jaxmotor.estimate._estimate import Estimate, fit_whole
from jaxmotor.estimate._open_hypotheses import MOST_TICKS, SHOWN
from jaxmotor.motor.effects import LONGEST_DELAY_S
from jaxmotor.prediction import Packed, as_problem, delayed, holding
from jaxmotor.recording import Recording

EXPLAINS = 0.5
"""Part of what the linear motor leaves that a dead time must take up to be told."""
RATIO = 1.5
"""Of the delays that are tried at first."""
FINE_ROWS = 0.25
"""To which the best one is sought [rows]."""
GOLDEN = (math.sqrt(5) - 1) / 2
"""By which an interval that holds a minimum becomes shorter with each value."""
LONGEST_SHARE = 0.25
"""Part of the log that a dead time takes at most."""


class DeadTime(NamedTuple):
    """The linear motor with its voltages so much later."""

    delay_s: float
    gain: float
    """[rad/s/V]"""
    pole: float
    """[rad/s]"""

    @property
    def note(self) -> str:
        """For people."""
        return (
            f"{SHOWN}a dead time of {self.delay_s:.3g} s: with that the gain would be about {self.gain:.4g} rad/s/V "
            f"and the pole {self.pole:.4g} rad/s; `jaxmotor diagnose` finds what it is"
        )


def dead_time(
    recording: Recording, packed: Packed, estimate: Estimate, seed: int, held: tuple[int, ...] = ()
) -> DeadTime | None:
    """That of `packed` segments, beside their linear motor `estimate`, of whose ψ those that are `held` were not
    fitted; None where none of more than a few rows takes up enough of what that leaves."""
    row_s = float(packed.durations[0])
    start = np.asarray(estimate.solution.psi)
    known: dict[float, tuple[float, np.ndarray]] = {}
    """Sum of squares and ψ of each delay whose fit settled."""

    def square(delay_s: float) -> float:
        try:
            found = fit_whole(recording, holding(as_problem(delayed(packed, delay_s)), held), start, seed)
        except JaxmotorError:
            return np.inf
        known[delay_s] = _square(found), np.asarray(found.solution.psi)
        return known[delay_s][0]

    longest_s = min(LONGEST_DELAY_S, LONGEST_SHARE * len(packed) * row_s)
    delays_s = _tried(MOST_TICKS * row_s, longest_s)
    squares = [square(delay_s) for delay_s in delays_s[1:-1]]
    if not known:
        return None
    best = 1 + int(np.argmin(squares))
    _minimise(square, delays_s[best - 1], delays_s[best + 1], FINE_ROWS * row_s)
    delay_s = min(known, key=lambda one: known[one][0])
    least, psi = known[delay_s]
    if not least < (1 - EXPLAINS) * _square(estimate):
        return None
    return DeadTime(delay_s, float(psi[0]), float(np.exp(psi[2])))


def _tried(from_s: float, to_s: float) -> list[float]:
    """Delays [s] between these, and one on either side."""
    number = int(np.ceil(np.log(to_s / from_s) / np.log(RATIO))) if to_s > from_s else 0
    return [from_s * RATIO**k for k in range(number + 2)] if number else []


def _minimise(function: Callable[[float], float], low: float, high: float, fine: float) -> None:
    """Ask for values of `function` between `low` and `high`, ever nearer to the least, until that is known to `fine`
    (golden section)."""
    inner = [high - GOLDEN * (high - low), low + GOLDEN * (high - low)]
    values = [function(one) for one in inner]
    while high - low > fine:
        if values[0] < values[1]:
            high, inner = inner[1], [inner[1] - GOLDEN * (inner[1] - low), inner[0]]
            values = [function(inner[0]), values[0]]
        else:
            low, inner = inner[0], [inner[1], inner[0] + GOLDEN * (high - inner[0])]
            values = [values[1], function(inner[1])]


def _square(estimate: Estimate) -> float:
    """Sum of squares of what it leaves [units²]."""
    return float(np.square(np.asarray(estimate.solution.residual)).sum())
