"""Spread between motors, and motors that do not belong, against draws from a known population and scipy."""

import numpy as np
import pytest
from scipy.optimize import minimize

import jaxmotor as jm
from jaxmotor.fleet import population
from jaxmotor.fleet._population import population_of
from jaxmotor.fleet._random_effects import random_effects
from jaxmotor.fleet._robust import robust

MEAN = np.log([11.0, 40.0])
BETWEEN = np.array([[0.03**2, 0.4 * 0.03 * 0.05], [0.4 * 0.03 * 0.05, 0.05**2]])


def drawn(number, error, seed):
    """Estimates (m, 2) of motors drawn from the population, with errors of unequal size around `error`."""
    rng = np.random.default_rng(seed)
    truth = rng.multivariate_normal(MEAN, BETWEEN, number)
    sizes = error * rng.uniform(0.3, 2.0, (number, 2))
    errors = sizes[:, :, None] * sizes[:, None, :] * np.eye(2)
    return truth, truth + sizes * rng.normal(size=truth.shape), errors


def test_spread_is_freed_of_the_errors():
    """Errors as large as the spread would double the variance; over 40 fleets the estimate is right on average."""
    found = np.array([random_effects(*drawn(200, 0.04, seed)[1:])[2] for seed in range(40)])
    mean, error = found.mean(0), found.std(0) / np.sqrt(len(found))
    assert (np.abs(mean - BETWEEN) < 4 * error).all()
    naive = np.array([np.cov(drawn(200, 0.04, seed)[1].T) for seed in range(10)]).mean(0)
    assert naive[0, 0] > 2 * BETWEEN[0, 0]


def test_it_is_the_restricted_maximum_of_the_likelihood():
    """Against scipy, with one parameter and three."""
    rng = np.random.default_rng(5)
    for size in (1, 3):
        y = rng.normal(size=(40, size)) * np.arange(1, size + 1)
        s = np.stack([np.diag(row) for row in rng.uniform(0.05, 0.6, (40, size))])

        def cost(flat, y=y, s=s, size=size):
            factor = np.zeros((size, size))
            factor[np.tril_indices(size)] = flat
            inverse = np.linalg.inv(factor @ factor.T + s)
            information = inverse.sum(0)
            mean = np.linalg.solve(information, np.einsum("mij,mj->i", inverse, y))
            square = np.einsum("mi,mij,mj->", y - mean, inverse, y - mean)
            return square - np.linalg.slogdet(inverse)[1].sum() + np.linalg.slogdet(information)[1]

        start = np.linalg.cholesky(np.cov(y.T).reshape(size, size))[np.tril_indices(size)]
        best = minimize(cost, start, method="BFGS", options={"gtol": 1e-8})
        found = np.linalg.cholesky(random_effects(y, s)[2])[np.tril_indices(size)]
        assert cost(found) == pytest.approx(best.fun, abs=1e-5)
        np.testing.assert_allclose(np.abs(found), np.abs(best.x), atol=2e-3)


def test_no_spread_is_found_where_there_is_none():
    rng = np.random.default_rng(2)
    errors = np.broadcast_to(0.05**2 * np.eye(2), (300, 2, 2))
    _, _, between = random_effects(MEAN + 0.05 * rng.normal(size=(300, 2)), np.array(errors))
    assert np.sqrt(np.diag(between)).max() < 0.02


def test_robust_is_right_for_normal_points_and_does_not_mind_a_quarter_of_others():
    rng = np.random.default_rng(1)
    shape = np.array([[1.0, 0.5], [0.5, 2.0]])
    points = rng.multivariate_normal([1, 2], shape, 4000)
    _, found = robust(points)
    np.testing.assert_allclose(found, shape, atol=0.12)
    points[:1000] = rng.multivariate_normal([20, -20], 0.1 * np.eye(2), 1000)
    centre, found = robust(points)
    np.testing.assert_allclose(centre, [1, 2], atol=0.12)
    np.testing.assert_allclose(found, shape, atol=0.35)


def fleet(number=120, seed=3):
    _, estimates, errors = drawn(number, 0.004, seed)
    return estimates, errors


def test_motors_that_do_not_belong_are_named_with_the_reason():
    estimates, errors = fleet()
    estimates[7] += (0.0, 0.5)
    estimates[50] -= (0.3, 0.0)
    names, motors = ("gain_rad_s_V", "pole_rad_s"), tuple(f"m{k}" for k in range(len(estimates)))
    found = population_of(names, (True, True), motors, estimates, errors)
    named = {outlier.motor: outlier for outlier in found.outliers}
    assert named["m7"].because == "pole_rad_s" and named["m7"].deviation > 5
    assert named["m50"].because == "gain_rad_s_V" and named["m50"].deviation < -5
    np.testing.assert_allclose(found.spread, np.sqrt(np.diag(BETWEEN)), rtol=0.2)
    assert found.correlation[0, 1] == pytest.approx(0.4, abs=0.2)


