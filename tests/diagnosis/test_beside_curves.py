"""A law that nobody tried, in a log whose noise is not known: what imitates it may leave less than the noise."""

import functools

import numpy as np

from jaxmotor import diagnose
from jaxmotor.recording import Recording, Segment

GAIN, POLE, PERIOD_S, ROWS, STEPS, WINDOW_ROWS = 6.0, 12.0, 0.01, 3000, 20, 3
MOVING_V, STATIC_V, STRIBECK_RAD_S, NOISE = 0.4, 0.6, 2.0, 0.005
WAVES_V, WAVES_HZ = (1.5, 1.2, 0.8), (0.31, 0.83, 1.7)


@functools.cache
def with_static_friction(seed: int) -> Recording:
    """Sines; friction that falls with the speed from its static value, by Euler's method; noisy means over three
    rows."""
    rng = np.random.default_rng(seed)
    time = np.arange(ROWS) * PERIOD_S
    phases = rng.uniform(0, 2 * np.pi, 3)
    waves = zip(WAVES_V, WAVES_HZ, phases, strict=True)
    volts = sum((size * np.sin(2 * np.pi * often * time + phase) for size, often, phase in waves), np.zeros(ROWS))
    step, speed, angle = PERIOD_S / STEPS, 0.0, np.zeros(ROWS * STEPS + 1)
    for k in range(ROWS * STEPS):
        applied = volts[k // STEPS]
        friction = MOVING_V + (STATIC_V - MOVING_V) * np.exp(-((speed / STRIBECK_RAD_S) ** 2))
        way = np.sign(speed) if speed else np.sign(applied) * (abs(applied) > STATIC_V)
        now = speed + step * POLE * (GAIN * (applied - friction * way) - speed) if way else 0.0
        speed = now if now * speed >= 0 else 0.0
        angle[k + 1] = angle[k] + step * speed
    at = np.arange(ROWS) * STEPS
    window_s = WINDOW_ROWS * PERIOD_S
    mean = (angle[at] - angle[np.maximum(at - WINDOW_ROWS * STEPS, 0)]) / window_s
    mean = mean + NOISE * mean.std() * rng.standard_normal(ROWS)
    segment = Segment("other", 0.0, True, {}, time, volts, np.arange(ROWS), speed_rad_s=mean)
    return Recording((segment,), "speeds", PERIOD_S, speed_window_s=window_s, supply_V=6.0, duty_delay_s=0.0)


def test_a_curve_stands_where_a_law_only_imitates():
    """Coulomb friction and quadratic drag leave less than the noise was estimated at: their names were sure."""
    found = diagnose(with_static_friction(3), exclude=("stiction", "bristle_friction"))
    assert {one.name for one in found.effects if one.is_named} == {"coulomb_friction", "torque_over_speed"}
    assert found.verdict == "extended"


def test_a_law_that_is_there_stands_alone():
    found = diagnose(with_static_friction(3))
    [effect] = found.effects
    assert effect.name == "stiction" and effect.is_named and effect.probability > 0.99
    assert abs(effect.parameters["static_volts_V"] - STATIC_V) < 4 * effect.standard_error["static_volts_V"] < 0.2
