"""Closed loop: against a motor integrated in 10 us steps under a controller written anew, and against eq. 21."""

import dataclasses
import re

import jax
import numpy as np
import pytest
from rigs import COUNTS, FINE, FULL, PERIOD, SUPPLY, Rig, closed_loop, model, open_loop, recording, step, without

from jaxmotor._precision import to_jax
from jaxmotor.validation import to_json, validate
from jaxmotor.validation._controller import Controller
from jaxmotor.validation._loops import run_loops

COUNT = 2 * np.pi / (COUNTS * PERIOD)
DUTY = SUPPLY / FULL


def loop_of(segment, model_=None, **header):
    (loop,) = validate(model_ or model(), recording(segment, **header)).closed_loop
    return loop


@pytest.mark.parametrize(
    ("values", "gain", "integral_gain", "offset_V"),
    [((11.0, 40.0), 0.4, 0.0, 0.0), ((11.0, 40.0), 0.06, 2.0, 0.1), ((11.0, 40.0, 0.003), 0.2, 4.0, 0.0)],
)
def test_the_loop_is_that_of_a_fine_integration(x64, values, gain, integral_gain, offset_V):
    rig = Rig(*values, offset_V=offset_V, substeps=FINE)
    segment = closed_loop(rig, 150, 37.7, gain, integral_gain)
    controller = Controller(37.7, gain, integral_gain, SUPPLY, DUTY)
    motors = jax.tree.map(lambda leaf: to_jax(leaf[None]), model(*values, offset_V=offset_V).whole)
    begin, exact = np.array([0.37]), np.zeros(1, bool)
    run = run_loops(motors, recording(segment), 0, controller, 1.0, 150, reading=begin, ideal=exact)
    np.testing.assert_array_equal(np.rint(run["volts"][0] / DUTY), segment.duty)
    np.testing.assert_array_equal(np.rint(run["seen"][0][1:] / COUNT), np.diff(segment.count))
    assert np.abs(segment.duty).max() == FULL or integral_gain


@pytest.mark.parametrize("gain", [0.05, 0.1, 0.4])
def test_the_steady_error_is_eq_21_within_quantisation(gain):
    loop = loop_of(closed_loop(Rig(), 150, 37.7, gain))
    assert loop.kind == "P"
    assert loop.theory_error_rad_s.value == pytest.approx(37.7 / (1 + 11.0 * gain), rel=1e-12)
    # Half a duty in the loop, and a count at either end of the average over 37 ticks.
    quantum = 0.5 * DUTY * 11.0 / (1 + 11.0 * gain) + COUNT / 37
    assert loop.steady_error_rad_s.measured.value == pytest.approx(loop.theory_error_rad_s.value, abs=quantum)
    assert loop.steady_error_rad_s.predicted.value == pytest.approx(loop.theory_error_rad_s.value, abs=quantum)
    assert loop.steady_error_rad_s.inside
    assert loop.steady_speed_rad_s.measured.value + loop.steady_error_rad_s.measured.value == pytest.approx(37.7)


def test_the_interval_of_eq_21_is_that_of_the_gain():
    loop = loop_of(closed_loop(Rig(), 150, 37.7, 0.1), model(errors=(0.5, 1.0)))
    low, high = (37.7 / (1 + 0.1 * (11.0 + s * 1.96 * 0.5)) for s in (1, -1))
    assert loop.theory_error_rad_s.low == pytest.approx(low, rel=0.01)
    assert loop.theory_error_rad_s.high == pytest.approx(high, rel=0.01)


def test_a_voltage_offset_shifts_the_steady_error():
    loop = loop_of(closed_loop(Rig(offset_V=0.5), 150, 37.7, 0.1), model(offset_V=0.5))
    assert loop.theory_error_with_offset_rad_s == pytest.approx((37.7 - 5.5) / 2.1)
    assert loop.steady_error_rad_s.measured.value == pytest.approx(loop.theory_error_with_offset_rad_s, abs=0.15)
    assert loop.steady_error_rad_s.inside


def test_a_gain_without_balance_has_no_theory():
    segment = closed_loop(Rig(gain=10.0), 150, 37.7, -0.1)
    loop = loop_of(segment, model(gain=10.0))
    assert np.isnan(loop.theory_error_rad_s.value)
    assert to_json(validate(model(gain=10.0), recording(segment)))["closed_loop"][0]["steady_error_rad_s"][
        "theory"
    ] == {
        "value": None,
        "low": None,
        "high": None,
    }