@pytest.mark.parametrize("error", [0.0, 0.004])
@pytest.mark.parametrize("same", [0, 1])
def test_a_parameter_that_is_the_same_for_all_has_no_correlation(same, error):
    """Distances are those of the other parameter alone."""
    rng = np.random.default_rng(4)
    estimates = MEAN + rng.normal(size=(80, 2)) * (0.03, 0.05)
    estimates[:, same] = MEAN[same]
    estimates[9, 1 - same] += 0.6
    errors = np.broadcast_to(error**2 * np.eye(2), (80, 2, 2)).copy()
    names, motors = ("gain_rad_s_V", "pole_rad_s"), tuple(map(str, range(80)))
    found = population_of(names, (True, True), motors, estimates, errors)
    one = [1 - same]
    alone = population_of((names[1 - same],), (True,), motors, estimates[:, one], errors[:, one][:, :, one])
    assert found.without_spread == (names[same],) and found.spread[same] == 0
    assert found.mean[same] == MEAN[same] and found.mean_error[same] == pytest.approx(error / np.sqrt(80))
    assert np.isnan(found.correlation[same]).all() and np.isnan(found.correlation[:, same]).all()
    assert found.correlation[1 - same, 1 - same] == pytest.approx(1.0)
    np.testing.assert_array_equal(found.distance, alone.distance)
    assert found.threshold == alone.threshold and found.outliers == alone.outliers
    assert (found.outliers[0].motor, found.outliers[0].because) == ("9", names[1 - same])
    steadied, covariance = found.steadied()
    np.testing.assert_array_equal(steadied[:, same], MEAN[same])
    assert np.isfinite(steadied).all() and np.isfinite(covariance).all()


def test_all_motors_the_same_and_one_that_is_not():
    estimates, errors = np.tile(MEAN, (30, 1)), np.broadcast_to(1e-6 * np.eye(2), (30, 2, 2)).copy()
    names, motors = ("gain_rad_s_V", "pole_rad_s"), tuple(map(str, range(30)))
    found = population_of(names, (True, True), motors, estimates, errors)
    assert found.without_spread == names and found.outliers == () and (found.distance == 0).all()
    assert np.isnan(found.correlation).all()
    estimates[3] += (0.0, 0.2)
    found = population_of(names, (True, True), motors, estimates, errors)
    assert found.without_spread == names
    assert [(outlier.motor, outlier.because) for outlier in found.outliers] == [("3", "pole_rad_s")]


def test_more_than_half_of_the_motors_are_the_same():
    """So that their median deviation is none; the others differ by what their errors allow and belong."""
    rng = np.random.default_rng(6)
    estimates = np.tile(MEAN, (60, 1))
    estimates[40:] += 0.01 * rng.normal(size=(20, 2))
    errors = np.broadcast_to(0.01**2 * np.eye(2), (60, 2, 2)).copy()
    found = population_of(("a", "b"), (True, True), tuple(map(str, range(60))), estimates, errors)
    assert found.outliers == () and np.isfinite(found.distance).all()


def test_a_badly_known_motor_belongs_all_the_same():
    """Every second motor is known fifty times worse than the others, far beyond the spread between them."""
    rng = np.random.default_rng(8)
    truth, estimates, errors = drawn(200, 0.002, 8)
    sizes = 0.1 * rng.uniform(0.5, 1.5, (100, 2))
    estimates[::2] = truth[::2] + sizes * rng.normal(size=sizes.shape)
    errors[::2] = sizes[:, :, None] * sizes[:, None, :] * np.eye(2)
    found = population_of(("a", "b"), (True, True), tuple(map(str, range(200))), estimates, errors)
    assert len(found.outliers) <= 2
    np.testing.assert_allclose(found.spread, np.sqrt(np.diag(BETWEEN)), rtol=0.2)


def test_steadied_estimates_are_nearer_the_truth():
    truth, estimates, errors = drawn(150, 0.06, 9)
    found = population_of(("a", "b"), (True, True), tuple(map(str, range(150))), estimates, errors)
    steadied, covariance = found.steadied()
    before, after = ((estimates - truth) ** 2).mean(0), ((steadied - truth) ** 2).mean(0)
    assert (after < 0.6 * before).all()
    score = np.einsum("mi,mij,mj->m", steadied - truth, np.linalg.inv(covariance), steadied - truth)
    assert score.mean() / 2 == pytest.approx(1.0, abs=0.35)


def test_from_results_and_too_few():
    estimates, errors = fleet()
    columns = {
        "motor": np.array([f"m{k}" for k in range(120)], object),
        "gain_rad_s_V": np.exp(estimates[:, 0]),
        "pole_rad_s": np.exp(estimates[:, 1]),
        "gain_standard_error_rad_s_V": np.exp(estimates[:, 0]) * np.sqrt(errors[:, 0, 0]),
        "pole_standard_error_rad_s": np.exp(estimates[:, 1]) * np.sqrt(errors[:, 1, 1]),
        "gain_pole_covariance_rad2_s2_V": np.zeros(120),
    }
    columns["gain_rad_s_V"][4] = np.nan
    found = population(columns)
    assert len(found.motors) == 119 and "m4" not in found.motors
    np.testing.assert_allclose(found.estimates, np.delete(estimates, 4, 0), rtol=1e-12)
    np.testing.assert_allclose(found.errors, np.delete(errors, 4, 0), rtol=1e-9)
    with pytest.raises(jm.JaxmotorError, match="too few"):
        population({name: column[:7] for name, column in columns.items()})
    with pytest.raises(jm.JaxmotorError, match="a population is of"):
        population(columns, ("gain_rad_s_V", "colour"))
