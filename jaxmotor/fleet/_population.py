"""What motors of one kind have in common, and which of them do not belong.

The spread between motors is freed of what their recordings' noise adds to it (`_random_effects`). Motors that do not
belong are found from robust distances (`_robust`) and left out, so that they do not widen it.

Parameters are taken in logarithms where they are sizes, so that a spread is a share. One that is the same for all
motors has no spread and no correlation; distances are then those of the others.
"""

import re
from typing import NamedTuple

import numpy as np

from jaxmotor._errors import JaxmotorError
from jaxmotor._sentences import named
from jaxmotor.fleet._outlier_limits import farthest
from jaxmotor.fleet._random_effects import random_effects
from jaxmotor.fleet._robust import robust

LEAST = 5
"""Motors for each parameter, below which a spread says nothing."""
FALSE_ALARM = 0.03
"""Chance that a fleet of motors of one kind has one beyond the threshold; simulated it is 3 to 5 %."""
WELL_WITHIN = 0.975
"""Part of the motors that the first round is made of."""
ROUNDS = 20
"""Most rounds until it is the same motors that belong."""
SAME = 1e-12
"""Relative difference of estimates that is rounding."""
LEAST_ERROR = 1e-6
"""Of an estimate, in standard deviations of all: less is not told from none."""


Common = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]


class Outlier(NamedTuple):
    """A motor that does not belong to the rest."""

    motor: str
    distance: float
    """Robust one, in standard deviations."""
    because: str
    """The parameter that moves it farthest with the others as they are."""
    deviation: float
    """Of that parameter from what the others let expect, in standard deviations."""


