"""A drive that is bent at both ends, driven at two levels in each segment: a curve may pass through each level."""

import numpy as np
import pytest
from scipy.signal import lfilter

from jaxmotor import diagnose
from jaxmotor.diagnosis._weighed import _more_than_ordinary
from jaxmotor.motor.effects import CoulombFriction, SensorLag
from jaxmotor.recording import Recording, Segment

GAIN, POLE, PERIOD_S, ROWS = 2.1, 15.0, 0.01, 240
DEAD_V, MOST_V, SUPPLY_V = 0.8, 5.5, 9.0
HEIGHTS_V = (6.6, 3.1, 6.2, 2.0, 6.4, 4.7, 6.1, 3.6, 6.3)


def switched(height_V: float, start_s: float, rng: np.random.Generator) -> Segment:
    """Speeds at the rows, of an exact hold, under a voltage that changes its sign at random; 0.4 % noise."""
    held = np.repeat(rng.choice([-1.0, 1.0], ROWS // 6), 6)
    volts = np.concatenate([[0.0] * 6, height_V * held])[:ROWS]
    drive = np.clip(np.sign(volts) * np.maximum(np.abs(volts) - DEAD_V, 0.0), -MOST_V, MOST_V)
    keep = np.exp(-POLE * PERIOD_S)
    speed = np.asarray(lfilter([0.0, GAIN * (1 - keep)], [1.0, -keep], drive))
    read = speed + 0.02 * rng.standard_normal(ROWS)
    rows = np.arange(ROWS)
    return Segment("prbs", start_s, True, {}, rows * PERIOD_S, volts, tick=rows, speed_rad_s=read)


def test_known_laws_that_carry_over_stand_before_a_curve_that_does_not():
    rng = np.random.default_rng(1)
    segments = tuple(switched(height, 4.0 * k, rng) for k, height in enumerate(HEIGHTS_V))
    about = {"speed_window_s": 0.0, "supply_V": SUPPLY_V, "duty_delay_s": 0.0}
    found = diagnose(Recording(segments, "levels", PERIOD_S, **about))
    assert found.verdict == "extended"
    assert {one.name for one in found.effects if one.is_named} == {"dead_zone", "voltage_saturation"}
    sizes = {one.name: one.parameters["volts_V"] for one in found.effects}
    assert sizes["dead_zone"] == pytest.approx(DEAD_V, rel=0.02)
    assert sizes["voltage_saturation"] == pytest.approx(MOST_V, rel=0.01)


def test_a_lag_that_may_be_the_windings_is_hardly_a_cause():
    assert _more_than_ordinary(SensorLag.of(time_constant_s=0.27e-3), {"time_constant_s": 0.02e-3}) < 0.4
    assert _more_than_ordinary(SensorLag.of(time_constant_s=0.5e-3), {"time_constant_s": 0.02e-3}) > 0.999
    assert _more_than_ordinary(CoulombFriction.of(volts_V=0.01), {"volts_V": 0.02}) == 1.0
