"""Blind tests, a seeded part of `benchmarks/blind.py`: an effect missed or invented fails."""

import blind
import pytest

pytestmark = pytest.mark.usefixtures("plant_library")
SINGLE = (
    "coast_drive",
    "cogging",
    "dead_zone",
    "electrical_pole",
    "encoder_eccentricity",
    "input_threshold",
    "missed_counts",
    "shaft_compliance",
    "stiction",
    "supply_sag",
    "transport_delay",
    "winding_heating",
)
LIKE_COGGING = ("encoder_eccentricity", "coulomb_friction", "stiction", "transport_delay", "shaft_compliance")


@pytest.mark.parametrize("seed", [100, 101])
def test_nothing_is_found_where_nothing_is_hidden(seed):
    outcome = blind.test("none", seed)
    assert outcome.right and not outcome.named, outcome
    assert max(map(abs, outcome.linear_z)) < 4, outcome


@pytest.mark.parametrize("kind", SINGLE)
def test_one_effect_is_named_with_its_size(kind):
    outcome = blind.test(kind, 100)
    assert outcome.right and outcome.verdict == "extended", outcome
    assert outcome.chi2_after < 1.1, outcome
    assert all(error < 10 for error in outcome.errors_percent), outcome
    assert all(abs(z) < 5 for z in (*outcome.z, *outcome.linear_z)), outcome


def test_a_pole_that_depends_on_which_lag_it_is_says_so():
    """A filtered log, for which a lag of the current does as well, with a pole 6 % lower."""
    outcome = blind.test("sensor_lag", 92)
    assert outcome.right and outcome.chi2_after < 1.05, outcome
    assert all(abs(z) < 3 for z in outcome.linear_z), outcome


def test_backlash_is_not_caught_beside_the_best_fit():
    outcome = blind.test("backlash", 134)
    assert outcome.right and outcome.chi2_after < 1.05, outcome
    assert all(error < 10 for error in outcome.errors_percent), outcome


@pytest.mark.parametrize("seed", [100, 101])
def test_two_effects_are_named_and_nothing_else(seed):
    outcome = blind.test("pair", seed)
    assert outcome.right and outcome.chi2_after < 1.15, outcome


@pytest.mark.parametrize("kind", ["late_load", "outside_torque"])
def test_what_no_effect_explains_gets_no_name(kind):
    outcome = blind.test(kind, 100)
    assert outcome.verdict == "unexplained" and not outcome.named, outcome


def test_cogging_in_a_filtered_log_is_where_the_shaft_was():
    outcome = blind.test("pair", 169, effects=(*blind.pair_of(169), *LIKE_COGGING))
    assert outcome.right, outcome


@pytest.mark.usefixtures("emulator")
def test_friction_with_drag_is_no_stiction():
    """Whose three parameters take up most of both."""
    outcome = blind.test("pair", 304, board=True)
    assert outcome.right and outcome.chi2_after < 1.05, outcome


@pytest.mark.usefixtures("emulator")
@pytest.mark.parametrize("kind", ["none", "transport_delay"])
def test_recordings_of_the_firmware(kind):
    """Some of its ramps follow each other without a rest: what was applied before one still acts in it."""
    outcome = blind.test(kind, 2, board=True)
    assert outcome.right and outcome.verdict != "unexplained", outcome
    assert outcome.chi2_after < 1.05, outcome
    assert all(abs(z) < 4 for z in (*outcome.z, *outcome.linear_z)), outcome
