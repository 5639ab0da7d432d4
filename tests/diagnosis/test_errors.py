"""Standard errors of a law that follows what shows of it only roughly, and of the effects beside it."""

import numpy as np
import pytest

from jaxmotor.diagnosis._errors import covariance
from jaxmotor.diagnosis._free import OWN, free_of, linear_of
from jaxmotor.diagnosis._solve import Fitted
from jaxmotor.motor.effects import Backlash, CoulombFriction

ROWS, BLOCKS = 400, 20
FRICTION, BACKLASH = CoulombFriction.of(volts_V=0.3), Backlash.of(gap_rad=0.05, inertia_ratio=0.3)


@pytest.mark.parametrize(
    ("effects", "times"),
    [
        ((FRICTION,), [1.0]),
        ((BACKLASH,), [Backlash.unlikeness] * 2),
        ((BACKLASH, FRICTION), [Backlash.unlikeness] * 2 + [Backlash.unlikeness_beside]),
    ],
)
def test_errors_are_as_many_times_those_of_the_noise_as_the_laws_say(x64, effects, times):
    motor = linear_of(10.0, 40.0, effects=effects)
    free = free_of(motor)
    jacobian = 1e3 * np.random.default_rng(0).normal(size=(ROWS, len(free)))
    # Residuals of zero: nothing but the noise of each row is left.
    fitted = Fitted(motor, free, np.zeros(1), np.zeros(ROWS), jacobian, True)
    spread = covariance(fitted, np.arange(ROWS) * BLOCKS // ROWS)
    alone = np.linalg.inv(jacobian.T @ jacobian + np.diag(1 / fitted.layout.spread**2))
    expected = np.sqrt(np.diag(alone)) * [*[1.0] * OWN, *times]
    np.testing.assert_allclose(np.sqrt(np.diag(spread)), expected, rtol=1e-6)
    assert Backlash.unlikeness_beside > Backlash.unlikeness > 1


def test_what_shows_in_no_row_is_not_known(x64):
    motor = linear_of(10.0, 40.0, effects=(FRICTION, BACKLASH))
    free = free_of(motor)
    jacobian = 1e3 * np.random.default_rng(0).normal(size=(ROWS, len(free)))
    jacobian[:, OWN + 1] = 0.0
    fitted = Fitted(motor, free, np.zeros(1), np.zeros(ROWS), jacobian, True)
    errors = np.sqrt(np.diag(covariance(fitted, np.arange(ROWS) * BLOCKS // ROWS)))
    assert np.flatnonzero(np.isinf(errors)).tolist() == [OWN + 1]


def test_a_parameter_of_which_blocks_say_nothing_has_the_error_of_its_rows(x64):
    """However large: what shows next to nothing of it in any row must not overflow."""
    motor = linear_of(10.0, 40.0, effects=(FRICTION, BACKLASH))
    free = free_of(motor)
    jacobian = 1e3 * np.random.default_rng(0).normal(size=(ROWS, len(free)))
    jacobian[:, OWN] *= 1e-120
    fitted = Fitted(motor, free, np.zeros(1), np.zeros(ROWS), jacobian, True)
    spread = covariance(fitted, np.arange(ROWS) * BLOCKS // ROWS)
    assert np.isfinite(spread).all() and 1e115 < np.sqrt(spread[OWN, OWN]) < 1e120
    assert (np.square(spread[OWN] / np.sqrt(spread[OWN, OWN])) <= 1.001 * np.diag(spread)).all()
