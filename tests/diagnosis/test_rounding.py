"""What rounding alone makes of chi2: near one where the motion varies, more where it repeats itself."""

import numpy as np
import pytest
from testing.made import recording, sine, step

from jaxmotor.diagnosis import diagnose
from jaxmotor.diagnosis._free import linear_of
from jaxmotor.diagnosis._rounding import rounding_chi2
from jaxmotor.diagnosis._study import study_of

GAIN, POLE = 11.0, 40.0


def bound_and_chi2(runs, seed: int) -> tuple[float, float]:
    study = study_of(recording(seed, gain=GAIN, pole=POLE, runs=runs), POLE)
    fitted = study.solver.fit(linear_of(GAIN, POLE))
    return rounding_chi2(study.solver, fitted), fitted.chi2


@pytest.mark.usefixtures("x64")
@pytest.mark.parametrize("runs", [[sine(0.7), sine(1.9), sine(4.3)], [step(3.0)] * 8], ids=["sines", "equal steps"])
def test_true_motors_lie_below_the_bound(runs):
    found = [bound_and_chi2(runs, seed) for seed in range(12)]
    # One of forty may lie above.
    assert sum(chi2 > bound for bound, chi2 in found) <= 2
    assert all(chi2 > 0.5 * bound for bound, chi2 in found)


@pytest.mark.usefixtures("x64")
def test_the_bound_is_near_one_where_the_motion_varies():
    bound, _ = bound_and_chi2([sine(0.7), sine(1.9), sine(4.3)], 0)
    assert 0.9 < bound < 1.2


@pytest.mark.usefixtures("x64")
def test_friction_lies_above_it():
    runs = [step(3.0), step(-2.0), sine(1.9)]
    study = study_of(recording(0, gain=GAIN, pole=POLE, friction=0.3, runs=runs), POLE)
    fitted = study.solver.fit(linear_of(GAIN, POLE))
    assert fitted.chi2 > 10 * rounding_chi2(study.solver, fitted)


def test_equal_steps_of_a_linear_motor_are_explained():
    found = diagnose(recording(3, gain=GAIN, pole=POLE, runs=[step(4.0, 160)] * 6))
    assert found.undecided or found.verdict == "complete"
    assert not found.effects
    assert np.isfinite(found.held_out.drift_after)
