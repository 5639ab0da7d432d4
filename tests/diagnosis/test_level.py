"""A curve over the speed holds nothing of a straight line and of friction, unless the recording says so."""

import dataclasses

import jax.numpy as jnp
import numpy as np
import pytest
from test_search import FAST_RAD_S, FRICTION_V, GAIN, POLE, noisy_log

from jaxmotor import diagnose
from jaxmotor.diagnosis._errors import covariance
from jaxmotor.diagnosis._free import linear_of, with_effect
from jaxmotor.diagnosis._level import is_as_likely, ties_of, with_convention
from jaxmotor.diagnosis._study import study_of
from jaxmotor.diagnosis._trial import rig_of
from jaxmotor.motor.effects import LEARNED, CoulombFriction

CUBIC_V = 6.0


@pytest.fixture(scope="module")
def made():
    """A third of its rows are slower than 20 rad/s, a seventh than 5: what happens near rest tells friction from a
    curve."""
    return noisy_log(6, FRICTION_V, cubic_V=CUBIC_V, noise=0.001)


@pytest.fixture
def free(made, x64):
    study = study_of(made, POLE)
    curve = LEARNED["torque_over_speed"].starts(rig_of(made, study.trial))[0]
    motor = with_effect(with_effect(linear_of(GAIN, POLE), CoulombFriction.of(volts_V=FRICTION_V)), curve)
    return study, study.solver.fit(motor, tolerance=1e-6)


def parts_of_curve(speed, motor):
    """Of a straight line and of friction in the curve [V s/rad, V]."""
    volts = np.asarray(motor.effects[1].adds(jnp.asarray(speed)))
    return np.linalg.lstsq(np.stack([speed, np.sign(speed)], axis=1), volts, rcond=None)[0]


def test_friction_that_shows_near_rest_is_no_curves(made):
    found = diagnose(made, effects=["coulomb_friction", "torque_over_speed"])
    effects = {one.name: one for one in found.effects}
    assert set(effects) == {"coulomb_friction", "torque_over_speed"} and found.verdict == "extended"
    assert effects["coulomb_friction"].parameters["volts_V"] == pytest.approx(FRICTION_V, rel=0.02)


def test_a_tied_curve_has_no_such_parts_and_here_that_is_not_as_likely(made, free):
    study, fitted = free
    tied = study.solver.fit(fitted.motor, fitted, 1e-6, ties=ties_of(study.trial, fitted))
    speed = made.segments[0].speed_rad_s
    assert np.abs(parts_of_curve(speed, tied.motor) * [FAST_RAD_S, 1.0]).max() < 5e-3
    assert np.abs(parts_of_curve(speed, fitted.motor) * [FAST_RAD_S, 1.0]).max() > 0.1
    assert is_as_likely(fitted, fitted) and not is_as_likely(tied, fitted)
    # A fit that stopped where it began leaves no more, but holds nothing.
    assert not is_as_likely(dataclasses.replace(fitted, ties=tied.ties), fitted)


def test_of_a_tied_curve_the_errors_hold_what_another_choice_of_speeds_would_have_made(free):
    study, fitted = free
    tied = study.solver.fit(fitted.motor, fitted, 1e-6, ties=ties_of(study.trial, fitted))
    even = study.solver.fit(tied.motor, tied, 1e-4, ties=ties_of(study.trial, tied, even=True))
    plain, own = (covariance(one, study.solver.block) for one in (fitted, tied))
    assert with_convention(plain, study.solver, fitted) is plain
    wider = with_convention(own, study.solver, tied)
    np.testing.assert_allclose(np.diag(wider - own), np.square(even.free - tied.free), rtol=1e-3, atol=1e-12)
    assert wider[0, 0] > 1.01 * own[0, 0] > 0
