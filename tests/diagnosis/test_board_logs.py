"""Logs of small boards, imported as their users would: what is in the motor is named, and no more."""

import numpy as np
import pytest
from board_logs import imported, is_right
from scipy.integrate import solve_ivp
from testing.board_logs import draw_log
from testing.board_motor import BoardMotor
from testing.board_programs import PROGRAMS

from jaxmotor import diagnose, identify


@pytest.mark.parametrize(("program", "seed"), [("tachometer", 3), ("fan", 21), ("pulse_times", 12)])
def test_what_is_in_the_motor_is_named(program, seed, tmp_path):
    """The lag of a tachometer's filter, longer than most, is not the window of its speeds; friction and a fan's drag in
    one direction are two laws, no curve."""
    log = draw_log(program, seed)
    found = diagnose(imported(log, tmp_path / program))
    assert is_right(log, found) and found.verdict == "extended"
    assert found.average is None


def test_static_friction_may_fall_like_an_exponential(tmp_path):
    """A bell in its place leaves seven times the noise, and moves gain and pole by ten standard errors."""
    log = draw_log("speed_loop", 83)
    found = diagnose(imported(log, tmp_path / "loop"), effects=["stiction", "quadratic_drag", "missed_counts"])
    [friction] = found.effects
    assert friction.name == "stiction" and found.verdict == "extended"
    motor, sizes, errors = log.motor, friction.parameters, friction.standard_error
    volts_Nm = motor.torque_Nm_A / motor.resistance
    true = {
        "volts_V": motor.coulomb_Nm / volts_Nm,
        "static_volts_V": (motor.coulomb_Nm + motor.static_Nm) / volts_Nm,
        "stribeck_speed_rad_s": motor.slow_rad_s,
    }
    assert sizes["exponent"] == 1.0 and errors["exponent"] == 0.0
    assert all(abs(sizes[name] - value) < 3 * errors[name] for name, value in true.items())
    assert abs(float(found.motor.linear.pole) - motor.pole_rad_s) < 3 * found.standard_error["pole_rad_s"]


@pytest.mark.parametrize("seed", [41, 42, 43, 47, 52, 59])
def test_a_single_step_tells_the_pole_and_says_how_well(seed, tmp_path):
    """Nearly all of it is in one block of rows."""
    log = draw_log("one_step", seed)
    motor, found = log.motor, identify(imported(log, tmp_path / "step"))
    pole, error = motor.pole_rad_s, float(found.standard_error.pole)
    assert abs(float(found.motor.pole) - pole) < 3 * error < 0.3 * pole
    assert not any("does not explain" in note for note in found.notes)


def test_means_over_a_row_that_nobody_states_are_no_delay(tmp_path):
    log = draw_log("one_step", 6)
    found = diagnose(imported(log, tmp_path / "step"))
    assert not found.effects and found.average is not None and found.average.kind == "window"
    assert found.average.length_s == pytest.approx(0.02, abs=3 * found.average.standard_error_s)


def test_a_pattern_of_rounding_alone_has_no_name(tmp_path):
    """At the steady speed after a step counts are rounded in the same way turn after turn, as if there were cogging."""
    found = diagnose(imported(draw_log("one_step", 21), tmp_path / "step"))
    assert not found.effects and found.probabilities == {"none": 1.0}


@pytest.mark.parametrize("program", [name for name in PROGRAMS if name not in ("tachometer", "fan", "pulse_times")])
def test_a_log_is_imported_whole(program, tmp_path):
    log = draw_log(program, 2)
    recording = imported(log, tmp_path / program)
    assert sum(map(len, recording.segments)) == len(log.text.splitlines()) - 1


def test_the_motor_moves_as_the_equation_that_it_states():
    motor = BoardMotor(12.0, 4.0, 0.4, 2e-3, 1e-3, 0.05, 1000.0, drag=1e-4, arm_Nm=0.2, detent_Nm=0.03, detents=5)

    def equation(_, state):
        angle, speed = state
        torque = 0.4 * (0.8 * 12 - 0.4 * speed) / 4 - 1e-3 * speed - 1e-4 * speed * abs(speed)
        torque -= 0.2 * np.sin(angle) + 0.03 * np.sin(5 * angle) + 0.05
        return speed, torque / 2e-3

    motor.advance(0.8, 0.5)
    finely = solve_ivp(equation, (0, 0.5), (0.0, 1e-9), rtol=1e-9, atol=1e-9).y[:, -1]
    assert (motor.angle_rad, motor.speed_rad_s) == pytest.approx(finely, rel=2e-5)


def test_friction_stops_the_motor_where_and_when_it_would():
    motor = BoardMotor(12.0, 4.0, 0.4, 2e-3, 1e-3, 0.05, 1000.0, speed_rad_s=5.0)
    damping = 1e-3 + 0.4**2 / 4
    lasts = 0.05 / damping
    motor.advance(0.0, 1.0)
    stops_s = 2e-3 / damping * np.log1p(5 / lasts)
    turned = (5 + lasts) * 2e-3 / damping * -np.expm1(-stops_s * damping / 2e-3) - lasts * stops_s
    assert motor.speed_rad_s == 0.0 and motor.angle_rad == pytest.approx(turned, rel=1e-9)
