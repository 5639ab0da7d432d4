"""Many motors, one plan: the fast way against exact motors, against rounding, and against `identify`."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from testing.made import COUNTS, PERIOD, motion, recording, sine

import jaxmotor as jm
from jaxmotor.fleet import fit_shared, project, shared_plan

FREQUENCIES = tuple(np.geomspace(0.5, 10, 8) * 1.0037)
RUNS = [sine(f, 700) for f in FREQUENCIES]
VOLTS = np.array([volts for _, _, volts in RUNS])


def positions(gains, poles):
    """(frequency, motor, tick) in counts, not rounded."""
    angle = [[np.concatenate([[0.0], np.cumsum(motion(u, k, a)[1])[:-1]]) for k, a in zip(gains, poles, strict=True)]
             for u in VOLTS]  # fmt: skip
    return np.array(angle) * COUNTS / (2 * np.pi)


@pytest.fixture(scope="module")
def plan():
    return shared_plan(np.array(FREQUENCIES), VOLTS, PERIOD, COUNTS)


def fleet(number=40):
    rng = np.random.default_rng(0)
    return rng.uniform(1, 30, number) * rng.choice([-1, 1], number), np.exp(rng.uniform(np.log(3), np.log(300), number))


def test_exact_for_an_exact_motor(plan, x64):
    gains, poles = fleet()
    found = fit_shared(plan, jnp.asarray(positions(gains, poles)))
    np.testing.assert_allclose(found.gain, gains, rtol=1e-8)
    np.testing.assert_allclose(found.pole, poles, rtol=1e-7)


def test_the_sine_fit_is_least_squares(plan, x64):
    y = positions([11.0], [40.0])
    found = fit_shared(plan, jnp.asarray(y))
    tick = np.arange(700)
    for k, frequency in enumerate(FREQUENCIES):
        angle = 2 * np.pi * frequency * PERIOD * tick
        columns = np.stack([np.sin(angle), np.cos(angle), np.ones(700), tick], axis=1)
        expected = np.linalg.lstsq(columns, y[k, 0])[0][:2]
        np.testing.assert_allclose(found.coefficients[0, k], expected, rtol=1e-8, atol=1e-8)


def test_standard_errors_hold_under_rounding(plan, x64):
    rng = np.random.default_rng(1)
    gains, poles = np.full(300, 11.0), rng.uniform(30, 50, 300)
    exact = positions(gains, poles)
    counts = np.floor(exact + rng.uniform(size=(*exact.shape[:2], 1)))
    found = fit_shared(plan, jnp.asarray(counts))
    for value, truth, error in ((found.gain, gains, found.gain_error), (found.pole, poles, found.pole_error)):
        score = (np.asarray(value) / truth - 1) / np.asarray(error)
        assert abs(score.mean()) < 0.25 and 0.8 < score.std() < 1.25


def test_single_precision_loses_less_than_the_rounding_does(plan):
    gains, poles = fleet()
    counts = np.floor(positions(gains, poles))
    with jax.enable_x64(True):
        double = fit_shared(plan, jnp.asarray(counts))
        single = fit_shared(plan, jnp.asarray(counts.astype(np.float32)))
        assert project(plan, jnp.asarray(counts.astype(np.float32))).dtype == jnp.float32
        double, single = jax.tree.map(np.asarray, (double, single))
    assert (np.abs(single.pole / double.pole - 1) < 0.05 * double.pole_error).all()
    assert (np.abs(single.gain / double.gain - 1) < 0.05 * double.gain_error).all()


def test_agrees_with_identify(plan, x64):
    given = recording(5, gain=10.0, pole=37.0, runs=RUNS)
    counts = np.array([[segment.count - segment.count[0]] for segment in given.segments], float)
    found, fit = fit_shared(plan, jnp.asarray(counts)), jm.identify(given)
    assert float(found.gain[0]) == pytest.approx(float(fit.motor.gain), rel=1e-4)
    assert float(found.pole[0]) == pytest.approx(float(fit.motor.pole), rel=1e-3)
    assert float(found.chi2[0]) < 3
