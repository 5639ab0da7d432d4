"""A drive that is bent at both ends, driven at two levels in each segment: a curve may pass through each level."""

from collections.abc import Callable

import numpy as np
import pytest
from scipy.signal import lfilter

from jaxmotor import diagnose, identify
from jaxmotor.diagnosis._explain import _carried_over, _searched
from jaxmotor.diagnosis._request import Request
from jaxmotor.diagnosis._weighed import _more_than_ordinary
from jaxmotor.motor.effects import CoulombFriction, SensorLag
from jaxmotor.recording import Recording, Segment

GAIN, POLE, PERIOD_S, ROWS = 2.1, 15.0, 0.01, 240
DEAD_V, MOST_V, SUPPLY_V = 0.8, 5.5, 9.0
HEIGHTS_V = (6.6, 3.1, 6.2, 2.0, 6.4, 4.7, 6.1, 3.6, 6.3)


APART_V = (3.1, 2.0, 8.7, 3.6, 2.6, 8.2, 4.0, 2.9, 8.9)
"""Those of held-out segments, each third one, are far from the others."""


def bent(volts: np.ndarray, dead_V: float = DEAD_V, most_V: float = MOST_V) -> np.ndarray:
    return np.clip(np.sign(volts) * np.maximum(np.abs(volts) - dead_V, 0.0), -most_V, most_V)


