"""A weight on an arm in a position loop: without it the simulated shaft never stands where the measured one does."""

import numpy as np

from jaxmotor import Recording, diagnose
from jaxmotor.motor.effects import Cogging, Rig
from jaxmotor.recording import from_arrays

GAIN, POLE, FRICTION_V, ARM_V = 4.0, 14.0, 0.25, 1.6
"""[rad/s/V, rad/s]; the weight's torque where the arm is level, as a voltage at the winding."""
PERIOD_S, FINE, ROWS = 0.01, 50, 3000
SUPPLY_V, FULL, COUNTS = 9.0, 255, 4096


def held_arm(seed: int) -> Recording:
    """The angle, of an encoder, of an arm that a proportional loop moves to random places within less than a turn;
    Euler's method in steps of 0.2 ms."""
    rng = np.random.default_rng(seed)
    wanted = np.repeat(rng.uniform(-2.5, 2.5, ROWS // 100), 100)
    step, angle, speed = PERIOD_S / FINE, 0.0, 0.0
    read, duty = np.zeros(ROWS), np.zeros(ROWS, int)
    for row in range(ROWS):
        read[row] = np.floor(angle / (2 * np.pi) * COUNTS) * (2 * np.pi / COUNTS)
        duty[row] = np.round(np.clip(0.6 * (wanted[row] - read[row]), -1.0, 1.0) * FULL)
        for _ in range(FINE):
            drive = SUPPLY_V * duty[row] / FULL - ARM_V * np.sin(angle) - speed / GAIN
            if speed == 0.0 and abs(drive) <= FRICTION_V:
                break
            way = np.sign(speed) if speed else np.sign(drive)
            new = speed + step * POLE * GAIN * (drive - FRICTION_V * way)
            speed = 0.0 if new * speed < 0 else new
            angle += step * speed
    time = PERIOD_S * np.arange(ROWS)
    return from_arrays(time_s=time, duty=duty, duty_full_scale=FULL, supply_V=SUPPLY_V, angle_rad=read)


def test_an_arm_and_friction_are_found_in_a_position_loop() -> None:
    found = diagnose(held_arm(3))
    assert {one.name for one in found.effects} == {"cogging", "coulomb_friction"}
    arm = next(one for one in found.effects if one.name == "cogging")
    assert arm.parameters["cycles_per_rev"] == 1
    np.testing.assert_allclose(arm.parameters["volts_V"], ARM_V, rtol=0.03)
    assert found.verdict == "extended"
    gain, pole = float(found.motor.linear.gain), float(found.motor.linear.pole)
    assert abs(gain - GAIN) < 2 * found.standard_error["gain_rad_s_V"] + 0.01 * GAIN
    assert abs(pole - POLE) < 0.05 * POLE


def test_an_arm_needs_no_whole_turn_but_a_swing() -> None:
    """Within less than a turn only one cycle in a turn is sought, and none where it could be but a constant load."""
    rig = Rig(9.0, (3.0, 6.0), 30.0, 0.01, 30.0, turns=False, swing_rad=3.0)
    assert {float(one.cycles_per_rev) for one in Cogging.starts(rig)} == {1.0}
    assert not Cogging.starts(rig._replace(swing_rad=0.3))
    assert len({float(one.cycles_per_rev) for one in Cogging.starts(rig._replace(turns=True))}) == 12
