"""Two laws in one motor act on each other as they do in the plant, which is integrated finely."""

import blind
import pytest
from hidden import draw

from jaxmotor.diagnosis._found import NEARLY
from jaxmotor.diagnosis._free import linear_of, with_effect
from jaxmotor.diagnosis._score_test import candidates, columns_beside, effect_columns
from jaxmotor.diagnosis._study import study_of
from jaxmotor.diagnosis._trial import rig_of
from jaxmotor.motor.effects import EFFECTS

pytestmark = pytest.mark.usefixtures("plant_library")


@pytest.mark.parametrize(
    "kinds",
    [
        ("direction_asymmetry", "supply_sag"),
        ("supply_sag", "winding_heating"),
        ("transport_delay", "winding_heating"),
        ("sensor_lag", "winding_heating"),
        ("coast_drive", "winding_heating"),
    ],
    ids="+".join,
)
def test_the_hidden_motor_explains_its_recording(kinds):
    assert blind.truth_drift(draw(kinds, 3)) < 1.1


def test_a_law_of_the_winding_shows_beside_another_one(x64):
    """Where a bridge lets the motor coast there is another current to heat the winding: beside the linear motor the
    score of heating promises next to nothing."""
    recording = draw(("coast_drive", "winding_heating"), 3).recording
    study = study_of(recording, 40.0)
    solver, rig, heating = study.solver, rig_of(recording, study.trial), [EFFECTS["winding_heating"]]
    [coast] = EFFECTS["coast_drive"].starts(rig)
    base = solver.fit(with_effect(solver.fit(linear_of(10.0, 40.0)).motor, coast))
    assert not columns_beside(solver, base, rig, heating), "it takes a program of its own"
    columns = effect_columns(solver, base, rig, heating), columns_beside(solver, base, rig, heating, closely=True)
    bare, beside = (candidates(base, one)["winding_heating"][0] for one in columns)
    assert beside.chi2 < 0.02 * base.chi2 < bare.chi2
    assert solver.fit(beside.motor, base).chi2 < NEARLY
