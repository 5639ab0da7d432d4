"""Open loop: against a recursion in numpy."""

import dataclasses

import numpy as np
import pytest
from rigs import COUNTS, PERIOD, Rig, mean_speed, model, open_loop, recording, step, without

from jaxmotor.validation import validate


def prbs(ticks=150, seed=3, volts=150):
    return np.repeat(np.random.default_rng(seed).choice([-volts, volts], ticks // 6), 6)


def test_scores_are_those_of_a_recursion_in_numpy():
    duty = prbs()
    segment = open_loop(Rig(gain=11.3, pole=37.0), duty, kind="prbs")
    v = validate(model(offset_V=0.05), recording(segment))
    # The row before the first voltage is kept, and the voltage offset acts in it; here there is none.
    simulated = mean_speed(duty, 11.0, 40.0, offset_V=0.05)[:-1]
    turned = np.diff(segment.count)
    measured = turned * 2 * np.pi / (COUNTS * PERIOD)
    off = measured - simulated
    score = v.open_loop.pooled
    assert score.samples == 149
    assert score.rmse_rad_s == pytest.approx(np.sqrt((off**2).mean()), rel=1e-9)
    counts = off * COUNTS * PERIOD / (2 * np.pi)
    assert score.rmse_counts == pytest.approx(np.sqrt((counts**2).mean()), rel=1e-9)
    part = np.mod(turned - counts, 1)
    assert score.chi2_per_sample == pytest.approx((counts**2).mean() / (part * (1 - part)).mean(), rel=1e-6)
    spread = np.linalg.norm(measured - measured.mean())
    assert score.fit_percent == pytest.approx(100 * (1 - np.linalg.norm(off) / spread), rel=1e-9)
    assert v.open_loop.segments == {0: score}


def test_pooled_is_over_all_samples():
    rec = recording(
        *(open_loop(Rig(gain=11.2, encoder=c), prbs(seed=s), kind="prbs") for s, c in enumerate((0.1, 0.7)))
    )
    open_ = validate(model(), rec).open_loop
    one, two = open_.segments[0], open_.segments[1]
    assert open_.pooled.samples == one.samples + two.samples
    mean = (one.rmse_counts**2 * one.samples + two.rmse_counts**2 * two.samples) / open_.pooled.samples
    assert open_.pooled.rmse_counts**2 == pytest.approx(mean, rel=1e-9)
    low, high = sorted((one.chi2_per_sample, two.chi2_per_sample))
    assert low < open_.pooled.chi2_per_sample < high


def test_the_right_motor_is_at_the_floor_and_a_wrong_one_is_not():
    rec = recording(*(open_loop(Rig(encoder=c), prbs(seed=s), kind="prbs") for s, c in enumerate((0.1, 0.7))))
    assert validate(model(), rec).open_loop.pooled.chi2_per_sample == pytest.approx(1.0, abs=0.2)
    assert validate(model(pole=48.0), rec).open_loop.pooled.chi2_per_sample > 2


@pytest.mark.parametrize("duty", [prbs(), prbs(seed=5)])
def test_a_segment_that_begins_in_motion_has_its_speed_estimated(duty):
    segment = open_loop(Rig(speed=60.0), duty, kind="prbs", at_rest=False)
    open_ = validate(model(), recording(segment)).open_loop
    assert open_.initial_speed_estimated == (0,)
    assert open_.pooled.chi2_per_sample < 1.3
    still = validate(model(), recording(dataclasses.replace(segment, at_rest=True))).open_loop
    assert still.initial_speed_estimated == ()
    assert still.pooled.chi2_per_sample > 10


def test_lost_ticks_begin_anew():
    segment = without(open_loop(Rig(), prbs(), kind="prbs"), [50, 51, 100])
    open_ = validate(model(), recording(segment)).open_loop
    assert open_.initial_speed_estimated == (0,)
    assert open_.pooled.samples == 149 - 3 - 2
    assert open_.pooled.chi2_per_sample < 1.3


def test_second_order_is_simulated_as_such():
    rec = recording(open_loop(Rig(tau=0.004), prbs(), kind="prbs"))
    assert validate(model(tau=0.004), rec).open_loop.pooled.chi2_per_sample < 1.3
    assert validate(model(), rec).open_loop.pooled.chi2_per_sample > 2


def test_a_speed_log_is_scored_without_counts():
    duty = prbs()
    speed = np.concatenate([[0.0], mean_speed(duty, 11.0, 40.0)[:-1]])
    noise = np.random.default_rng(0).normal(0, 0.3, len(speed))
    segment = dataclasses.replace(open_loop(Rig(), duty, kind="prbs"), count=None, speed_rad_s=speed + noise)
    v = validate(model(), recording(segment, counts_per_rev=None, speed_window_s=PERIOD))
    assert not v.open_loop.floor_known
    assert np.isnan(v.open_loop.pooled.rmse_counts)
    assert v.open_loop.pooled.rmse_rad_s == pytest.approx(0.3, rel=0.15)


def test_a_constant_speed_has_no_fit_percent():
    turning = open_loop(Rig(speed=55.0), step(5.0, before=0), kind="other", at_rest=False)
    even = dataclasses.replace(turning, count=27 * np.arange(150))
    score = validate(model(), recording(open_loop(Rig(), step(5.1)), even)).open_loop.segments[1]
    assert np.isnan(score.fit_percent)
    assert np.isfinite(score.rmse_rad_s)
