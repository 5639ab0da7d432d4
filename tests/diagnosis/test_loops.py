"""Closed loops that the motors were not fitted to: what a diagnosis promises of them, against the plant's own run."""

import dataclasses
import functools
import json

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from diagnosed import of
from hidden import draw

from jaxmotor import diagnose
from jaxmotor._precision import in_float64
from jaxmotor.cli._story import diagnosis_text
from jaxmotor.diagnosis import to_json
from jaxmotor.motor import EFFECTS, Motor, SecondOrder
from jaxmotor.present import loop_before_after
from jaxmotor.validation import controller_of, loop_of_motors

pytestmark = pytest.mark.usefixtures("plant_library")


@functools.cache
def with_friction():
    hidden = draw(("coulomb_friction",), 30)
    return hidden, diagnose(hidden.recording)


def rig(recording):
    """Supply [V], period [s] and the speed of one count [rad/s]."""
    supply, period, counts = recording.supply_V, recording.period_s, recording.counts_per_rev
    assert supply and period and counts
    return supply, period, 2 * np.pi / counts / period


@in_float64
def truth(hidden, number=8):
    """The plant's own motor, several times: the runs then differ by where their encoder begins."""
    values = (hidden.gain, hidden.pole, hidden.electrical_time_constant, hidden.viscous_share)
    gain, pole, lag, share = (jnp.asarray(np.float64(value)) for value in values)
    friction = EFFECTS["coulomb_friction"].of(volts_V=hidden.truth["coulomb_friction"]["volts_V"])
    motor = Motor(SecondOrder(gain, pole, lag), (friction,), share)
    return jax.tree.map(lambda leaf: jnp.stack([leaf] * number), motor)


def closed_loop(recording):
    """Index and controller of the only closed loop."""
    [index] = [k for k, segment in enumerate(recording.segments) if segment.kind == "closed_loop"]
    controller = controller_of(recording, index)
    assert not isinstance(controller, str)
    return index, controller


def loop(hidden, motors):
    run = in_float64(loop_of_motors)(motors, hidden.recording, *closed_loop(hidden.recording))
    assert run is not None
    return run


def test_the_true_motor_does_in_the_loop_what_the_plant_did():
    hidden, _ = with_friction()
    run = loop(hidden, truth(hidden))
    _, _, count = rig(hidden.recording)
    assert run.rmse_rad_s.value < count
    assert np.nanmax(np.abs(run.speed.mean - run.measured_speed_rad_s)) < 4 * count
    assert run.steady_error_rad_s.measured.value == pytest.approx(run.steady_error_rad_s.predicted.value, abs=count / 4)


def test_a_run_ends_where_the_header_has_another_reference():
    """The rig's reference is a square, of which the header knows the first half period."""
    hidden, _ = with_friction()
    run = loop(hidden, truth(hidden))
    half = hidden.recording.segments[run.segment].parameters["half_period_s"]
    assert run.time_s[-1] == pytest.approx(half, abs=3 * rig(hidden.recording)[1])


def test_the_extended_motor_foretells_the_loop_and_the_linear_one_does_not():
    _, found = with_friction()
    [gain] = found.closed_loop
    assert gain.held_out
    assert gain.after.rmse_rad_s.value < 0.7 * gain.before.rmse_rad_s.value
    measured = gain.after.steady_error_rad_s.measured.value
    before, after = gain.before.steady_error_rad_s.predicted, gain.after.steady_error_rad_s.predicted
    assert after.low - 0.1 <= measured <= after.high + 0.1
    assert not before.low <= measured <= before.high
    assert after.high - after.low < before.high - before.low


def test_a_loop_is_drawn_before_and_after():
    _, found = with_friction()
    [gain] = found.closed_loop
    [ax] = loop_before_after(gain).axes
    drawn = {one.get_label(): one.get_ydata() for one in ax.get_lines()}
    assert list(drawn) == ["measured", "linear", "extended"]
    np.testing.assert_array_equal(drawn["measured"], gain.before.measured_speed_rad_s)
    np.testing.assert_array_equal(drawn["linear"], gain.before.speed.mean)
    np.testing.assert_array_equal(drawn["extended"], gain.after.speed.mean)
    alone = loop_before_after(dataclasses.replace(gain, after=gain.before)).axes[0]
    assert [one.get_label() for one in alone.get_lines()] == ["measured", "linear"]


def test_loops_are_told_and_written():
    _, found = with_friction()
    [gain] = found.closed_loop
    text = " ".join(diagnosis_text(found).split())
    assert f"P loop of segment {gain.before.segment} at" in text
    assert f"steady error measured {gain.before.steady_error_rad_s.measured.value:.3g} rad/s, linear" in text
    [written] = json.loads(json.dumps(to_json(found), allow_nan=False))["closed_loop"]
    assert written["steady_error_rad_s_after"] == gain.after.steady_error_rad_s.predicted.value
    low, high = written["rmse_rad_s_before_interval"]
    assert low <= written["rmse_rad_s_before"] <= high


def test_scores_lie_within_their_intervals():
    _, found = with_friction()
    for scores in (found.held_out, found.whole):
        for score, known in ((scores.before, scores.before_intervals), (scores.after, scores.after_intervals)):
            for name in ("chi2_per_sample", "rmse_rad_s", "fit_percent"):
                interval = getattr(known, name)
                assert interval.value == getattr(score, name)
                assert interval.low <= interval.value <= interval.high


def test_without_a_loop_nothing_is_said_of_one():
    _, found = of("friction")
    assert found.closed_loop == () and to_json(found)["closed_loop"] == []


def test_a_controller_that_did_not_run_is_not_simulated():
    hidden, _ = with_friction()
    recording = hidden.recording
    index, controller = closed_loop(recording)
    controller = dataclasses.replace(controller, gain_V_s_rad=9.0)
    run = in_float64(loop_of_motors)(truth(hidden), recording, index, controller)
    assert run is None
