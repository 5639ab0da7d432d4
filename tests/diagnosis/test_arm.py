"""Torques of the angle in a position loop: without them a simulated shaft never stands where the measured one does."""

import numpy as np
import pytest

from jaxmotor import Recording, diagnose
from jaxmotor.motor.effects import Cogging, Rig
from jaxmotor.recording import from_arrays

GAIN, POLE, FRICTION_V, ARM_V = 4.0, 14.0, 0.25, 1.6
"""[rad/s/V, rad/s]; the weight's torque where the arm is level, as a voltage at the winding."""
PERIOD_S, FINE, ROWS = 0.01, 50, 3000
SUPPLY_V, FULL, COUNTS = 9.0, 255, 4096


def held(seed: int, volts: float = ARM_V, cycles: int = 1) -> Recording:
    """The angle, of an encoder, of a shaft that a proportional loop moves to random places within less than a turn;
    Euler's method in steps of 0.2 ms."""
    rng = np.random.default_rng(seed)
    wanted = np.repeat(rng.uniform(-2.5, 2.5, ROWS // 100), 100)
    step, angle, speed = PERIOD_S / FINE, 0.0, 0.0
    read, duty = np.zeros(ROWS), np.zeros(ROWS, int)
    for row in range(ROWS):
        read[row] = np.floor(angle / (2 * np.pi) * COUNTS) * (2 * np.pi / COUNTS)
        duty[row] = np.round(np.clip(0.6 * (wanted[row] - read[row]), -1.0, 1.0) * FULL)
        for _ in range(FINE):
            drive = SUPPLY_V * duty[row] / FULL - volts * np.sin(cycles * angle) - speed / GAIN
            if speed == 0.0 and abs(drive) <= FRICTION_V:
                break
            way = np.sign(speed) if speed else np.sign(drive)
            new = speed + step * POLE * GAIN * (drive - FRICTION_V * way)
            speed = 0.0 if new * speed < 0 else new
            angle += step * speed
    time = PERIOD_S * np.arange(ROWS)
    return from_arrays(time_s=time, duty=duty, duty_full_scale=FULL, supply_V=SUPPLY_V, angle_rad=read)


@pytest.mark.parametrize(("seed", "volts", "cycles"), [(6, ARM_V, 1), (3, 0.3, 17)])
def test_an_arm_or_cogging_and_friction_are_found_in_a_position_loop(seed: int, volts: float, cycles: int) -> None:
    """More cycles than are always tried are those at which the residual repeats. In the first log a dead zone of 1 mV
    would take up some of next to nothing."""
    found = diagnose(held(seed, volts, cycles))
    assert {one.name for one in found.effects} == {"cogging", "coulomb_friction"}
    arm = next(one for one in found.effects if one.name == "cogging")
    assert arm.parameters["cycles_per_rev"] == cycles
    np.testing.assert_allclose(arm.parameters["volts_V"], volts, rtol=0.03)
    assert found.verdict == "extended"
    gain, pole = float(found.motor.linear.gain), float(found.motor.linear.pole)
    assert abs(gain - GAIN) < 2 * found.standard_error["gain_rad_s_V"] + 0.01 * GAIN
    assert abs(pole - POLE) < 0.05 * POLE


def test_an_arm_needs_no_whole_turn_but_a_swing() -> None:
    """Of other numbers a whole cycle; and none where it could be but a constant load."""
    rig = Rig(9.0, (3.0, 6.0), 30.0, 0.01, 30.0, turns=False, swing_rad=1.5)

    def cycles(rig: Rig) -> set[float]:
        return {float(one.cycles_per_rev) for one in Cogging.starts(rig) if isinstance(one, Cogging)}

    assert cycles(rig) == {1.0, *range(5, 13)}
    assert not cycles(rig._replace(swing_rad=0.3))
    assert cycles(rig._replace(turns=True)) == {*range(1, 13)}
