"""Counts and speeds read a while after the voltage changes, of a motor with friction: no backlash, no other pole."""

import dataclasses

import numpy as np
import pytest
from board_logs import imported
from testing.board_logs import draw_log
from testing.board_motor import BoardMotor
from testing.board_programs import counts

from jaxmotor import Recording, diagnose
from jaxmotor.diagnosis import Diagnosis
from jaxmotor.recording import from_arrays

ROW_S, ROWS = 0.01, 3000


def read_late(motor: BoardMotor, share: float, seed: int) -> Recording:
    """Rows of 10 ms, each read after this `share` of it."""
    rng = np.random.default_rng(seed)
    duty = np.repeat(np.where(np.arange(ROWS) % 7, rng.uniform(-1, 1, ROWS), 0.0), rng.integers(15, 80, ROWS))[:ROWS]
    duty[:50], count = 0.0, np.zeros(ROWS, int)
    for row in range(ROWS):
        motor.advance(duty[row], share * ROW_S)
        count[row] = counts(motor)
        motor.advance(duty[row], (1 - share) * ROW_S)
    return from_arrays(
        time_s=ROW_S * np.arange(ROWS),
        volts=duty * motor.supply_V,
        counts=count,
        counts_per_rev=motor.counts_per_rev,
        supply_V=motor.supply_V,
    )


def drawn(seed: int) -> BoardMotor:
    return dataclasses.replace(draw_log("serial_port", seed).motor, angle_rad=0.0, speed_rad_s=0.0, time_s=0.0)


def errors_off(found: Diagnosis, motor: BoardMotor) -> float:
    return (float(found.motor.linear.pole) - motor.pole_rad_s) / found.standard_error["pole_rad_s"]


def speeds_of(log: Recording, seed: int) -> Recording:
    """Its speeds, each the mean over a row, with noise of a hundredth of the largest."""
    [segment] = log.segments
    speeds = np.diff(segment.count) * 2 * np.pi / (log.counts_per_rev * ROW_S)
    noise = np.random.default_rng(seed).standard_normal(len(speeds))
    return from_arrays(
        time_s=segment.time_s[1:],
        volts=segment.volts[1:],
        speed_rad_s=speeds + 0.01 * np.abs(speeds).max() * noise,
        supply_V=log.supply_V,
        speed_window_s=ROW_S,
    )


@pytest.mark.parametrize(("seed", "share", "what"), [(4, 0.05, "counts"), (7, 0.01, "counts"), (5, 0.2, "speeds")])
def test_rows_that_are_read_late_are_no_law_of_the_motor(seed, share, what):
    """0.01 rows alone move the pole by 12 standard errors, 0.2 rows that of speeds by 15."""
    motor = drawn(seed)
    log = read_late(motor, share, seed)
    found = diagnose(log if what == "counts" else speeds_of(log, seed))
    assert [one.name for one in found.effects] == ["coulomb_friction"] and found.verdict == "extended"
    assert found.timing is not None
    assert found.timing.offset_s == pytest.approx(share * ROW_S, abs=0.01 * ROW_S)
    assert abs(found.timing.offset_s - share * ROW_S) < 3 * found.timing.standard_error_s
    assert abs(errors_off(found, motor)) < 3
    assert any("rows are read" in note for note in found.notes)


def test_rows_that_are_read_when_voltages_change_have_no_offset():
    motor = drawn(3)
    found = diagnose(read_late(motor, 0.0, 3))
    assert [one.name for one in found.effects] == ["coulomb_friction"] and found.timing is None
    assert abs(errors_off(found, motor)) < 3


def test_a_computer_that_reads_late_each_time_otherwise(tmp_path):
    """0.9 ms in the mean: without that the pole is 36 standard errors off."""
    log = draw_log("serial_port", 11)
    found = diagnose(imported(log, tmp_path / "log"))
    assert [one.name for one in found.effects] == ["coulomb_friction"] and found.verdict == "extended"
    assert found.timing is not None and found.timing.offset_s == pytest.approx(0.9e-3, rel=0.15)
    assert abs(errors_off(found, log.motor)) < 3
