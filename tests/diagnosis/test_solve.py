"""Steps of a fit that may go only so far."""

import numpy as np
import pytest
from scipy.optimize import lsq_linear
from test_search import FRICTION_V, GAIN, POLE, noisy_log

from jaxmotor.diagnosis._free import linear_of, with_effect
from jaxmotor.diagnosis._solve import _boxed, block_variance
from jaxmotor.diagnosis._study import study_of
from jaxmotor.motor.effects import ShaftCompliance


def problem(seed):
    """Rows, residual and box of a least-squares step whose columns are far from alike in size."""
    rng = np.random.default_rng(seed)
    size = int(rng.integers(2, 9))
    rows = rng.normal(size=(60, size)) * 10.0 ** rng.uniform(-4, 4, size)
    reach = np.abs(np.linalg.lstsq(rows, rng.normal(size=60), rcond=None)[0]) * rng.uniform(0.2, 5, size)
    return rows, rng.normal(size=60), reach * rng.uniform(0.5, 1, size), reach


@pytest.mark.parametrize("seed", range(40))
def test_the_step_is_nearly_the_best_in_its_box(seed):
    rows, residual, low, high = problem(seed)
    step = _boxed(rows.T @ rows, -rows.T @ residual, -low, high)
    assert np.all(-low * (1 + 1e-12) <= step) and np.all(step <= high * (1 + 1e-12))
    best = lsq_linear(rows, -residual, (-low, high), method="bvls", tol=1e-14).x
    gains = [residual @ residual - np.sum((residual + rows @ one) ** 2) for one in (step, best)]
    assert gains[0] > 0.8 * gains[1]


def test_without_a_box_it_is_least_squares():
    rows, residual, _, _ = problem(0)
    far = np.full(rows.shape[1], np.inf)
    step = _boxed(rows.T @ rows, -rows.T @ residual, -far, far)
    np.testing.assert_allclose(step, np.linalg.lstsq(rows, -residual, rcond=None)[0], rtol=1e-6)


def test_one_short_element_does_not_shorten_the_others():
    step = _boxed(np.diag([1.0, 1.0]), np.array([100.0, 0.5]), np.full(2, -1.0), np.full(2, 1.0))
    np.testing.assert_allclose(step, [1.0, 0.5], rtol=1e-8)


@pytest.mark.parametrize("alike", [1, 25])
def test_priors_weigh_as_much_as_rows_that_say_something_new(alike):
    rng = np.random.default_rng(alike)
    rows, block = np.repeat(rng.normal(size=(400, 6)), alike, axis=0), np.repeat(np.arange(40), 10 * alike)
    residual = 3.0 * np.repeat(rng.normal(size=400), alike)
    # As many rows in a row that say the same weigh as one; the variance of independent ones is that of single rows.
    assert block_variance(residual, rows, block) == pytest.approx(9.0 * alike, rel=0.25)
    assert block_variance(0.1 * residual / np.sqrt(alike), rows, block) == 1.0
    assert block_variance(np.append(residual[:-1], np.nan), rows, block) == 1.0


@pytest.mark.usefixtures("x64")
def test_a_fit_that_leads_to_what_cannot_be_ends():
    """Beside friction a load on a spring does best where it no longer rings."""
    study = study_of(noisy_log(6, FRICTION_V), POLE)
    load = ShaftCompliance.of(frequency_Hz=1.0, damping_ratio=0.6, inertia_ratio=0.35)
    motor, solver, tried = with_effect(linear_of(GAIN, POLE), load), study.solver, []
    inner, rig = solver.linearise, solver.rig
    assert rig is not None and load.possible(rig)
    solver.linearise = lambda *its: tried.append(its[1]) or inner(*its)
    ended = solver.fit(motor)
    number, solver.rig = len(tried), None
    solver.fit(motor)
    assert not ended.motor.effects[0].possible(rig)
    assert number < len(tried) - number
