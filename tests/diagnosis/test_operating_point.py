"""Logs whose input is counted from an operating point: its zero is far from no voltage."""

import numpy as np
import pytest

from jaxmotor import diagnose, identify
from jaxmotor.recording import AT_ZERO, Recording, from_arrays

GAIN, POLE, OFFSET_V, PERIOD_S = 1.7, 3.0, 8.0, 0.03


def log_of(*steps: tuple[float, int]) -> Recording:
    """Speeds under so many volts for so many rows, of an exact hold, steady before the first; 0.1 rad/s of noise."""
    volts = np.concatenate([np.full(rows, volts_V) for volts_V, rows in steps])
    keep = np.exp(-POLE * PERIOD_S)
    speed = GAIN * (volts + OFFSET_V)
    for row in range(1, len(volts)):
        speed[row] = keep * speed[row - 1] + (1 - keep) * GAIN * (volts[row - 1] + OFFSET_V)
    read = speed + np.random.default_rng(2).normal(0, 0.1, len(volts))
    return from_arrays(
        time_s=PERIOD_S * np.arange(len(volts)), volts=volts, speed_rad_s=read, supply_V=12.0, speed_window_s=0.0
    )


@pytest.mark.parametrize("steps", [((0.0, 100), (1.4, 160)), ((7.0, 100), (5.6, 160))])
def test_an_offset_beyond_all_voltages_is_told(steps):
    fit = identify(log_of(*steps))
    assert float(fit.motor.gain) == pytest.approx(GAIN, abs=1.96 * float(fit.standard_error.gain))
    assert fit.offset_V == pytest.approx(OFFSET_V, abs=1.96 * fit.offset_standard_error_V)
    beyond, at_zero = "offset is larger than any voltage", AT_ZERO
    told = "; ".join(fit.notes)
    assert beyond in told and (at_zero in told) == (steps[0][0] == 0)


def test_beside_an_offset_that_no_linear_motor_lacks_nothing_else_is_named():
    """Without one the linear motor that leaves least has next to no pole, and tells nothing of the other effects."""
    found = diagnose(log_of((7.0, 100), (5.6, 160)))
    assert found.verdict == "extended"
    [named] = [one for one in found.effects if one.is_told]
    assert named.name in ("voltage_offset", "load_torque")
    assert abs(named.parameters["volts_V"]) == pytest.approx(OFFSET_V, rel=0.02)
    assert float(found.motor.linear.gain) == pytest.approx(GAIN, rel=0.02)
    assert float(found.motor.linear.pole) == pytest.approx(POLE, rel=0.05)
