"""The blind recordings that the diagnosis is judged by: they hold what they say, and do not say what they hold."""

import sys
from pathlib import Path

import hidden
import numpy as np
import pytest
from hidden import OUTSIDE, SAME, SINGLE, Hidden, draw, draw_pair, plant_file, sizes
from testing.hidden_plans import LONGEST_TICKS, draw_plan, draw_rig
from testing.made import motion
from testing.plant import Plant

from jaxmotor.motor.effects import EFFECTS, parameters
from jaxmotor.recording import check, read, to_text

FIRMWARE = Path(__file__).parents[2] / "firmware"

RANGES = {
    # share of the supply, of the top speed, or the number itself
    "coulomb_friction": (0.02, 0.08),
    "stiction": (0.02, 0.05),
    "dead_zone": (0.02, 0.07),
    "input_threshold": (0.02, 0.07),
    "voltage_offset": (0.01, 0.03),
    "load_torque": (0.01, 0.03),
    "voltage_saturation": (0.78, 0.92),
    "current_limit": (0.45, 0.7),
    "cogging": (0.025, 0.06),
    "direction_asymmetry": (0.02, 0.07),
    "supply_sag": (0.12, 0.35),
    "electrical_pole": (2e-3, 6e-3),
    "sensor_lag": (3e-3, 10e-3),
    "encoder_eccentricity": (0.015, 0.05),
    "missed_counts": (0.03, 0.1),
    "winding_heating": (0.6, 2.5),
    "shaft_compliance": (0.2, 0.6),
    "backlash": (0.02, 0.08),
    "late_load": (0.02, 0.06),
    "outside_torque": (0.02, 0.05),
    "wandering_torque": (0.02, 0.05),
}
SIZE = {"shaft_compliance": "inertia_ratio", "late_load": "volts_V", "outside_torque": "volts_V"}

pytestmark = pytest.mark.usefixtures("plant_library")


def off_linear(drawn: Hidden) -> np.ndarray:
    """[counts] by which each segment's first count is off the linear motor's, driven by all that was driven."""
    recording = drawn.recording
    period, counts = recording.period_s, recording.counts_per_rev
    assert period is not None and counts is not None
    starts = [round(segment.start_s / period) for segment in recording.segments]
    volts = np.zeros(starts[-1] + len(recording.segments[-1]))
    for start, segment in zip(starts, recording.segments, strict=True):
        volts[start : start + len(segment)] = segment.volts
    turned = motion(volts, drawn.gain, drawn.pole, period)[1]
    angle = np.concatenate([[0.0], np.cumsum(turned)])[starts]
    first = [segment.count[0] for segment in recording.segments if segment.count is not None]
    return np.array(first) - angle * counts / (2 * np.pi)


@pytest.mark.parametrize("seed", range(3))
def test_nothing_hidden_is_a_linear_motor_through_all_rests(seed):
    drawn = draw((), seed)
    assert drawn.truth == {} and check(drawn.recording) == ()
    assert all(segment.at_rest for segment in drawn.recording.segments)
    assert np.abs(off_linear(drawn)).max() < 1.1  # the counter starts anywhere within a count


@pytest.mark.parametrize("kinds", [("coast_drive",), ("coulomb_friction", "transport_delay"), ("late_load",)])
def test_what_is_hidden_is_in_the_counts(kinds):
    drawn = draw(kinds, 3)
    assert set(drawn.truth) == set(kinds) and check(drawn.recording) == ()
    assert np.abs(off_linear(drawn)).max() > 20


def test_the_same_draw_twice():
    first, again, other = draw(("cogging",), 5), draw(("cogging",), 5), draw(("cogging",), 6)
    assert to_text(first.recording) == to_text(again.recording) and first.truth == again.truth
    assert to_text(first.recording) != to_text(other.recording)
    weaker = draw(("cogging",), 5, scale=0.1)
    assert weaker.gain == first.gain
    assert weaker.truth["cogging"]["volts_V"] == pytest.approx(0.1 * first.truth["cogging"]["volts_V"])


