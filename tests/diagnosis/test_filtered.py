"""Speeds behind a filter that is slower than the motor: friction acts before the slower lag, so it is no dead zone."""

import numpy as np

from jaxmotor import Recording, diagnose
from jaxmotor.recording import from_arrays

GAIN, POLE, FRICTION_V, FILTER_S = 6.0, 30.0, 0.5, 0.12
"""[rad/s/V, rad/s, V, s]"""
PERIOD_S, FINE, ROWS = 0.02, 100, 1500


def filtered(seed: int) -> Recording:
    """Random voltages, each held for some rows; Euler's method in steps of 0.2 ms, noise of 0.02 rad/s."""
    rng = np.random.default_rng(seed)
    volts = np.repeat(rng.uniform(-6, 6, ROWS), rng.integers(5, 60, ROWS))[:ROWS]
    step, speed, seen, read = PERIOD_S / FINE, 0.0, 0.0, np.zeros(ROWS)
    for row, volt in enumerate(volts):
        read[row] = seen
        for _ in range(FINE):
            drive = volt - speed / GAIN
            way = np.sign(speed) if speed else np.sign(drive)
            new = speed + step * POLE * GAIN * (drive - FRICTION_V * way)
            speed = 0.0 if new * speed < 0 or (speed == 0.0 and abs(drive) <= FRICTION_V) else new
            seen += step / FILTER_S * (speed - seen)
    read += 0.02 * rng.standard_normal(ROWS)
    return from_arrays(time_s=PERIOD_S * np.arange(ROWS), volts=volts, speed_rad_s=read)


def test_the_motor_is_the_faster_lag_where_friction_tells() -> None:
    found = diagnose(filtered(1))
    named = {one.name: one for one in found.effects}
    assert named.keys() == {"coulomb_friction", "sensor_lag"}
    np.testing.assert_allclose(named["coulomb_friction"].parameters["volts_V"], FRICTION_V, rtol=0.03)
    np.testing.assert_allclose(named["sensor_lag"].parameters["time_constant_s"], FILTER_S, rtol=0.03)
    assert abs(float(found.motor.linear.pole) - POLE) < max(2 * found.standard_error["pole_rad_s"], 0.03 * POLE)
    assert abs(float(found.motor.linear.gain) - GAIN) < 0.01 * GAIN