class Population(NamedTuple):
    """Parameters (p) of motors (m) of one kind."""

    names: tuple[str, ...]
    """Columns of the results; those of `logarithmic` are sizes and taken in logarithms."""
    logarithmic: tuple[bool, ...]
    motors: tuple[str, ...]
    estimates: np.ndarray
    """(m, p), logarithms where `logarithmic`."""
    errors: np.ndarray
    """(m, p, p) covariance of each estimate."""
    mean: np.ndarray
    """(p,)."""
    mean_error: np.ndarray
    """(p,) standard error of `mean`."""
    covariance: np.ndarray
    """(p, p) between motors, without the estimates' own errors."""
    distance: np.ndarray
    """(m,) robust distance, in standard deviations of the parameters that differ between motors."""
    threshold: float
    """Beyond it a motor is not counted in."""
    outliers: tuple[Outlier, ...]
    """The farthest first."""

    @property
    def spread(self) -> np.ndarray:
        """(p,) standard deviation between motors; of a logarithm, it is a share."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def correlation(self) -> np.ndarray:
        """(p, p) between motors; NaN, in words not defined, for a parameter without spread."""
        with np.errstate(divide="ignore", invalid="ignore"):
            return self.covariance / np.outer(self.spread, self.spread)

    @property
    def without_spread(self) -> tuple[str, ...]:
        """Those of `names` that are the same for all motors."""
        return tuple(name for name, spread in zip(self.names, self.spread, strict=True) if spread == 0)

    def sizes(self, values: np.ndarray) -> np.ndarray:
        """`values` (..., p) in the units of `names`: from logarithms to sizes."""
        logs = np.array(self.logarithmic)
        return np.where(logs, np.exp(np.where(logs, values, 0.0)), values)

    def steadied(self) -> tuple[np.ndarray, np.ndarray]:
        """Estimates drawn to the mean as far as their own errors ask for it, (m, p), and their covariances (m, p, p).

        The empirical Bayes estimate E[θ_i | y_i] for motors that belong; others stay as they are.
        """
        outside = self.distance > self.threshold
        weight = self.covariance @ np.linalg.pinv(self.covariance + self.errors, hermitian=True)
        weight[outside] = np.eye(len(self.names))
        drawn = self.mean + np.einsum("mij,mj->mi", weight, self.estimates - self.mean)
        return drawn, np.einsum("mij,mjk->mik", weight, self.errors)


COLUMNS = {
    "gain_rad_s_V": ("gain_standard_error_rad_s_V", True),
    "pole_rad_s": ("pole_standard_error_rad_s", True),
    "coulomb_friction_V": ("coulomb_friction_standard_error_V", False),
    "dead_zone_V": ("dead_zone_standard_error_V", False),
}
"""Results that a population is made of: their standard errors, and whether they are sizes to take in logarithms."""


def population(results: dict[str, np.ndarray], names: tuple[str, ...] = ("gain_rad_s_V", "pole_rad_s")) -> Population:
    """The population of the motors in `results` (as `read_results` gives them), of the columns `names`.

    Motors that lack one of them are left out.

    **Raises:** `JaxmotorError` where a column is not known or there are too few motors.
    """
    unknown = [name for name in names if name not in COLUMNS]
    if unknown or not names:
        raise JaxmotorError(f"a population is of {', '.join(COLUMNS)}; not of {', '.join(unknown) or 'nothing'}")
    values = np.stack([results[name].astype(float) for name in names], axis=1)
    errors = np.stack([results[COLUMNS[name][0]].astype(float) for name in names], axis=1)
    whole = np.isfinite(values).all(1) & np.isfinite(errors).all(1)
    logarithmic = tuple(COLUMNS[name][1] for name in names)
    sizes = np.array(logarithmic)
    whole &= (values[:, sizes] > 0).all(1)
    values, errors = values[whole], errors[whole]
    if len(values) < LEAST * len(names):
        raise JaxmotorError(
            f"{len(values)} motors with {' and '.join(map(_title, names))} are too few to tell their spread from "
            f"their errors; it takes {LEAST * len(names)}"
        )
    covariances = errors[:, :, None] * errors[:, None, :] * np.eye(len(names))
    if names[:2] == ("gain_rad_s_V", "pole_rad_s"):
        covariances[:, 0, 1] = covariances[:, 1, 0] = results["gain_pole_covariance_rad2_s2_V"][whole].astype(float)
    scale = np.where(sizes, values, 1.0)
    estimates = np.where(sizes, np.log(np.where(sizes, values, 1.0)), values)
    covariances = covariances / (scale[:, :, None] * scale[:, None, :])
    return population_of(names, logarithmic, tuple(map(str, results["motor"][whole])), estimates, covariances)


def _title(column: str) -> str:
    """A column's name as words, without its unit."""
    return named(re.sub("(_rad_s)?(_V)?$", "", column))


def population_of(
    names: tuple[str, ...], logarithmic: tuple[bool, ...], motors: tuple[str, ...], estimates: np.ndarray,
    errors: np.ndarray,
) -> Population:  # fmt: skip
    """The population of `estimates` (m, p) with covariances `errors` (m, p, p)."""
    size = len(names)
    mean, mean_error = _alike(estimates, errors)
    covariance, distance, threshold = np.zeros((size, size)), np.zeros(len(estimates)), 0.0
    outliers: tuple[Outlier, ...] = ()
    differ = np.flatnonzero(_differs(estimates))
    if len(differ):
        own, own_names = np.ix_(differ, differ), tuple(names[k] for k in differ)
        y, s = estimates[:, differ], _told_from_none(estimates[:, differ], errors[:, *own])
        (mean[differ], mean_covariance, covariance[own], distance), threshold = _settled(y, s)
        mean_error[differ] = np.sqrt(np.diag(mean_covariance))
        away, spread = y - mean[differ], covariance[own] + s
        outliers = tuple(
            _outlier(motors[k], float(distance[k]), own_names, away[k], spread[k])
            for k in sorted(np.flatnonzero(distance > threshold), key=lambda k: -distance[k])
        )
    return Population(
        names, logarithmic, motors, estimates, errors, mean, mean_error, covariance, distance, threshold, outliers
    )