def test_an_integral_leaves_no_error():
    loop = loop_of(closed_loop(Rig(), 150, 37.7, 0.05, 2.0))
    assert loop.kind == "PI"
    assert loop.theory_error_rad_s == (0.0, 0.0, 0.0)
    assert loop.steady_error_rad_s.measured.value == pytest.approx(0.0, abs=COUNT / 37)
    assert loop.controller_off_percent == 0


def test_a_windup_that_stops_is_the_rigs():
    loop = loop_of(closed_loop(Rig(), 150, 75.0, 0.02, 10.0))
    assert loop.controller_off_percent == 0
    assert loop.saturated_percent.measured.value > 5
    assert loop.overshoot_percent.inside
    assert loop.speed_inside_percent > 90


def test_a_reference_out_of_reach_is_said():
    loop = loop_of(closed_loop(Rig(), 150, 500.0, 0.4))
    assert loop.saturated_percent.measured.value == loop.saturated_percent.predicted.value == 100
    assert any("beyond what the supply can do" in note for note in loop.notes)
    assert loop.steady_speed_rad_s.measured.value == pytest.approx(11.0 * SUPPLY, rel=0.01)


def test_a_run_cut_short_is_said():
    loop = loop_of(closed_loop(Rig(pole=2.0), 150, 37.7, 0.05), model(pole=2.0))
    assert any("has not settled" in note for note in loop.notes)


@pytest.mark.parametrize("integral_gain", [0.0, 2.0])
def test_the_controller_of_the_header_is_found_in_the_log(integral_gain):
    segment = closed_loop(Rig(), 150, 37.7, 0.1, integral_gain)
    assert loop_of(segment).notes == ()
    wrong = dataclasses.replace(segment, parameters={**segment.parameters, "gain": 0.15})
    loop = loop_of(wrong)
    assert loop.controller_off_percent > 30
    assert any("not what the rig ran" in note for note in loop.notes)
    assert np.isfinite(loop.speed_inside_percent)


def test_an_integral_that_lags_by_a_tick_is_the_same_controller():
    """As the board has it: this tick's error enters the integral for the next."""
    rig, duty, counts, integral, before = Rig(), [], [], 0.0, 0
    for _ in range(150):
        count = rig.count()
        error = 37.7 - (count - before) * COUNT
        wanted = 0.1 * error + integral
        duty.append(round(min(max(wanted, -SUPPLY), SUPPLY) / DUTY))
        integral += 6.0 * error * PERIOD * (abs(wanted) <= SUPPLY or wanted * error < 0)
        counts.append(count)
        rig.hold(duty[-1] * DUTY)
        before = count
    segment = closed_loop(Rig(), 150, 37.7, 0.1, 6.0)
    segment = dataclasses.replace(
        segment, duty=np.array(duty), volts=np.array(duty) * DUTY, count=np.array(counts, dtype=np.int64)
    )
    loop = loop_of(segment)
    assert loop.controller_off_percent < 1
    assert loop.speed_inside_percent > 90


def test_both_names_of_the_gain_are_read():
    segment = closed_loop(Rig(), 150, 37.7, 0.1)
    renamed = dataclasses.replace(segment, parameters={"reference_rad_s": 38, "gain_V_s_rad": 0.1})
    assert loop_of(renamed).gain_V_s_rad == 0.1
    assert loop_of(renamed).reference_rad_s == 38.0


@pytest.mark.parametrize(
    ("parameters", "reason"),
    [
        ({"gain": 0.1}, "no number reference_rad_s"),
        ({"reference_rad_s": 37.7}, "no number gain"),
        ({"reference_rad_s": "profile.csv", "gain": 0.1}, "no number reference_rad_s"),
        ({"reference_rad_s": 37.7, "gain": 0.1, "integral_gain": "fast"}, "integral_gain"),
        ({"reference_rad_s": 37.7, "gain": 0}, "gains are zero"),
    ],
)
def test_an_unknown_controller_is_scored_in_open_loop_and_said(parameters, reason):
    segment = dataclasses.replace(closed_loop(Rig(), 150, 37.7, 0.1), parameters=parameters)
    v = validate(model(), recording(segment))
    assert v.closed_loop == ()
    assert set(v.open_loop.segments) == {0}
    assert any(reason in note and "open loop" in note for note in v.notes)


def test_time_stamps_cannot_be_simulated_in_a_loop():
    segment = dataclasses.replace(closed_loop(Rig(), 150, 37.7, 0.1), tick=None)
    v = validate(model(), recording(segment, period_s=None))
    assert any("time stamps instead of ticks" in note for note in v.notes)
    assert v.open_loop.pooled.chi2_per_sample < 1.6


