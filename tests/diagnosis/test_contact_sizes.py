"""Sizes of a backlash, whose cost has many minima: near the truth from wherever the fit ended."""

import math

import numpy as np
import pytest
from hidden import draw

from jaxmotor.diagnosis._contact_sizes import smoothed
from jaxmotor.diagnosis._found import COARSE
from jaxmotor.diagnosis._free import linear_of
from jaxmotor.diagnosis._study import study_of
from jaxmotor.motor import EFFECTS

pytestmark = pytest.mark.usefixtures("plant_library", "x64")


@pytest.fixture(scope="module")
def hidden(plant_library):
    return draw(("backlash",), 133)


@pytest.mark.parametrize("wrong", [(1.15, 0.8), (0.85, 1.25)])
def test_sizes_do_not_hang_on_where_a_fit_ended(hidden, wrong):
    solver = study_of(hidden.recording, hidden.pole).solver
    true = np.array(list(hidden.truth["backlash"].values()))
    gap_rad, ratio = true * wrong
    effects = (EFFECTS["backlash"].of(gap_rad=gap_rad, inertia_ratio=ratio),)
    pole = hidden.pole * (1 + ratio) / (1 + true[1])
    fitted = solver.fit(linear_of(hidden.gain, pole, effects=effects), None, COARSE)
    found = smoothed(solver, fitted, COARSE)
    sizes = np.exp(found.free[4:6])
    assert np.abs(sizes / true - 1).max() < 0.08, (sizes / true, np.exp(fitted.free[4:6]) / true)
    assert math.isclose(float(found.motor.linear.gain), hidden.gain, rel_tol=1e-3)
    assert found.chi2 < 1.05
    places = found.speeds[len(solver.starts) :]
    assert np.abs(places).max() <= 1.0 and np.ptp(places) > 1.0
