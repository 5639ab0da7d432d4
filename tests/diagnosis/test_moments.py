"""When a step in time is sought: while voltages are applied, and never where it would be the motor's gain."""

import jax
import numpy as np
import pytest
from testing.made import PERIOD, recording, step

from jaxmotor.diagnosis._free import linear_of
from jaxmotor.diagnosis._moments import placed, profile
from jaxmotor.diagnosis._solve import square_of
from jaxmotor.diagnosis._study import study_of
from jaxmotor.motor.effects._disturbance import DriveStep, LoadStep

pytestmark = pytest.mark.usefixtures("x64")
GAIN, POLE, FRICTION_V = 11.0, 40.0, 0.4
REST, DRIVEN = 200, 400
"""Ticks before and after a step, and of it."""


def resting(height):
    """A step with a rest before it and after it."""
    kind, about, volts = step(height, DRIVEN)
    return kind, about, np.concatenate([np.zeros(REST), volts, np.zeros(REST)])


@pytest.fixture(scope="module")
def base():
    """A log with friction and a linear motor fitted to it, which leaves much."""
    with jax.enable_x64(True):
        study = study_of(recording(1, GAIN, POLE, friction=FRICTION_V, runs=[resting(5.0), resting(-3.0)]), POLE)
        return study.solver, study.solver.fit(linear_of(GAIN, POLE))


def test_a_rig_knows_when_it_was_driven(base):
    solver, _ = base
    first, last = solver.rig.driven_s
    assert first == pytest.approx((REST + 1) * PERIOD, abs=1e-9)
    # The second run begins half a second after the first has ended.
    begins_s = 0.5 + (2 * REST + DRIVEN) * PERIOD
    assert last == pytest.approx(begins_s + (REST + DRIVEN - 1) * PERIOD, abs=1e-9)


@pytest.mark.parametrize("law", [DriveStep, LoadStep])
def test_a_step_is_sought_while_voltages_are_applied(base, law):
    solver, fitted = base
    [start] = law.starts(solver.rig)
    first, last = solver.rig.driven_s
    assert first <= placed(solver, fitted, start, solver.rig).moment_s <= last


def test_a_change_of_the_drive_from_the_first_voltage_on_is_the_gain(base):
    solver, fitted = base
    [start] = DriveStep.starts(solver.rig)
    first, last = solver.rig.driven_s
    early, middle = profile(solver, fitted, start, np.array([first - PERIOD, 0.5 * (first + last)]))
    # The motor's own columns are gone from what it leaves.
    assert early == pytest.approx(square_of(fitted.residual), rel=1e-3)
    assert middle < 0.98 * early