def test_lost_ticks_are_neither_counted_nor_fatal():
    segment = closed_loop(Rig(), 150, 37.7, 0.05, 2.0)
    loop = loop_of(without(segment, [3, 60, 61, 62]))
    assert len(loop.time_s) == 150
    assert np.isnan(loop.measured_volts_V[[3, 60, 61, 62]]).all()
    assert np.isnan(loop.measured_speed_rad_s[[3, 4, 60, 61, 62, 63]]).all()
    assert loop.controller_off_percent < 5
    assert loop.steady_error_rad_s.inside


def test_a_loop_that_begins_in_motion():
    segment = closed_loop(Rig(speed=60.0), 150, 20.0, 0.1, at_rest=False)
    loop = loop_of(segment)
    assert loop.controller_off_percent == 0
    assert loop.speed_inside_percent > 90
    assert loop.rise_time_s.inside
    loop = loop_of(dataclasses.replace(segment, at_rest=True))
    assert loop.measured_speed_rad_s[1] > loop.speed.high[1] + 20


def test_volts_without_a_supply_are_neither_quantised_nor_clipped():
    segment = dataclasses.replace(closed_loop(Rig(), 150, 37.7, 0.1), duty=None)
    loop = loop_of(segment, supply_V=None, duty_full_scale=None)
    assert np.isnan(loop.duty_step_V) and np.isnan(loop.limit_V)
    assert any("does not saturate" in note for note in loop.notes)
    assert any("no duty quantisation" in note for note in loop.notes)
    assert to_json(validate(model(), recording(segment, supply_V=None)))["closed_loop"][0]["limit_V"] is None


def test_a_speed_log_has_no_encoder_to_simulate():
    law = Controller(37.7, 0.1, 0.0, SUPPLY, DUTY)
    volts, speed, now = [], [], 0.0
    p = np.exp(-40 * PERIOD)
    for _ in range(150):
        speed.append(now)
        volts.append(round((law.reference_rad_s - now) * 0.1 / DUTY) * DUTY)
        now = p * now + 11.0 * (1 - p) * volts[-1]
    segment = dataclasses.replace(
        closed_loop(Rig(), 150, 37.7, 0.1),
        count=None,
        volts=np.array(volts),
        duty=np.rint(np.array(volts) / DUTY).astype(np.int64),
        speed_rad_s=np.array(speed),
    )
    loop = loop_of(segment, model(errors=(1e-3, 1e-2)), counts_per_rev=None, speed_window_s=0.0)
    assert any("no encoder quantisation" in note for note in loop.notes)
    assert loop.controller_off_percent == 0
    np.testing.assert_allclose(loop.speed.mean, speed, atol=0.1)


def test_a_second_order_model_predicts_a_second_order_rig():
    segment = closed_loop(Rig(tau=0.004), 150, 37.7, 0.1, 4.0)
    loop = loop_of(segment, model(tau=0.004))
    assert loop.overshoot_percent.inside
    assert loop.speed_inside_percent > 90
    assert loop_of(segment).speed_inside_percent < loop.speed_inside_percent


@pytest.mark.parametrize(("counts", "most"), [(COUNTS, 1.0), (100 * COUNTS, 0.99)])
def test_intervals_hold_95_of_100_motors(counts, most):
    """A coarse encoder's limits lie on counts, so that they hold a little more."""
    rng = np.random.default_rng(7)
    errors, hits, wrong = (0.08, 0.8), [], []
    for _ in range(40):
        gain, pole = np.array([11.0, 40.0]) + rng.normal(size=2) * errors
        rig = Rig(gain=gain, pole=pole, encoder=rng.uniform(), counts=counts)
        segment = closed_loop(rig, 150, 37.7, 0.05, 3.0) if rng.integers(2) else closed_loop(rig, 150, 37.7, 0.06)
        loop = loop_of(segment, model(errors=errors), counts_per_rev=counts)
        hits.append([loop.overshoot_percent.inside, loop.steady_error_rad_s.inside, loop.rise_time_s.inside])
        assert loop.speed_inside_percent > 75
        other = loop_of(segment, model(pole=25.0, errors=errors), counts_per_rev=counts)
        wrong.append(other.rise_time_s.inside)
    assert 0.9 <= np.mean(hits) <= most
    assert np.mean(hits, axis=0).min() >= 0.85
    assert np.mean(wrong) < 0.5


def test_open_and_closed_loop_share_a_recording():
    v = validate(model(), recording(open_loop(Rig(), step(5.1)), closed_loop(Rig(), 150, 37.7, 0.1)))
    assert set(v.open_loop.segments) == {0}
    assert len(v.steps) == len(v.closed_loop) == 1
    assert re.search(r"step to 5\.1\d V: rise time measured .*\n  P loop of segment 1: steady speed measured", repr(v))
