"""Friction and stiction of the plant against closed forms."""

import math

import numpy as np
import pytest
from plant_cases import FIRST_ORDER, MEAN, A, K, T, V, steady_speed
from testing.plant import Plant

pytestmark = pytest.mark.usefixtures("plant_library")


def test_friction_stops_when_it_should():
    """w' = -a (w + K f): standstill after ln(1 + w0 / (K f)) / a."""
    friction = 0.5
    with Plant(FIRST_ORDER + f"[coulomb_friction]\nvolts_V = {friction}\n") as p:
        p.sequence([250] * 400)
        began = p.speed
        assert began == pytest.approx(K * (V - friction), rel=1e-6)
        stop = math.log(1 + began / (K * friction)) / A
        run = p.sequence([0] * 400, period_s=0.001)
    moving = int(stop / 0.001)
    assert run.speed[moving] > 0 and np.all(run.speed[moving + 1 :] == 0)
    turned = (began + K * friction) * (1 - math.exp(-A * stop)) / A - K * friction * stop
    assert run.angle[-1] - run.angle[0] == pytest.approx(turned, rel=1e-6)


def test_friction_holds_up_to_its_size():
    plant = MEAN + "[coulomb_friction]\nvolts_V = 0.74\n"
    assert steady_speed(plant, duty=25) == 0
    assert steady_speed(plant, duty=-25) == 0
    assert steady_speed(plant, duty=26) == pytest.approx(K * (26 / 250 * V - 0.74), rel=1e-3)


def test_stiction_needs_more_to_start_than_to_keep_on():
    plant = MEAN + "[stiction]\nvolts_V = 0.3\nstatic_volts_V = 0.6\nstribeck_speed_rad_s = 1.0\n"
    held, moves = 20, 21  # 0.592 and 0.622 V
    assert steady_speed(plant, held) == 0
    assert steady_speed(plant, moves) == pytest.approx(K * (0.6216 - 0.3), rel=2e-3)
    with Plant(plant) as p:
        p.sequence([60] * 100)
        assert p.sequence([held] * 300).speed[-1] == pytest.approx(K * (0.592 - 0.3), rel=2e-3)


def test_friction_under_a_sine_is_exact():
    """The first-order motor's exponentials from stop to stop, in closed form."""
    friction, volts, w = 0.4, 2.0, 2 * np.pi * 3.0
    duty = np.round(250 * volts / V * np.sin(w * T * np.arange(200))).astype(int)
    with Plant(FIRST_ORDER + f"[coulomb_friction]\nvolts_V = {friction}\n") as p:
        run = p.sequence(duty)
    speed, angle = 0.0, run.angle[0]
    for k, u in enumerate(duty * V / 250):
        assert run.angle[k] == pytest.approx(angle, abs=2e-6)
        assert run.speed[k] == pytest.approx(speed, abs=2e-4)
        left = T
        while left > 1e-15:
            if speed == 0 and abs(u) <= friction:
                break
            way = math.copysign(1, speed if speed else u)
            end = K * (u - way * friction)
            stop = math.inf if speed * end >= 0 else math.log(1 - speed / end) / A
            h = min(left, stop)
            decay = math.exp(-A * h)
            angle += end * h + (speed - end) * (1 - decay) / A
            speed = 0.0 if h == stop else end + (speed - end) * decay
            left -= h
