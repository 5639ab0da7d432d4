"""Laws that show in few rows, beside others that show in all: a finely integrated motor, noise on its mean speeds."""

import functools
from typing import NamedTuple

import numpy as np
import pytest

from jaxmotor import Diagnosis, diagnose
from jaxmotor.recording import Recording, Segment

GAIN, POLE = 3.0, 15.0
"""[rad/s/V, rad/s]"""
STRIBECK_RAD_S, LOST = 4.0, 0.1
PERIOD_S, FINE, ROWS = 0.01, 40, 6000
SIGMA_RAD_S = 0.05


class Truth(NamedTuple):
    """What is hidden."""

    dead_V: float = 0.6
    moving_V: float = 0.3
    static_V: float = 0.3
    offset_V: float = 0.0
    drag_V_s2_rad2: float = 0.0
    above_rad_s: float = 24.0


def log(seed: int, truth: Truth) -> Recording:
    """Levels that are held, one in thirty of them so high that counts are lost; Euler's method in steps of 0.25 ms."""
    rng = np.random.default_rng(seed)
    lengths = rng.integers(40, 120, ROWS // 40)
    levels = rng.uniform(-6, 6, len(lengths))
    levels[10::30] = rng.choice([-1, 1], len(levels[10::30])) * rng.uniform(9.0, 9.5, len(levels[10::30]))
    volts = np.concatenate([[0.0], np.repeat(levels, lengths)])[:ROWS]
    step, now, read = PERIOD_S / FINE, 0.0, np.zeros(ROWS)
    for row, volt in enumerate(volts[:-1]):
        drive = GAIN * np.sign(volt) * max(abs(volt) - truth.dead_V, 0.0) + GAIN * truth.offset_V
        turned = 0.0
        for _ in range(FINE):
            near_rest = np.exp(-((now / STRIBECK_RAD_S) ** 2))
            friction = GAIN * (truth.moving_V + (truth.static_V - truth.moving_V) * near_rest)
            if now == 0.0 and abs(drive) <= friction:
                continue
            drag = GAIN * truth.drag_V_s2_rad2 * now * abs(now)
            new = now + step * POLE * (drive - now - drag - friction * (np.sign(now) or np.sign(drive)))
            now = 0.0 if friction and new * now < 0 else new
            turned += step * now * (1 - LOST if abs(now) > truth.above_rad_s else 1.0)
        read[row + 1] = turned / PERIOD_S
    read += SIGMA_RAD_S * rng.standard_normal(ROWS)
    segment = Segment("other", 0.0, True, {}, np.arange(ROWS) * PERIOD_S, volts, tick=np.arange(ROWS), speed_rad_s=read)
    stated = {"speed_window_s": PERIOD_S, "duty_delay_s": 0.0, "supply_V": 12.0, "counts_per_rev": 1920.0}
    return Recording((segment,), "few rows", PERIOD_S, **stated)


@functools.cache
def found(seed: int, truth: Truth) -> Diagnosis:
    with_drag, with_friction = ("voltage_offset", "quadratic_drag"), ("dead_zone", "coulomb_friction", "stiction")
    asked = with_drag if truth.drag_V_s2_rad2 else with_friction
    return diagnose(log(seed, truth), effects=(*asked, "missed_counts"))


@pytest.mark.parametrize(("seed", "above_rad_s"), [(1, 24.0), (2, 24.0), (2, 24.6)])
def test_lost_counts_are_found_where_few_rows_are_that_fast(seed, above_rad_s):
    by_name = {one.name: one for one in found(seed, Truth(above_rad_s=above_rad_s)).effects}
    assert by_name["dead_zone"].is_named and by_name["missed_counts"].is_named
    lost = by_name["missed_counts"].parameters
    assert (lost["ratio"], lost["speed_rad_s"]) == pytest.approx((LOST, above_rad_s), rel=0.04)


@pytest.mark.parametrize("static_V", [0.3, 0.45])
@pytest.mark.parametrize("seed", [1, 2])
def test_static_friction_is_found_where_it_is_beside_what_imitates_a_part_of_it(seed, static_V):
    truth = Truth(static_V=static_V)
    by_name = {one.name: one for one in found(seed, truth).effects}
    friction = "stiction" if static_V > truth.moving_V else "coulomb_friction"
    assert set(by_name) == {"dead_zone", friction, "missed_counts"}
    assert by_name["dead_zone"].parameters["volts_V"] == pytest.approx(truth.dead_V, rel=0.1)
    assert by_name[friction].parameters["volts_V"] == pytest.approx(truth.moving_V, rel=0.1)
    if friction == "stiction":
        assert by_name[friction].parameters["static_volts_V"] == pytest.approx(static_V, rel=0.1)


@pytest.mark.parametrize("seed", [1, 2])
def test_a_drag_is_found_beside_counts_that_are_lost_at_speed(seed):
    truth = Truth(0.0, 0.0, 0.0, offset_V=0.12, drag_V_s2_rad2=5e-4, above_rad_s=14.0)
    by_name = {one.name: one for one in found(seed, truth).effects}
    assert set(by_name) == {"voltage_offset", "quadratic_drag", "missed_counts"}
    drag = by_name["quadratic_drag"].parameters["volts_V_s2_rad2"]
    assert drag == pytest.approx(truth.drag_V_s2_rad2, rel=0.1)
