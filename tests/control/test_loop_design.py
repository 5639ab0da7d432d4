"""Gains against the field's own tools: scipy's sampling, python-control's loops, and formulas."""

import math

import numpy as np
import pytest
from models import HARDWARE, model
from scipy import signal

from jaxmotor import JaxmotorError
from jaxmotor.control import (
    Hardware,
    design_position_loop,
    design_speed_loop,
    linear_of,
    reachable_rad_s,
    sampled_motor,
)

MOTORS = {
    "plain": model(),
    "second": model(lag=0.004),
    "late": model(("transport_delay", {"delay_s": 0.0085})),
    "slow": model(gain=4.0, pole=6.0),
}


def counted_speed(motor, volts, hardware, fine=50):
    """Mean speed over the tick before each tick, by scipy on a grid `fine` times as fine as the ticks."""
    linear = linear_of(motor.whole)
    lag = float(getattr(linear, "electrical_time_constant", 0.0))
    gain, pole = float(linear.gain), float(linear.pole)
    denominator = [lag, 1.0, pole, 0.0] if lag else [1.0, pole, 0.0]
    a, b, c, d = signal.tf2ss([gain * pole], denominator)
    step = hardware.period_s / fine
    a, b, c, d, _ = signal.cont2discrete((a, b, c, d), step)
    late = sum(float(e.delay_s) for e in motor.effects if e.name == "transport_delay") + hardware.delay_s
    held = np.concatenate([np.zeros(round(late / step)), np.repeat(volts, fine)])[: len(volts) * fine]
    _, angle, _ = signal.dlsim((a, b, c, d, step), held[:, None])
    return np.diff(angle[::fine, 0], prepend=0.0) / hardware.period_s


@pytest.mark.parametrize("name", MOTORS)
def test_the_sampled_motor_is_scipys(name):
    motor, hardware = MOTORS[name], Hardware(0.005, 617.4, 7.4, 250, 5e-4)
    volts = np.random.default_rng(1).normal(size=60)
    plant, state, seen = sampled_motor(motor.whole, hardware), 0.0, []
    state = np.zeros(len(plant.drive))
    for u in volts:
        seen.append(plant.output @ state)
        state = plant.transition @ state + plant.drive * u
    np.testing.assert_allclose(seen, counted_speed(motor, volts, hardware), atol=1e-8)


def test_pi_poles_are_those_of_the_formula():
    motor, hardware = model(), Hardware(0.005, 617.4, 7.4)
    design = design_speed_loop(motor.whole, hardware, bandwidth_Hz=8.0)
    p = math.exp(-40 * 0.005)
    g = (1 - p) / (40 * 0.005)
    loop = design.gain_V_s_rad * 10.6
    expected = np.append(np.roots([1, -1 + loop * (1 - g), loop * (g - p)]), p)
    found = sorted((pole for pole in design.poles if abs(pole) > 1e-9), key=abs)
    np.testing.assert_allclose(found, sorted(expected, key=abs), atol=1e-9)
    assert design.integral_gain_V_rad * 0.005 / design.gain_V_s_rad == pytest.approx(1 - p)


@pytest.mark.parametrize("name", MOTORS)
@pytest.mark.parametrize("kind", ["P", "PI"])
def test_python_control_sees_the_same_loop(name, kind):
    control = pytest.importorskip("control", reason="python-control is not installed; pip install control")
    motor = MOTORS[name]
    design = design_speed_loop(motor.whole, HARDWARE, kind=kind, feeds_forward=False)
    plant = sampled_motor(motor.whole, HARDWARE)
    system = control.ss(plant.transition, plant.drive[:, None], plant.output[None], [[0.0]], 0.005)
    k, step = design.gain_V_s_rad, design.integral_gain_V_rad * 0.005
    law = control.tf([k, step - k], [1, -1], 0.005) if kind == "PI" else control.tf([k], [1], 0.005)
    closed = control.feedback(control.series(control.ss(law), system), 1)
    _, step = control.step_response(closed, 1.0)
    share = step / control.dcgain(closed)
    assert 100 * (share.max() - 1) == pytest.approx(design.overshoot_percent, abs=0.05)
    assert design.overshoot_percent < 5.2
    response = abs(closed(np.exp(2j * np.pi * design.bandwidth_Hz * 0.005)) / control.dcgain(closed))
    if design.bandwidth_Hz < 99:
        assert response == pytest.approx(math.sqrt(0.5), rel=2e-3)
    assert np.abs(control.poles(closed)).max() < 1


def test_the_gain_margin_is_where_the_loop_rings():
    design = design_speed_loop(model().whole, HARDWARE, bandwidth_Hz=10.0, feeds_forward=False, kind="P")
    plant = sampled_motor(model().whole, HARDWARE)
    for factor, stable in ((0.999, True), (1.001, False)):
        gain = factor * design.gain_margin * design.gain_V_s_rad
        radius = np.abs(np.linalg.eigvals(plant.transition - gain * np.outer(plant.drive, plant.output))).max()
        assert bool(radius < 1) is stable


