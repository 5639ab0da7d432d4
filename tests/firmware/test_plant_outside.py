"""What moves the plant from outside its vocabulary of effects."""

import numpy as np
import pytest
from plant_cases import FIRST_ORDER, HALF, MEAN, A, K, T
from testing.plant import Plant

pytestmark = pytest.mark.usefixtures("plant_library")


def test_late_load():
    with Plant(MEAN + "[late_load]\nstart_s = 2.0\nvolts_V = 0.5\n") as p:
        run = p.sequence([HALF] * 800)
    assert run.speed[399] == pytest.approx(K * 3.7, rel=1e-6)
    assert run.speed[-1] == pytest.approx(K * 3.2, rel=1e-6)


def test_outside_torque():
    f, volts = 3.3, 0.4
    with Plant(FIRST_ORDER + f"[outside_torque]\nfrequency_Hz = {f}\nvolts_V = {volts}\n") as p:
        run = p.sequence([HALF] * 2000)
    w = 2 * np.pi * f
    tone = 2 * np.mean((run.speed - K * 3.7)[-1000:] * np.exp(-1j * w * T * np.arange(1000, 2000)))
    assert abs(tone) == pytest.approx(K * volts / abs(1 + 1j * w / A), rel=0.01)


def test_wandering_torque():
    volts = []
    for seed in range(8):
        wander = f"[wandering_torque]\nvolts_V = 0.4\ntime_constant_s = 0.5\n[bench]\nseed = {seed}\n"
        with Plant(FIRST_ORDER + wander) as p:
            volts.append(p.sequence([HALF] * 2000).speed[100:] / K - 3.7)
    spread = np.std(volts)
    assert 0.3 < spread < 0.5
    lag = round(0.5 / T)
    pairs = np.array(volts)
    correlation = np.mean(pairs[:, lag:] * pairs[:, :-lag]) / spread**2
    assert 0.15 < correlation < 0.6  # exp(-1)
