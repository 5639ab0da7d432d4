"""A diagnosis is not complete where laws that the input cannot show would move the motor."""

import json

import numpy as np
from open_hypotheses import INPUTS, case

from jaxmotor.cli._story import diagnosis_text
from jaxmotor.diagnosis import diagnose, to_json
from jaxmotor.diagnosis._diagnose import _of_linear
from jaxmotor.diagnosis._study import study_of
from jaxmotor.estimate import SHOWN, identify
from jaxmotor.recording import bundled

STEPS, PRBS, _ = INPUTS


def test_a_prbs_of_one_amplitude_leaves_a_dead_zone_open():
    """The linear motor leaves nothing over, but it is not complete."""
    made = case(np.random.default_rng([11, 0, 1]), PRBS, "dead zone")
    found = diagnose(made.recording)
    assert found.verdict == "unexplained" and found.undecided and not found.effects and not found.learned
    assert {one.name for one in found.open_hypotheses} == {"dead zone"}
    assert found.allowed is not None and found.allowed.gain[0] < made.gain < found.allowed.gain[1]
    assert abs(float(found.motor.linear.gain) - made.gain) > 5 * found.standard_error["gain_rad_s_V"]
    told = diagnosis_text(found)
    assert "the residual is no more than noise, but there may be a dead zone or nothing" in told.replace(
        "\n" + 19 * " ", " "
    )
    assert "with what the input leaves open: gain" in told and "add steps of a second height" in told
    content = json.loads(json.dumps(to_json(found)))
    assert content["undecided"] and content["open_hypotheses"][0]["decide"] == "add steps of a second height"
    assert content["looks_like"]["coordinate"] == "voltage"


def test_beside_an_effect_that_is_named():
    """Steps of one height show a delay, but not the friction beside it."""
    made = case(np.random.default_rng([11, 0, 0]), STEPS, "friction + delay")
    found = diagnose(made.recording)
    assert [one.name for one in found.effects] == ["transport_delay"]
    assert {"friction", "dead zone"} <= {one.name for one in found.open_hypotheses}
    assert "delay" not in {one.name for one in found.open_hypotheses}
    assert found.allowed is not None and found.allowed.gain[0] < made.gain < found.allowed.gain[1]
    assert found.allowed.pole[0] < made.pole < found.allowed.pole[1]
    assert sum("the gain would be" in note for note in found.notes) == len(found.open_hypotheses)


def test_nothing_is_open_where_the_recording_decides():
    found = diagnose(bundled("linear"))
    assert not found.open_hypotheses and not found.undecided
    assert to_json(found)["open_hypotheses"] == []


def test_what_the_linear_motor_lacks_to_first_order_is_not_repeated(x64):
    """A diagnosis that names nothing must not name a law in its notes."""
    recording = bundled("paper")
    fit = identify(recording)
    kept = _of_linear(fit, recording, study_of(recording, float(fit.motor.pole)))
    [left_out] = set(fit.notes) - set(kept)
    assert left_out.startswith(SHOWN)
