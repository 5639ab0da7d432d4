"""What the plant's encoder shows: eccentricity, missed counts, lag, swapped wires."""

import math

import numpy as np
import pytest
from plant_cases import MEAN
from testing.plant import Plant

pytestmark = pytest.mark.usefixtures("plant_library")


def test_eccentricity():
    amplitude, cycles, phase = 0.05, 1, 0.4
    plant = f"[encoder_eccentricity]\namplitude_rad = {amplitude}\ncycles_per_rev = {cycles}\nphase_rad = {phase}\n"
    with Plant(MEAN + plant) as p:
        run = p.sequence([50] * 400)
    read = run.count * 2 * np.pi / 617.4 - (run.angle - run.angle[0])
    error = amplitude * (np.sin(run.angle + phase) - math.sin(run.angle[0] + phase))
    assert np.abs(read - error).max() < 2 * np.pi / 617.4


def test_missed_counts():
    with Plant(MEAN + "[missed_counts]\nratio = 0.1\nspeed_rad_s = 30\n") as p:
        run = p.sequence([60] * 200 + [200] * 200)
    per_rad = 617.4 / (2 * np.pi)
    slow, fast = run.count[199] - run.count[100], run.count[399] - run.count[300]
    assert slow == pytest.approx((run.angle[199] - run.angle[100]) * per_rad, abs=1.1)
    assert fast == pytest.approx(0.9 * (run.angle[399] - run.angle[300]) * per_rad, abs=1.1)


def test_sensor_lag():
    with Plant(MEAN + "[sensor_lag]\ntime_constant_s = 0.02\n") as p:
        run = p.sequence([125] * 400)
    behind = run.angle[-1] - run.angle[0] - run.count[-1] * 2 * np.pi / 617.4
    assert behind == pytest.approx(0.02 * run.speed[-1], abs=2 * np.pi / 617.4)


@pytest.mark.parametrize(("key", "sign"), [("encoder_swapped", -1), ("motor_swapped", -1)])
def test_swapped_wires(key, sign):
    with Plant(MEAN + f"[wiring]\n{key} = true\n") as p, Plant(MEAN) as q:
        a, b = p.sequence([100] * 100).count[-1], q.sequence([100] * 100).count[-1]
    assert a == pytest.approx(sign * b, abs=1)