def switched(
    height_V: float,
    start_s: float,
    rng: np.random.Generator,
    drive: Callable[[np.ndarray], np.ndarray],
    friction_V: float = 0.0,
) -> Segment:
    """Speeds at the rows, of an exact hold, under a voltage that changes its sign at random; 0.4 % noise."""
    held = np.repeat(rng.choice([-1.0, 1.0], ROWS // 6), 6)
    volts = np.concatenate([[0.0] * 6, height_V * held])[:ROWS]
    keep = np.exp(-POLE * PERIOD_S)
    speed = np.asarray(lfilter([0.0, GAIN * (1 - keep)], [1.0, -keep], drive(volts) - friction_V * np.sign(volts)))
    read = speed + 0.02 * rng.standard_normal(ROWS)
    rows = np.arange(ROWS)
    return Segment("prbs", start_s, True, {}, rows * PERIOD_S, volts, tick=rows, speed_rad_s=read)


def searched(heights_V, frictions_V: float, seed: int, drive=lambda volts: bent(volts, 0.3, SUPPLY_V)):
    """A search for a dead zone or a curve, where friction differs from segment to segment by about `frictions_V`."""
    rng = np.random.default_rng(seed)
    frictions = frictions_V * rng.standard_normal(len(heights_V))
    segments = tuple(
        switched(height, 4.0 * k, rng, drive, friction)
        for k, (height, friction) in enumerate(zip(heights_V, frictions.tolist(), strict=True))
    )
    log = Recording(segments, "levels", PERIOD_S, speed_window_s=0.0, supply_V=SUPPLY_V, duty_delay_s=0.0)
    return _searched(log, identify(log), Request(("dead_zone", "voltage_over_command")), 0)


def test_known_laws_that_carry_over_stand_before_a_curve_that_does_not():
    rng = np.random.default_rng(1)
    segments = tuple(switched(height, 4.0 * k, rng, bent) for k, height in enumerate(HEIGHTS_V))
    about = {"speed_window_s": 0.0, "supply_V": SUPPLY_V, "duty_delay_s": 0.0}
    found = diagnose(Recording(segments, "levels", PERIOD_S, **about))
    assert found.verdict == "extended"
    assert {one.name for one in found.effects if one.is_named} == {"dead_zone", "voltage_saturation"}
    sizes = {one.name: one.parameters["volts_V"] for one in found.effects}
    assert sizes["dead_zone"] == pytest.approx(DEAD_V, rel=0.02)
    assert sizes["voltage_saturation"] == pytest.approx(MOST_V, rel=0.01)


@pytest.mark.usefixtures("x64")
@pytest.mark.parametrize("seed", [1, 3, 4])
def test_a_curve_that_does_not_carry_over_does_not_speak_against_a_law(seed):
    """Friction is a little different in each segment, and so at each level."""
    found = searched(APART_V, 0.004, seed)
    assert 0.4 < found.search.visited.probability("dead_zone") < 0.9
    carried = _carried_over(found)
    assert carried.found.fitted.names == ("dead_zone",)
    assert carried.search.visited.probability("dead_zone") > 0.99


@pytest.mark.usefixtures("x64")
@pytest.mark.parametrize("seed", [1, 3])
def test_a_law_stands_before_a_curve_that_carries_over_no_better(seed):
    """Blocks speak for the curve, which has passed through each level with the friction that was there."""
    found = searched(HEIGHTS_V, 0.01, seed)
    assert found.search.visited.probability("dead_zone") < 0.02
    assert _carried_over(found).found.fitted.names == ("dead_zone",)


def step_from_rest(height_V: float, start_s: float, friction_V: float, rng: np.random.Generator) -> Segment:
    """Of a motor that sticks below 1 V: speeds at the rows, in fine steps of time; 1.5 rad/s of noise as it turns."""
    gain, pole, still_V, fine = 27.0, 44.0, 1.0, 20
    volts, speeds, speed = np.concatenate([np.zeros(10), np.full(110, height_V)]), [], 0.0
    for volt in volts.tolist():
        speeds.append(speed)
        for _ in range(fine):
            if speed or volt > still_V:
                speed += PERIOD_S / fine * pole * (gain * (volt - friction_V) - speed)
    turning, rows = np.array(speeds) > 0, np.arange(len(volts))
    read = np.array(speeds) + 1.5 * rng.normal(size=len(volts)) * turning
    return Segment("step", start_s, True, {}, rows * PERIOD_S, volts, tick=rows, speed_rad_s=read)


@pytest.mark.usefixtures("x64")
def test_a_curve_is_held_against_more_than_the_likeliest_law():
    """Friction differs by a fifth from step to step: what no law explains blocks weigh much alike for all laws, and the
    likeliest of these is not the one that carries over best."""
    rng = np.random.default_rng(1)
    heights_V = (1.2, 12.0, 0.9, 2.4, 9.6, 0.7, 4.8, 3.6, 6.0, 8.4, 10.8, 7.2, 1.1)
    segments = []
    for number, height_V in enumerate(heights_V):
        friction_V = 0.66 * (1 + 0.2 * float(rng.normal()))
        segments.append(step_from_rest(height_V, 3.0 * number, friction_V, rng))
    log = Recording(tuple(segments), "steps", PERIOD_S, speed_window_s=0.0, supply_V=12.0, duty_delay_s=0.0)
    laws = ("coulomb_friction", "stiction", "dead_zone", "input_threshold")
    found = _searched(log, identify(log), Request((*laws, "voltage_over_command")), 0)
    assert found.search.visited.probability("voltage_over_command") > 0.8
    assert {*_carried_over(found).found.fitted.names} <= {*laws}


@pytest.mark.usefixtures("x64")
def test_a_curve_that_carries_over_better_stands():
    """A drive of 6 tanh(u/6) V is no dead zone and no limit."""
    found = searched(HEIGHTS_V, 0.002, 1, lambda volts: 6 * np.tanh(volts / 6))
    assert _carried_over(found).found.fitted.names == ("voltage_over_command",)


def test_a_lag_that_may_be_the_windings_is_hardly_a_cause():
    assert _more_than_ordinary(SensorLag.of(time_constant_s=0.27e-3), {"time_constant_s": 0.02e-3}) < 0.4
    assert _more_than_ordinary(SensorLag.of(time_constant_s=0.5e-3), {"time_constant_s": 0.02e-3}) > 0.999
    assert _more_than_ordinary(CoulombFriction.of(volts_V=0.01), {"volts_V": 0.02}) == 1.0
