"""What motors of one kind have in common, and which of them do not belong.

The spread between motors is freed of what their recordings' noise adds to it (`_random_effects`). Motors that do not
belong are found from robust distances (`_robust`) and left out, so that they do not widen it.

Parameters are taken in logarithms where they are sizes, so that a spread is a share.
"""

from typing import NamedTuple

import numpy as np

from jaxmotor._errors import JaxmotorError
from jaxmotor.fleet._random_effects import random_effects
from jaxmotor.fleet._robust import chi_square_quantile, robust

LEAST = 5
"""Motors for each parameter, below which a spread says nothing."""
OUTSIDE = 0.999
"""Part of the motors of one kind that are to lie within the threshold."""
ROUNDS = 10
"""Most rounds in which it is settled who belongs."""


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
    """(m,) robust distance, in standard deviations."""
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
        """(p, p) between motors; NaN where a parameter does not differ between them."""
        with np.errstate(divide="ignore", invalid="ignore"):
            return self.covariance / np.outer(self.spread, self.spread)

    def steadied(self) -> tuple[np.ndarray, np.ndarray]:
        """Estimates drawn to the mean as far as their own errors ask for it, (m, p), and their covariances (m, p, p).

        The empirical Bayes estimate E[θ_i | y_i] for motors that belong; others stay as they are.
        """
        outside = self.distance > self.threshold
        weight = self.covariance @ np.linalg.inv(self.covariance + self.errors)
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
            f"{len(values)} motors with {' and '.join(names)} are too few to tell their spread from their errors; "
            f"it takes {LEAST * len(names)}"
        )
    covariances = errors[:, :, None] * errors[:, None, :] * np.eye(len(names))
    if names[:2] == ("gain_rad_s_V", "pole_rad_s"):
        covariances[:, 0, 1] = covariances[:, 1, 0] = results["gain_pole_covariance_rad2_s2_V"][whole].astype(float)
    scale = np.where(sizes, values, 1.0)
    estimates = np.where(sizes, np.log(np.where(sizes, values, 1.0)), values)
    covariances = covariances / (scale[:, :, None] * scale[:, None, :])
    return population_of(names, logarithmic, tuple(map(str, results["motor"][whole])), estimates, covariances)


def population_of(
    names: tuple[str, ...], logarithmic: tuple[bool, ...], motors: tuple[str, ...], estimates: np.ndarray,
    errors: np.ndarray,
) -> Population:  # fmt: skip
    """The population of `estimates` (m, p) with covariances `errors` (m, p, p)."""
    threshold = float(np.sqrt(chi_square_quantile(OUTSIDE, len(names))))
    centre, shape = robust(estimates)
    inside = _distance(estimates - centre, np.broadcast_to(shape, errors.shape)) <= threshold
    # That is right where all are known equally well. A badly known motor may lie farther away and still belong.
    mean, mean_covariance, covariance = random_effects(estimates[inside], errors[inside])
    distance = _distance(estimates - mean, covariance + errors)
    for _ in range(ROUNDS):
        if ((distance <= threshold) == inside).all():
            break
        inside = distance <= threshold
        mean, mean_covariance, covariance = random_effects(estimates[inside], errors[inside])
        distance = _distance(estimates - mean, covariance + errors)
    outliers = tuple(
        _outlier(motors[k], float(distance[k]), names, estimates[k] - mean, covariance + errors[k])
        for k in sorted(np.flatnonzero(distance > threshold), key=lambda k: -distance[k])
    )
    return Population(
        names, logarithmic, motors, estimates, errors, mean, np.sqrt(np.diag(mean_covariance)), covariance, distance,
        threshold, outliers,
    )  # fmt: skip


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
