"""The plant's cogging, compliance and backlash against scipy's integrator and linear systems."""

import math

import numpy as np
import pytest
from plant_cases import FIRST_ORDER, A, K, T, V
from scipy import integrate, linalg
from testing.plant import COAST, Plant

pytestmark = pytest.mark.usefixtures("plant_library")


def test_cogging_against_scipy():
    volts, cycles, phase = 0.5, 6, 0.7
    plant = FIRST_ORDER + f"[cogging]\nvolts_V = {volts}\ncycles_per_rev = {cycles}\nphase_rad = {phase}\n"
    with Plant(plant) as p:
        run = p.sequence([60] * 100)

    def rate(t, x):
        return [x[1], A * (K * (60 / 250 * V - volts * math.sin(cycles * x[0] + phase)) - x[1])]

    t = T * np.arange(100)
    solution = integrate.solve_ivp(rate, (0, 0.5), [run.angle[0], 0], "DOP853", t, rtol=1e-11, atol=1e-11)
    assert np.abs(run.angle - solution.y[0]).max() < 1e-6


def test_compliance_against_a_state_space_model(excitation):
    f, zeta, ratio = 18.0, 0.05, 0.4
    plant = f"[shaft_compliance]\nfrequency_Hz = {f}\ndamping_ratio = {zeta}\ninertia_ratio = {ratio}\n"
    with Plant(FIRST_ORDER + plant) as p:
        run = p.sequence(excitation)
    w = 2 * np.pi * f
    k, c = ratio * w**2, 2 * zeta * w * ratio  # per rotor inertia
    a = np.array([[-A - c, c, -k], [c / ratio, -c / ratio, k / ratio], [1, -1, 0]])
    block = np.zeros((4, 4))
    block[:3, :3], block[0, 3] = a * T, A * K * T
    phi = linalg.expm(block)
    x = np.zeros(3)
    for row, u in enumerate(excitation * V / 250):
        assert run.speed[row] == pytest.approx(x[0], abs=1e-5)
        x = phi[:3, :3] @ x + phi[:3, 3] * u


def test_backlash_gap_is_free_and_contact_conserves_momentum():
    gap, ratio = 0.2, 0.5
    plant = f"[backlash]\ngap_rad = {gap}\ninertia_ratio = {ratio}\n"
    # Without friction and with the winding open nothing acts on the two masses but the contact.
    with Plant(FIRST_ORDER + plant + "[motor]\nviscous_share = 0\n") as p:
        p.sequence([250] * 2, period_s=0.0005)
        assert p.load_speed == 0 and p.angle - p.load_angle < gap / 2
        momentum = p.speed
        p.sequence([0] * 4000, drive=COAST, period_s=0.001)
        assert p.load_speed > 0
        assert p.speed + ratio * p.load_speed == pytest.approx(momentum, rel=1e-9)
        assert abs(p.angle - p.load_angle) < gap / 2 * 1.5


def test_backlash_against_scipy():
    gap, ratio, swing, zeta = 0.08, 0.6, 2 * np.pi * 90, 0.3
    k, c = ratio * swing**2, 2 * zeta * swing * ratio  # per rotor inertia
    duty = np.repeat([200, -200, 120, -60], 15)
    with Plant(FIRST_ORDER + f"[backlash]\ngap_rad = {gap}\ninertia_ratio = {ratio}\n") as p:
        start = p.angle
        run = p.sequence(duty)

    def rate(t, x):
        angle, speed, load_angle, load_speed = x
        twist = angle - load_angle
        beyond = np.sign(twist) * max(abs(twist) - gap / 2, 0)
        push = k * beyond + c * (speed - load_speed) if beyond else 0
        push = push if push * beyond > 0 else 0
        volts = duty[min(int(t / T + 1e-9), len(duty) - 1)] * V / 250
        return [speed, A * (K * volts - speed) - push, load_speed, push / ratio]

    times = T * np.arange(len(duty))
    solution = integrate.solve_ivp(
        rate, (0, times[-1]), [start, 0, start, 0], "RK23", times, max_step=5e-5, rtol=1e-8, atol=1e-10
    )
    assert np.abs(run.angle - solution.y[0]).max() < 5e-4
    assert np.ptp(run.angle) > 2


def test_backlash_in_contact_is_one_mass():
    plant = "[backlash]\ngap_rad = 0.05\ninertia_ratio = 1.0\n"
    with Plant(FIRST_ORDER + plant) as p:
        run = p.sequence([250] * 200)
    slow = run.speed[60] / run.speed[-1]
    assert slow == pytest.approx(1 - math.exp(-A / 2 * 0.3), abs=0.01)