@pytest.mark.parametrize("wanted", [2.0, 6.0, 12.0])
@pytest.mark.parametrize("kind", ["PI", "position"])
def test_the_bandwidth_asked_for_is_had(kind, wanted):
    if kind == "PI":
        assert design_speed_loop(model().whole, HARDWARE, bandwidth_Hz=wanted).bandwidth_Hz == pytest.approx(
            wanted, rel=1e-3
        )
    else:
        found = design_position_loop(model().whole, HARDWARE, bandwidth_Hz=wanted)
        assert found.bandwidth_Hz == pytest.approx(wanted, rel=2e-3) and found.overshoot_percent < 8.5


@pytest.mark.parametrize("overshoot", [1.0, 5.0, 20.0])
def test_position_poles_lie_where_they_were_put(overshoot):
    design = design_position_loop(model().whole, HARDWARE, bandwidth_Hz=12.0, overshoot_percent=overshoot)
    damping = -math.log(overshoot / 100) / math.hypot(math.pi, math.log(overshoot / 100))
    if design.speed_gain_V_s_rad > 0:
        placed = max((pole for pole in design.poles if pole.imag > 1e-9), key=abs)
        s = np.log(placed)
        assert -s.real / abs(s) == pytest.approx(damping, rel=1e-6)
    assert max(map(abs, design.poles)) < 1


def test_the_encoder_limits_the_gain_and_it_is_said():
    coarse = design_speed_loop(model().whole, Hardware(0.005, 60.0, 7.4))
    assert coarse.ripple_V == pytest.approx(0.05 * 7.4) and "limited by the encoder" in coarse.notes[0]
    assert "shakes" in design_speed_loop(model().whole, Hardware(0.005, 20.0, 7.4), bandwidth_Hz=15.0).notes[-1]


def test_what_cannot_be_had_is_a_sentence():
    with pytest.raises(JaxmotorError, match="would overshoot by more than 5 %"):
        design_speed_loop(model().whole, HARDWARE, bandwidth_Hz=80.0)
    with pytest.raises(JaxmotorError, match="would overshoot"):
        design_position_loop(model().whole, HARDWARE, bandwidth_Hz=60.0)
    with pytest.raises(JaxmotorError, match="the motor alone has"):
        design_speed_loop(model().whole, HARDWARE, kind="P", bandwidth_Hz=1.0)
    with pytest.raises(JaxmotorError, match="half the sampling rate"):
        design_speed_loop(model().whole, HARDWARE, bandwidth_Hz=101.0)
    with pytest.raises(JaxmotorError, match="from 0 to 60"):
        design_speed_loop(model().whole, HARDWARE, overshoot_percent=-1.0)
    with pytest.raises(JaxmotorError, match="P or PI"):
        design_speed_loop(model().whole, HARDWARE, kind="PID")


@pytest.mark.parametrize(
    "numbers",
    [
        (0.0, 9.0, 7.0),
        (math.nan, 9.0, 7.0),
        (0.005, -1.0, 7.0),
        (0.005, 9.0, math.inf),
        (5.0, 9.0, 7.0),
        (0.1, 9.0, 7.0, 0),
    ],
)
def test_impossible_hardware_is_a_sentence(numbers):
    with pytest.raises(JaxmotorError):
        Hardware(*numbers)


def test_effects_that_a_linear_design_leaves_out_are_named():
    motor = model(("backlash", {"gap_rad": 0.03, "inertia_ratio": 0.3})).whole
    assert "without backlash" in design_speed_loop(motor, HARDWARE).notes[0]


def test_a_motor_that_turns_the_other_way_gets_gains_of_the_other_sign():
    forward, backward = (design_speed_loop(model(gain=gain).whole, HARDWARE) for gain in (10.6, -10.6))
    assert backward.gain_V_s_rad == pytest.approx(-forward.gain_V_s_rad)
    forward, backward = (design_position_loop(model(gain=gain).whole, HARDWARE) for gain in (10.6, -10.6))
    assert backward.gain_V_rad == pytest.approx(-forward.gain_V_rad)


def test_reachable_speed():
    motor = model(("coulomb_friction", {"volts_V": 0.4}), ("dead_zone", {"volts_V": 0.5})).whole
    assert reachable_rad_s(motor, 7.4) == pytest.approx(10.6 * 6.5)
    dragged = model(("quadratic_drag", {"volts_V_s2_rad2": 1e-3})).whole
    speed = reachable_rad_s(dragged, 7.4)
    assert speed / 10.6 + 1e-3 * speed**2 == pytest.approx(7.4)
    assert reachable_rad_s(model(("dead_zone", {"volts_V": 9.0})).whole, 7.4) == 0.0
