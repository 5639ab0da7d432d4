"""The slow plain plant, and the recording that was made with it."""

import numpy as np
import pytest
from make_linear_recording import PERIOD_S, paper_recording
from scipy.integrate import solve_ivp
from testing.plain_plant import Plant, drive

from jaxmotor.recording import bundled, to_text


def test_the_plant_is_the_papers_equations():
    plant = Plant(step_s=1e-6)
    r, inductance, k = plant.resistance_ohm, plant.inductance_H, plant.torque_constant_V_s
    b, j = plant.friction_N_m_s, plant.inertia_kg_m2

    def slope(_, x):
        return [(5.1 - r * x[0] - k * x[1]) / inductance, (k * x[0] - b * x[1]) / j, x[1]]

    exact = solve_ivp(slope, (0, 0.02), [0, 0, 0], rtol=1e-10, atol=1e-12).y[:, -1]
    plant.hold(5.1, 0.02)
    np.testing.assert_allclose([plant.current_A, plant.speed_rad_s, plant.angle_rad], exact, rtol=1e-3)


def test_gain_and_pole_are_eq_11():
    plant = Plant()
    assert plant.gain == pytest.approx(10.6, abs=0.01) and plant.pole == pytest.approx(40.0, abs=0.1)
    plant.hold(5.0, 0.5)
    assert plant.speed_rad_s == pytest.approx(5.0 * plant.gain, rel=1e-3)


def test_first_the_count_then_the_duty():
    plant = Plant()
    counts = drive(plant, np.array([255, 255, 255]), 7.4 / 255, PERIOD_S)
    assert counts[0] == 0 and counts[2] > counts[1] >= 0


def test_the_bundled_recording_is_the_recipes():
    """Bit for bit (a third of it here would not show the running counter)."""
    recording = bundled("linear")
    assert to_text(paper_recording(Plant())) == to_text(recording)
    assert [segment.kind for segment in recording.segments].count("sine") == 11
    assert "no board" in recording.header["rig"]


def test_the_bundled_recording_gives_the_plants_motor():
    from jaxmotor import identify

    fit = identify(bundled("linear"))
    plant = Plant()
    assert abs(float(fit.motor.gain) - plant.gain) < 3 * float(fit.standard_error.gain)
    assert abs(float(fit.motor.pole) - plant.pole) < 3 * float(fit.standard_error.pole)
    assert float(fit.motor.pole) == pytest.approx(plant.pole, rel=0.01)
