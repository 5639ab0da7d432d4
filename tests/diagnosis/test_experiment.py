"""Which experiment to record next, for logs of one segment, too."""

import numpy as np
import pytest
from testing.made import recording

from jaxmotor.diagnosis._experiment import experiment
from jaxmotor.diagnosis._free import linear_of, with_effect
from jaxmotor.diagnosis._study import study_of
from jaxmotor.motor.effects import CoulombFriction, VoltageOffset

GAIN, POLE, FRICTION_V = 11.0, 40.0, 0.3
ONE_WAY = [("step", {}, np.repeat([0.0, 2.0, 4.0, 3.0], 100))]


@pytest.mark.usefixtures("x64")
def test_after_one_segment_in_one_direction_all_experiments_are_tried():
    """Friction and an offset are the same there. They part near rest: under a low voltage, or where the shaft turns
    back."""
    made = recording(5, gain=GAIN, pole=POLE, friction=FRICTION_V, runs=ONE_WAY)
    study = study_of(made, POLE)
    assert study.trial.time.shape[0] == 1
    linear = linear_of(GAIN, POLE)
    friction = study.solver.fit(with_effect(linear, CoulombFriction.of(volts_V=0.2)))
    offset = study.solver.fit(with_effect(linear, VoltageOffset.of(volts_V=-0.2)))
    names = ("coulomb_friction", "voltage_offset")
    found = experiment(study.solver, names, friction.motor, offset, made)
    assert found.plan is not None and found.chi2_excess > 1
    assert "0.59 V tells coulomb_friction from voltage_offset" in found.text
    same = experiment(study.solver, names, friction.motor, friction, made)
    assert same.plan is None and "no ramp or sine of 2.6 s tells" in same.text