def _alike(estimates: np.ndarray, errors: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Mean (p,) and its standard error of motors that are all the same, parameter by parameter."""
    variance = np.einsum("mii->mi", errors)
    with np.errstate(divide="ignore"):
        error = 1 / np.sqrt((1 / variance).sum(0))
    return np.median(estimates, axis=0), error


def _told_from_none(estimates: np.ndarray, errors: np.ndarray) -> np.ndarray:
    """`errors` with the least that is told from none beside."""
    return errors + np.diag((LEAST_ERROR * estimates.std(0)) ** 2)


def _settled(estimates: np.ndarray, errors: np.ndarray) -> tuple[Common, float]:
    """What the motors that belong have in common, and the distance beyond which one does not."""
    number, size = estimates.shape

    def of_those(inside: np.ndarray) -> tuple[Common, tuple[float, float]]:
        found = _of_those(inside, estimates, errors)
        return found, farthest(_as_many(found[2] + errors[inside]), size, FALSE_ALARM / number)

    inside = _surely_inside(estimates)
    # That is right where all are known equally well. A badly known motor may lie farther away and still belong.
    found, limits = of_those(inside)
    for _ in range(ROUNDS):
        after = found[-1] <= np.where(inside, *limits)
        if (after == inside).all():
            break
        inside, (found, limits) = after, of_those(after)
    return found, limits[1]


def _as_many(covariances: np.ndarray) -> float:
    """Equally well known motors that tell as much of the spread as those with `covariances` (m, p, p) do.

    With the inverse variances w that is (Σ w)²/Σ w².
    """
    log_det = np.linalg.slogdet(covariances)[1]
    weight = np.exp((log_det.min() - log_det) / covariances.shape[-1])
    return float(weight.sum() ** 2 / (weight**2).sum())


def _surely_inside(estimates: np.ndarray) -> np.ndarray:
    """(m,) whether a motor lies in the midst of them: at least half do."""
    from scipy.special import chdtri

    number, size = estimates.shape
    centre, shape = robust(estimates)
    square = _distance(estimates - centre, np.broadcast_to(shape, (number, size, size))) ** 2
    half = np.sort(square)[(number + size + 1) // 2 - 1]
    return square <= max(half, chdtri(size, 1 - WELL_WITHIN))  # a quantile of chi-square


def _of_those(inside: np.ndarray, estimates: np.ndarray, errors: np.ndarray) -> Common:
    """Of the motors `inside` (m,): mean, its covariance, the covariance between motors; and the distance of all."""
    mean, mean_covariance, covariance = random_effects(estimates[inside], errors[inside])
    same = ~_differs(estimates[inside])
    covariance[same], covariance[:, same] = 0.0, 0.0
    return mean, mean_covariance, covariance, _distance(estimates - mean, covariance + errors)


def _differs(estimates: np.ndarray) -> np.ndarray:
    """(p,) whether a parameter differs between the motors by more than rounding."""
    return np.ptp(estimates, axis=0) > SAME * np.abs(estimates).max(0)


def _distance(away: np.ndarray, covariance: np.ndarray) -> np.ndarray:
    """(m,) length of `away` (m, p) in standard deviations."""
    return np.sqrt(np.einsum("mi,mi->m", away, np.linalg.solve(covariance, away[..., None])[..., 0]))


def _outlier(motor: str, distance: float, names: tuple[str, ...], away: np.ndarray, spread: np.ndarray) -> Outlier:
    """Why: each parameter against its expectation given the others, (Σ⁻¹ d)_k/√(Σ⁻¹)_kk, and the largest of them."""
    inverse = np.linalg.inv(spread)
    deviations = inverse @ away / np.sqrt(np.diag(inverse))
    alone = away / np.sqrt(np.diag(spread))
    # What stands out by itself is named before what stands out only beside the others.
    chosen = alone if np.abs(alone).max() > 4 else deviations
    worst = int(np.argmax(np.abs(chosen)))
    return Outlier(motor, distance, names[worst], float(chosen[worst]))
