"""Motors for the tests of the plant, and what a linear one does by closed form."""

import numpy as np
from scipy import linalg
from testing.plant import Plant

MEAN = "[bench]\npwm_edges = false\n"
FIRST_ORDER = MEAN + "[motor]\ninductance_H = 0\n"
V, K, A, T = 7.4, 10.6, 40.0, 0.005
HALF = 125


def steady_speed(plant: str, duty: int = HALF, drive: int = 0, ticks: int = 300) -> float:
    with Plant(plant) as p:
        return p.sequence([duty] * ticks, drive=drive).speed[-1]


def exact(plant: Plant, duty, period=T):
    """(speed, angle) of the linear motor with inductance: zero-order hold by matrix exponential."""
    m = plant.linear
    inductance = m.electrical_time_constant * m.resistance
    a = np.array(
        [
            [-m.resistance / inductance, -m.torque_constant / inductance, 0],
            [m.torque_constant / m.inertia, -m.damping / m.inertia, 0],
            [0, 1, 0],
        ]
    )
    block = np.zeros((4, 4))
    block[:3, :3] = a * period
    block[0, 3] = period / inductance
    phi = linalg.expm(block)
    x, states = np.array([0, 0, plant.angle]), []
    for d in duty:
        states.append(x)
        x = phi[:3, :3] @ x + phi[:3, 3] * (V * d / 250)
    return np.array(states)[:, 1:].T
