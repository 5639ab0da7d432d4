"""Steps: the mean of N trials and its band by hand, and predictions that hold what they promise."""

import dataclasses

import numpy as np
import pytest
import scipy.stats
from rigs import COUNTS, FULL, PERIOD, SUPPLY, Rig, mean_speed, model, open_loop, recording, step, without

from jaxmotor.validation import validate
from jaxmotor.validation._response import Rows, measure

COUNT = 2 * np.pi / (COUNTS * PERIOD)


def trials(number, seed=0, volts=5.1, **rig):
    rng = np.random.default_rng(seed)
    return [open_loop(Rig(encoder=rng.uniform(), **rig), step(volts)) for _ in range(number)]


def shaken(segments, seed=1):
    """Trials that differ by more than their encoders."""
    rng = np.random.default_rng(seed)
    return [dataclasses.replace(s, count=s.count + rng.integers(-2, 3, len(s.count))) for s in segments]


def test_the_band_is_the_mean_and_students_t():
    segments = shaken(trials(10))
    (steps,) = validate(model(), recording(*segments)).steps
    speeds = np.array([np.diff(s.count) for s in segments])[:, 4:] * COUNT  # one row before the voltage is kept
    error = np.maximum(speeds.std(axis=0, ddof=1), COUNT / np.sqrt(6)) / np.sqrt(10)
    assert steps.trials == 10
    assert steps.amplitude_V == pytest.approx(176 / FULL * SUPPLY)
    np.testing.assert_allclose(steps.time_s, np.arange(4, 149) * PERIOD, atol=1e-12)
    np.testing.assert_allclose(steps.measured.mean, speeds.mean(axis=0), rtol=1e-12)
    half = scipy.stats.t(9).ppf(0.975) * error
    np.testing.assert_allclose(steps.measured.high - steps.measured.mean, half, rtol=1e-3)
    np.testing.assert_allclose(steps.measured.mean - steps.measured.low, half, rtol=1e-3)


def test_the_prediction_is_the_exact_response():
    (steps,) = validate(model(), recording(*trials(10))).steps
    np.testing.assert_allclose(steps.predicted.mean, mean_speed(step(5.1), 11.0, 40.0)[4:149], rtol=1e-9)
    assert (steps.predicted.low <= steps.predicted.high).all()


def test_the_right_motor_lies_in_the_band():
    groups = [validate(model(), recording(*trials(10, seed))).steps[0] for seed in range(12)]
    assert np.mean([group.inside_percent for group in groups]) >= 94
    assert np.mean([[group.rise_time_s.inside, group.final_speed_rad_s.inside] for group in groups]) >= 0.85


def test_rise_time_and_final_speed_are_those_of_the_motor():
    (steps,) = validate(model(), recording(*trials(10))).steps
    for value in (steps.rise_time_s.measured.value, steps.rise_time_s.predicted.value):
        assert value == pytest.approx(np.log(9) / 40, rel=0.06)
    for value in (steps.final_speed_rad_s.measured.value, steps.final_speed_rad_s.predicted.value):
        assert value == pytest.approx(11.0 * steps.amplitude_V, rel=3e-3)
    assert steps.rise_time_s.measured.low < steps.rise_time_s.measured.value < steps.rise_time_s.measured.high


def test_a_wrong_pole_shows_in_the_rise_and_a_wrong_gain_in_the_end():
    rec = recording(*trials(10))
    (slow,) = validate(model(pole=33.0), rec).steps
    assert slow.rise_time_s.inside is False
    assert slow.final_speed_rad_s.inside
    (weak,) = validate(model(gain=10.7), rec).steps
    assert weak.final_speed_rad_s.inside is False
    assert weak.inside_percent < 70


def test_predicted_intervals_hold_95_of_100_measured_means():
    rng = np.random.default_rng(5)
    errors = (0.05, 0.8)
    hits = []
    for seed in range(40):
        gain, pole = np.array([11.0, 40.0]) + rng.normal(size=2) * errors
        (steps,) = validate(model(errors=errors), recording(*trials(4, seed, gain=gain, pole=pole))).steps
        hits += [steps.rise_time_s.inside, steps.final_speed_rad_s.inside]
    assert 0.88 <= np.mean(hits) <= 0.999


def test_steps_of_other_voltages_and_other_starts_are_other_groups():
    up, down = trials(2), trials(2, volts=-3.0)
    moving = dataclasses.replace(up[0], at_rest=False)
    groups = validate(model(), recording(up[0], down[0], up[1], moving, down[1])).steps
    assert [group.segments for group in groups] == [(0, 2), (1, 4), (3,)]
    assert groups[1].final_speed_rad_s.measured.value < 0


def test_a_lost_tick_leaves_its_trial_in_the_group():
    segments = trials(4)
    (steps,) = validate(model(), recording(without(segments[0], [70]), *segments[1:])).steps
    assert steps.segments == (0, 1, 2, 3)
    speeds = np.array([np.diff(s.count) for s in segments])[:, 4:] * COUNT
    known = np.ones_like(speeds)
    known[0, [65, 66]] = 0  # ticks 69 and 70
    np.testing.assert_allclose(steps.measured.mean, (speeds * known).sum(0) / known.sum(0), rtol=1e-12)


def test_one_trial_has_the_encoders_band_and_no_interval():
    (steps,) = validate(model(), recording(*trials(1))).steps
    np.testing.assert_allclose(steps.measured.high - steps.measured.mean, 1.96 * COUNT / np.sqrt(6))
    assert np.isnan(steps.rise_time_s.measured.low)
    assert steps.rise_time_s.inside


def test_a_step_down_from_speed():
    duty = step(-3.0, before=0)
    segments = [open_loop(Rig(speed=40.0, encoder=c), duty, at_rest=False) for c in (0.1, 0.5, 0.8)]
    (steps,) = validate(model(), recording(*segments)).steps
    assert steps.rise_time_s.measured.value == pytest.approx(np.log(9) / 40, rel=0.1)
    assert steps.rise_time_s.inside
    assert steps.final_speed_rad_s.measured.value == pytest.approx(-33.0, rel=0.01)


def test_a_step_of_two_rows_is_no_harm():
    segments = trials(4)
    names = ("time_s", "volts", "tick", "duty", "count")
    short = dataclasses.replace(segments[0], **{name: getattr(segments[0], name)[:2] for name in names})
    groups = validate(model(), recording(*segments, short)).steps
    assert [group.segments for group in groups] == [(0, 1, 2, 3), (4,)]
    assert np.isnan(groups[1].rise_time_s.measured.value)


def test_a_plateau_that_was_lost_has_no_response():
    rows = Rows(0.005 * np.arange(40), np.zeros(40, bool), 0.005, 0.0)
    assert np.isnan(np.stack(measure(np.ones((3, 40)), rows))).all()
