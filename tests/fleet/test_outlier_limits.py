"""How far a motor may lie: scipy's distributions, draws, and how often fleets of good motors have one named."""

import numpy as np
import pytest
from scipy import stats

from jaxmotor.fleet._outlier_limits import farthest
from jaxmotor.fleet._population import Population, population_of

FLEETS = 60


@pytest.mark.parametrize(("number", "size"), [(6, 1), (12, 2), (20, 4)])
def test_a_hundredth_lies_farther(number, size):
    rng = np.random.default_rng(number)
    draws = rng.normal(size=(20_000, number + 1, size))
    away = draws - draws[:, :number].mean(1, keepdims=True)
    shape = np.einsum("dmi,dmj->dij", away[:, :number], away[:, :number]) / (number - 1)
    distance = np.sqrt(np.einsum("dmi,dij,dmj->dm", away, np.linalg.inv(shape), away))
    own, other = farthest(float(number), size, 0.01)
    assert (distance[:, 0] > own).mean() == pytest.approx(0.01, abs=0.003)
    assert (distance[:, -1] > other).mean() == pytest.approx(0.01, abs=0.003)


def test_many_points_are_chi_square_and_few_allow_no_limit():
    own, other = farthest(1e7, 3, 1e-3)
    assert own == pytest.approx(np.sqrt(stats.chi2.isf(1e-3, 3)), rel=1e-5) == other
    assert farthest(4.0, 3, 0.01) == (np.inf, np.inf)


def fleets(number: int, size: int, astray: float = 0.0, error=1e-4) -> list[Population]:
    """`FLEETS` of normal motors, the first of each `astray` from the mean in one parameter [standard deviations]."""
    found = []
    for seed in range(FLEETS):
        rng = np.random.default_rng((number, size, seed))
        estimates = rng.normal(size=(number, size))
        if astray:
            estimates[0] = np.eye(size)[0] * astray
        sizes = np.broadcast_to(error, (number,))[:, None] * np.ones(size)
        estimates = estimates + sizes * rng.normal(size=estimates.shape)
        errors = sizes[:, :, None] * sizes[:, None, :] * np.eye(size)
        names, motors = tuple("abcd"[:size]), tuple(map(str, range(number)))
        found.append(population_of(names, (False,) * size, motors, estimates, errors))
    return found


@pytest.mark.parametrize(("number", "size"), [(8, 1), (12, 2), (20, 4), (50, 3), (200, 2)])
def test_few_fleets_of_good_motors_have_one_named(number, size):
    """One in twenty at most: that 10 of 60 have one has then a chance of a thousandth."""
    assert sum(len(found.outliers) > 0 for found in fleets(number, size)) < 10


def test_nor_where_half_of_the_motors_are_badly_known():
    error = np.where(np.arange(12) % 2, 0.1, 2.0)
    assert sum(len(found.outliers) > 0 for found in fleets(12, 2, error=error)) < 10


@pytest.mark.parametrize(
    ("number", "size", "astray", "share"),
    [
        (12, 1, 6.0, 0.9),
        (12, 2, 6.0, 0.7),
        (12, 2, 8.0, 0.95),
        (20, 2, 6.0, 0.9),
        (20, 4, 8.0, 0.9),
        (50, 3, 6.0, 0.95),
    ],
)
def test_a_motor_astray_is_found(number, size, astray, share):
    named = [{outlier.motor: outlier for outlier in found.outliers} for found in fleets(number, size, astray)]
    right = [each["0"].because == "a" for each in named if "0" in each]
    assert len(right) >= share * FLEETS and np.mean(right) > 0.9