def test_a_shaft_that_keeps_turning_is_not_at_rest():
    drawn = draw(("voltage_offset",), 1)
    assert not any(segment.at_rest for segment in drawn.recording.segments)


@pytest.mark.parametrize("kind", RANGES)
def test_sizes_at_scale_one(kind):
    low, high = RANGES[kind]
    for seed in range(30):
        rig = draw_rig(np.random.default_rng(seed))
        found = sizes(kind, rig, 80.0, np.random.default_rng(seed), 1.0)
        key = SIZE.get(kind, next(iter(found)))
        assert low <= abs(found[key]) / (rig.supply_V if key == "volts_V" else 1) <= high


@pytest.mark.parametrize("kind", ["voltage_saturation", "current_limit"])
def test_a_weaker_limit_is_higher(kind):
    rig = draw_rig(np.random.default_rng(0))
    full, weak = (sizes(kind, rig, 80.0, np.random.default_rng(0), scale)["volts_V"] for scale in (1.0, 0.1))
    assert rig.supply_V - weak == pytest.approx(0.1 * (rig.supply_V - full))


@pytest.mark.parametrize("kind", [*SINGLE, *OUTSIDE])
def test_the_plant_takes_it_and_the_vocabulary_names_its_parameters(kind):
    rig = draw_rig(np.random.default_rng(1))
    truth = {kind: sizes(kind, rig, 80.0, np.random.default_rng(2), 1.0)}
    with Plant(plant_file(rig, truth)) as plant:
        assert plant.linear.gain == pytest.approx(rig.gain) and plant.linear.pole == pytest.approx(rig.pole)
    if kind in EFFECTS:
        needed = {key for key, about in parameters(EFFECTS[kind]).items() if "absent" not in about}
        assert set(truth[kind]) == needed


@pytest.mark.parametrize("seed", range(12))
def test_plans_are_rich(seed):
    rng = np.random.default_rng(seed)
    rig = draw_rig(rng)
    plan = draw_plan(rig, rng)
    ticks = sum(experiment.ticks for experiment in plan)
    assert 58 < ticks * rig.period_s < 82 and ticks < LONGEST_TICKS + 20
    sines = [experiment.parameters for experiment in plan if experiment.kind == "sine"]
    assert len({sine["amplitude_V"] for sine in sines}) == 2 and 12 <= len(sines) <= 18
    duties = [experiment.drive for experiment in plan if isinstance(experiment.drive, np.ndarray)]
    assert {min(map(np.min, duties)), max(map(np.max, duties))} == {-rig.full_scale, rig.full_scale}
    assert {"step", "ramp", "closed_loop"} <= {experiment.kind for experiment in plan}


def test_pairs_are_two_things(monkeypatch):
    pairs: list[set[str]] = []
    monkeypatch.setattr(hidden, "draw", lambda kinds, seed: pairs.append(set(kinds)))
    for seed in range(400):
        draw_pair(seed)
    assert all(len(pair) == 2 and pair not in SAME for pair in pairs)
    assert set.union(*pairs) == set(SINGLE)


@pytest.mark.parametrize("kinds", [("rust",), ("cogging", "cogging"), ("cogging", "late_load"), SINGLE[:3]])
def test_what_cannot_be_drawn(kinds):
    with pytest.raises(ValueError, match=kinds[0]):
        draw(kinds, 0)


def test_the_file_does_not_tell(tmp_path, monkeypatch):
    path = tmp_path / "blind.csv"
    monkeypatch.setattr(sys, "argv", ["hidden.py", "coast_drive+coulomb_friction", "2", str(path)])
    hidden.main()
    assert not [kind for kind in (*SINGLE, *OUTSIDE) if kind in path.read_text()]
    found, expected = read(path), draw(("coulomb_friction", "coast_drive"), 2).recording
    assert found.drive == draw((), 2).recording.drive and found.header == {"motor": "drawn at random"}
    for given, again in zip(expected.segments, found.segments, strict=True):
        np.testing.assert_array_equal(given.count, again.count)
