"""Static friction many times the moving one: a finely integrated motor that turns on at a fifth of what starts it."""

import numpy as np
import pytest

from jaxmotor import diagnose
from jaxmotor.recording import Recording, Segment

PERIOD_S, FINE = 0.05, 200
"""Of the mean speeds [s]; and steps of Euler's method in it."""
GAIN, POLE = 90.0, 20.0
"""[rad/s/V, rad/s]"""
MOVING_V, STRIBECK_RAD_S = 0.5, 20.0
STEP_RAD_S = 10.5
"""Of the speeds: counts of the encoder in one period."""
SUPPLY_V = 5.0
FRICTIONS = ("coulomb_friction", "stiction", "dead_zone", "voltage_offset", "quadratic_drag", "coast_drive")


def voltages(rng: np.random.Generator) -> np.ndarray:
    """Levels below and above what starts the motor, and slow ramps through it, each from rest and back."""
    parts = [np.zeros(20)]
    for _ in range(3):
        low, high, slow = rng.uniform(0.8, 2.2), rng.uniform(3.2, 4.5), rng.uniform(0.8, 2.0)
        levels = [np.full(40, low), np.full(60, high), np.full(60, slow), np.zeros(30)]
        ramp = [np.linspace(rng.uniform(0.5, 1.5), rng.uniform(3.5, 4.5), 100), np.linspace(3.0, 0.3, 80), np.zeros(30)]
        parts += levels + ramp
    return np.concatenate(parts)


def log(seed: int, static_V: float) -> Recording:
    rng = np.random.default_rng(seed)
    volts, step, now = voltages(rng), PERIOD_S / FINE, 0.0
    read = np.zeros(len(volts))
    for row, volt in enumerate(volts[:-1]):
        turned = 0.0
        for _ in range(FINE):
            near_rest = np.exp(-((now / STRIBECK_RAD_S) ** 2))
            friction = GAIN * (MOVING_V + (static_V - MOVING_V) * near_rest)
            drive = GAIN * volt
            if now == 0.0 and abs(drive) <= friction:
                continue
            new = now + step * POLE * (drive - now - friction * (np.sign(now) or np.sign(drive)))
            now = 0.0 if new * now < 0 else new
            turned += step * now
        read[row + 1] = turned / PERIOD_S
    counted = np.diff(np.floor(np.cumsum(read) / STEP_RAD_S), prepend=0.0) * STEP_RAD_S
    rows = np.arange(len(volts))
    segment = Segment("other", 0.0, True, {}, rows * PERIOD_S, volts, tick=rows, speed_rad_s=counted)
    return Recording((segment,), "firm rest", PERIOD_S, speed_window_s=PERIOD_S, supply_V=SUPPLY_V)


@pytest.mark.parametrize(("seed", "static_V"), [(1, 2.6), (2, 3.0)])
def test_a_motor_that_starts_at_far_more_than_it_turns_at_has_stiction(seed, static_V):
    found = diagnose(log(seed, static_V), effects=FRICTIONS)
    by_name = {one.name: one for one in found.effects}
    assert set(by_name) == {"stiction"} and by_name["stiction"].is_named
    sizes = by_name["stiction"].parameters
    assert sizes["volts_V"] == pytest.approx(MOVING_V, rel=0.1)
    assert sizes["static_volts_V"] == pytest.approx(static_V, rel=0.05)
    assert float(found.motor.linear.gain) == pytest.approx(GAIN, rel=0.02)
