"""Names are told as surely as what stays unexplained allows; else their family is."""

import dataclasses

import numpy as np
import pytest
from _calibration import by_unexplained, logistic
from diagnosed import of
from other_world import Certain
from test_story import found_effect

from jaxmotor.cli._story import diagnosis_text
from jaxmotor.diagnosis import Alternative, to_json
from jaxmotor.diagnosis._certainty import OF_FAMILY, OF_NAME, Logistic, of_name
from jaxmotor.diagnosis._found import NAMED, Explained, Found, Named
from jaxmotor.diagnosis._free import linear_of, with_effect
from jaxmotor.diagnosis._held_out import hold_out
from jaxmotor.diagnosis._study import study_of
from jaxmotor.diagnosis._weighed import judged_by
from jaxmotor.motor.effects import EFFECTS, LEARNED, CoulombFriction, vocabulary
from jaxmotor.text import family_of, odds
from jaxmotor.text._effects import FAMILIES


def unsure(name, probability=0.3, of_family=0.9):
    """An effect of a motor that leaves something unexplained."""
    found = found_effect(name, inseparable=False)
    return dataclasses.replace(
        found,
        probability=probability,
        family_probability=probability,
        name_probability=probability,
        of_family=of_family,
    )


def imitated(*effects):
    return dataclasses.replace(of("friction")[1], effects=effects, verdict="unexplained")


@pytest.mark.parametrize("sure", [OF_NAME, OF_FAMILY])
def test_what_explains_all_is_sure_and_certainty_falls_with_what_is_left(sure):
    left = np.geomspace(1e-6, 1, 200)
    told = np.array([sure(share) for share in left])
    assert sure(0.0) == 1.0 and sure(sure.half) == pytest.approx(0.5)
    assert np.all(np.diff(told) < 0) and 0 < told[-1] < told[0] <= 1


def test_a_family_is_never_less_sure_than_a_name():
    assert all(OF_FAMILY(share) > OF_NAME(share) - 1e-4 for share in np.geomspace(1e-6, 1, 200))


def test_the_regression_finds_the_law_that_drew_the_answers():
    rng = np.random.default_rng(0)
    truth = Logistic(0.03, 0.9)
    left = np.geomspace(1e-4, 1, 4000)
    half, power = logistic([*left, 0.0], [*(rng.random(len(left)) < [truth(share) for share in left]), True])
    assert half == pytest.approx(truth.half, rel=0.15) and power == pytest.approx(truth.power, rel=0.1)
    table = by_unexplained([Certain(0.0, True, True), Certain(0.05, False, True), Certain(1.0, False, False)])
    assert [row[1:] for row in table] == [(1, 1, 1), (0, 0, 0), (0, 0, 0), (0, 1, 1), (0, 0, 1)]


def test_every_known_effect_has_a_family_with_words():
    own = {name: effect.family for name, effect in vocabulary().items() if name in EFFECTS and name not in LEARNED}
    lonely = {name for name, family in own.items() if not family}
    assert set(own.values()) - {""} == set(FAMILIES)
    assert lonely <= {"load_step", "drive_step", "periodic_torque", "wandering_torque"}, lonely


def test_below_the_stated_probability_the_family_is_told():
    told = diagnosis_text(imitated(unsure("sensor_lag")))
    assert "a lag (probability 90 %), most like sensor_lag (30 %):" in " ".join(told.split())
    assert "sensor_lag (probability" not in told and "if it is sensor_lag: " in told
    less = diagnosis_text(imitated(dataclasses.replace(unsure("sensor_lag"), probability=0.02)))
    assert "a lag (probability 90 %), most like sensor_lag, which itself has a probability of 2 %:" in " ".join(
        less.split()
    )
    sure = dataclasses.replace(
        unsure("sensor_lag"), probability=NAMED, family_probability=NAMED, name_probability=NAMED
    )
    assert "sensor_lag (probability 90 %):" in " ".join(diagnosis_text(imitated(sure)).split())


def test_what_has_nothing_in_common_is_told_as_a_choice():
    """An effect of which only it and effects of other families are sure together."""
    alternatives = (Alternative("backlash", 0.0, True), Alternative("cogging", 0.01, True))
    one = dataclasses.replace(
        unsure("input_threshold", 0.5), alternatives=alternatives, name_probability=0.95, family_probability=0.95
    )
    choice = imitated(dataclasses.replace(one, kin_probability=0.55))
    told = " ".join(diagnosis_text(choice).split())
    assert "input_threshold, backlash or cogging: which of them, this recording does not tell (together 95 %)" in told
    assert "if it is input_threshold: voltages below" in told and "if it is input_threshold: Keep commands" in told
    assert "perhaps input_threshold" in str(choice)
    [effect] = to_json(choice)["effects"]
    assert effect["named"] and effect["one_of_several"]
    # Where its family is as sure as a name, it is a cause.
    cause = imitated(dataclasses.replace(one, kin_probability=0.92))
    told = " ".join(diagnosis_text(cause).split())
    assert "input_threshold (probability 50 %, with the alternatives that fit as well 95 %): voltages" in told
    assert " input_threshold: Keep commands" in told and "if it is input_threshold" not in told
    assert not to_json(cause)["effects"][0]["one_of_several"]


