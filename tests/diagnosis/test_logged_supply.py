"""A supply that sags and drifts, logged, is a known input: a seeded part of `benchmarks/supply.py`."""

import numpy as np
import pytest
from supply import draw, drive, errors, recording

from jaxmotor import diagnose
from jaxmotor.diagnosis._study import study_of
from jaxmotor.diagnosis._trial import rig_of
from jaxmotor.motor.effects import EFFECTS

pytestmark = pytest.mark.usefixtures("plant_library")


def test_gain_and_pole_are_as_exact_as_with_a_stiff_supply():
    drawn = draw(0)
    driven = drive(drawn, "both")
    stiff = np.abs(errors(drawn, recording(drawn, drive(drawn, "stiff"), "nothing")))
    unknown = np.abs(errors(drawn, recording(drawn, driven, "nothing")))
    rows = np.abs(errors(drawn, recording(drawn, driven, "each row")))
    assert (unknown > 1.0).all()
    assert (rows < stiff + 0.03).all()


def test_a_logged_sag_is_no_effect_of_the_motor():
    drawn = draw(1)
    found = diagnose(recording(drawn, drive(drawn, "both"), "each row"))
    assert found.verdict == "complete" and not found.effects


@pytest.mark.parametrize("log, sought", [("nothing", True), ("each row", False), ("board", True)])
def test_sag_and_drift_are_sought_only_where_the_supply_was_not_logged(log, sought):
    drawn = draw(1)
    made = recording(drawn, drive(drawn, "both"), log)
    rig = rig_of(made, study_of(made, drawn.rig.pole).trial)
    for name in ("supply_sag", "supply_drift"):
        assert bool(EFFECTS[name].starts(rig)) == sought
    assert EFFECTS["coast_drive"].starts(rig)
    assert not EFFECTS["coast_drive"].starts(rig._replace(supply_known=False))
    assert EFFECTS["coast_drive"].starts(rig._replace(supply_known=False, volts_V=(4.95,)))
