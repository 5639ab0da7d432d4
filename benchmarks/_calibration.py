"""Whether what was hidden is named, and how true the stated probabilities are."""

import itertools
from collections.abc import Collection, Sequence
from typing import NamedTuple, Protocol

import numpy as np
from scipy.optimize import minimize

from jaxmotor.diagnosis import Diagnosis, FoundEffect

SAID = (0.0, 0.05, 0.2, 0.5, 0.8, 0.95, np.inf)
SHARES = (0.0, 1e-9, 1e-3, 1e-2, 0.1, np.inf)
SUREST = 1e-3
"""As which probabilities nearer to 0 or 1 count in the log loss: so far nobody has tested them."""
Said = list[tuple[float, bool]]
"""A probability, and whether it was so."""


class HasTruth(Protocol):
    @property
    def truth(self) -> Collection[str]:
        """Names of the effects that are hidden."""
        ...


def alike(one: FoundEffect) -> list[str]:
    """The effect, and those that the recording does not tell from it."""
    return [one.name, *(other.name for other in one.alternatives if other.inseparable)]


def is_found(hidden: HasTruth, found: Diagnosis) -> bool:
    """Each hidden effect is named or an alternative, and nothing else is named."""
    named = [alike(one) for one in found.effects if one.is_named]
    return len(named) == len(hidden.truth) and all(any(name in one for one in named) for name in hidden.truth)


def told(hidden: HasTruth, found: Diagnosis) -> Said:
    """The probability of each effect and of none, and whether it is so."""
    return [
        (said, name in hidden.truth if name != "none" else not hidden.truth)
        for name, said in found.probabilities.items()
    ]


def log_loss(said: Said) -> float:
    """Mean of -log of the probability of what is so."""
    clipped = np.clip([one for one, _ in said], SUREST, 1 - SUREST)
    return float(-np.mean(np.log(np.where([true for _, true in said], clipped, 1 - clipped))))


def bins(said: Said) -> Sequence[tuple[str, int, int]]:
    """Range of probabilities, how many of it are true, and how many there are."""
    rows = []
    for low, high in itertools.pairwise(SAID):
        inside = [true for probability, true in said if low <= probability < high]
        rows.append((f"{low:g} to {high:.2g}", sum(inside), len(inside)))
    return rows


class Certain(NamedTuple):
    """An effect that was found."""

    unexplained: float
    """`FoundEffect.unexplained_share`."""
    right: bool
    """It is there, or what it may as well be."""
    family: bool
    """One of its family is."""


def by_unexplained(found: Sequence[Certain]) -> Sequence[tuple[str, int, int, int]]:
    """Range of unexplained shares, how many effects in it are right, of how many the family is, and how many there
    are."""
    rows = []
    for low, high in itertools.pairwise(SHARES):
        inside = [one for one in found if low <= one.unexplained < high]
        right, family = sum(one.right for one in inside), sum(one.family for one in inside)
        rows.append(("none" if high < 1e-6 else f"{low:g} to {min(high, 1):g}", right, family, len(inside)))
    return rows


def logistic(unexplained: Sequence[float], true: Sequence[bool]) -> tuple[float, float]:
    """half, power of the probability 1 / (1 + (share / half)^power) by maximum likelihood, with priors of two decades
    about 0.1 and of a factor of two about 1; where that share is none, nothing is said."""
    share = np.array([one for one in unexplained if one > 0])
    so = np.array([one for one, some in zip(true, unexplained, strict=True) if some > 0])

    def loss(free: np.ndarray) -> float:
        odds = np.exp(free[1]) * (np.log(share) - free[0])
        prior = ((free[0] - np.log(0.1)) / np.log(100)) ** 2 + (free[1] / np.log(2)) ** 2
        return float(np.logaddexp(0, np.where(so, odds, -odds)).sum() + 0.5 * prior)

    half, power = np.exp(minimize(loss, [np.log(0.1), 0.0], method="Nelder-Mead").x)
    return float(half), float(power)


def calibration(said: Said) -> str:
    """true/said of each range of probabilities."""
    return ", ".join(f"{name}: {true}/{number}" for name, true, number in bins(said))