def test_a_family_is_told_once():
    told = " ".join(diagnosis_text(imitated(unsure("coulomb_friction"), unsure("stiction"), unsure("cogging"))).split())
    first, second = told.index("most like coulomb_friction"), told.index("most like stiction")
    assert told.count("friction or a loss like it (") == 1 and first < second
    assert "another one of that family (probability" in told[first:second]
    assert "another one" not in told[second:]


def test_what_is_not_likely_is_no_cause():
    rare = dataclasses.replace(unsure("sensor_lag"), probability=0.2, of_family=0.3, name_probability=0.2)
    told = " ".join(diagnosis_text(imitated(rare)).split())
    assert "no cause that is likely; the motor fits better with sensor_lag (probability 20 %): " in told
    assert "if it is sensor_lag" not in told
    doubted = dataclasses.replace(rare, unexplained_share=0.1, held_out_share=0.24)
    told = " ".join(diagnosis_text(imitated(doubted)).split())
    assert "no cause that is likely while 24 % of what it should explain stays unexplained; the motor fits" in told
    other = dataclasses.replace(rare, effect=EFFECTS["load_torque"].start(), probability=0.001)
    told = " ".join(diagnosis_text(imitated(rare, unsure("coulomb_friction"), other)).split())
    assert told.count("cause that is likely") == 1
    assert told.index("friction or a loss") < told.index("no further cause that is likely")
    assert "; and with load_torque (probability < 1 %): " in told


def test_the_bars_of_a_family_add_up():
    shares = dict(odds(unsure("coulomb_friction", 0.2, 0.7)))
    phrase = family_of(EFFECTS["coulomb_friction"].start())
    assert shares == pytest.approx({"Coulomb friction": 0.2, f"{phrase}, of another kind": 0.5, "none of these": 0.3})


def test_names_and_families_are_in_the_json():
    found = of("friction")[1]
    content = to_json(found)
    [effect] = content["effects"]
    assert content["format"] == 2 and effect["named"] and effect["family"] == "friction"
    assert content["families"]["friction"] == effect["of_family_probability"] > 0.99
    assert effect["unexplained_share"] == 0.0 and effect["name_probability"] >= NAMED
    assert list(content["families"].values()) == sorted(content["families"].values(), reverse=True)
    assert not to_json(imitated(unsure("sensor_lag")))["effects"][0]["named"]


def test_a_name_is_no_surer_than_rows_that_were_held_out_let_it_be():
    assert of_name(0.01, 0.0) == OF_NAME(0.01)
    assert of_name(0.01, 0.2) == OF_NAME(0.2) < 0.05
    assert of_name(0.0, 0.0) == 1.0


@pytest.mark.usefixtures("x64")
def test_effects_that_carry_over_worse_than_they_fit_are_judged_by_that():
    """Both motors explain what they were fitted to; nothing changes where the noise is all that is left."""
    made, found = of("friction")
    study = study_of(made, float(found.linear.linear.pole))
    linear = study.solver.fit(linear_of(float(found.linear.linear.gain), float(found.linear.linear.pole)))
    fitted = study.solver.fit(with_effect(linear.motor, CoulombFriction.of(volts_V=0.3)))
    named = Named("coulomb_friction", (), 1.0, 1.0, frozenset(), 0.01)
    sure, limits = Found(linear, fitted, (named,), {}, {}), Explained(linear.chi2, True)
    held = hold_out(study, sure)
    assert judged_by(held, sure, limits).named[0].held_out_share == 0.0
    estimated = dataclasses.replace(limits, noise_known=False)
    assert judged_by(held, sure, estimated) is sure
    # The friction of another motor: held-out rows say what stays.
    worse = dataclasses.replace(held, after=dataclasses.replace(held.after, drift=0.5 * held.before.drift))
    limit = limits.enough(fitted) + 2 * np.sqrt(2 / len(held.test.cells))
    share = (0.5 * held.before.drift - limit) / (held.before.drift - 1)
    for unexplained in (0.01, 0.0):
        judged = judged_by(worse, dataclasses.replace(sure, unexplained_share=unexplained), limits)
        [one] = judged.named
        assert one.held_out_share == pytest.approx(share) == judged.held_out_share and one.unexplained_share == 0.01
