"""The Kalman filter: its gain is scipy's, and on the plant it beats the count difference as it says."""

import numpy as np
import pytest
from models import HARDWARE, model
from scipy.linalg import solve_discrete_are
from testing.plant import Plant

from jaxmotor import JaxmotorError
from jaxmotor.control import design_estimator, estimate_motion
from jaxmotor.control._estimator import _process_noise

DUTIES = np.round(
    150 * np.sin(2 * np.pi * 1.003 * np.arange(800) * 0.005) + 60 * np.sin(2 * np.pi * 3.1 * np.arange(800) * 0.005)
).astype(int)
FRICTION = (("coulomb_friction", {"volts_V": 0.3}), ("dead_zone", {"volts_V": 0.2}))


def run(toml, delay_s=40e-6):
    with Plant("[motor]\ninductance_H = 0\n" + toml) as plant:
        return plant.sequence(DUTIES, period_s=0.005, delay_s=delay_s)


@pytest.mark.parametrize("lag", [None, 0.004])
def test_the_gain_is_the_riccati_equations(lag):
    estimator = design_estimator(model(lag=lag).whole, HARDWARE)
    a = np.asarray(estimator.transition)
    drive = np.asarray(estimator.old_drive + estimator.new_drive)
    per_tick = 0.02 * 7.4 * np.sqrt(0.005 * 40)
    c = np.zeros((1, len(a)))
    c[0, -2] = 1.0
    noise, variance = _process_noise(drive, per_tick, HARDWARE), HARDWARE.count_rad**2 / 12
    covariance = solve_discrete_are(a.T, c.T, noise, [[variance]])
    gain = covariance @ c.T / (c @ covariance @ c.T + variance)
    np.testing.assert_allclose(estimator.correction, gain[:, 0], rtol=1e-6)


def test_it_knows_the_friction_and_beats_the_count_difference(plant_library):
    seen = run("[coulomb_friction]\nvolts_V = 0.3\n[dead_zone]\nvolts_V = 0.2\n")
    volts = DUTIES * HARDWARE.step_V
    knowing = estimate_motion(design_estimator(model(*FRICTION).whole, HARDWARE), seen.count, volts, HARDWARE)
    ignorant = estimate_motion(design_estimator(model().whole, HARDWARE), seen.count, volts, HARDWARE)
    difference = np.diff(seen.count, prepend=seen.count[0]) / HARDWARE.counts_per_tick

    def error(speed):
        return np.sqrt(np.mean((speed - seen.speed) ** 2))

    stated = float(design_estimator(model(*FRICTION).whole, HARDWARE).standard_deviation[0])
    assert error(knowing.speed) < min(stated, 0.3 * error(difference))
    assert error(knowing.speed) < 0.75 * error(ignorant.speed)
    assert np.abs(knowing.angle - (seen.angle - seen.angle[0])).max() < 1.5 * HARDWARE.count_rad


def test_a_load_that_the_model_lacks_is_found(plant_library):
    seen = run("[load_torque]\nvolts_V = 0.5\n")
    found = estimate_motion(design_estimator(model().whole, HARDWARE), seen.count, DUTIES * HARDWARE.step_V, HARDWARE)
    assert found.missing_V[200:].mean() == pytest.approx(-0.5, abs=0.03)


def test_a_delay_is_taken_along(plant_library):
    seen = run("[transport_delay]\ndelay_s = 0.0085\n")
    volts = DUTIES * HARDWARE.step_V
    late = design_estimator(model(("transport_delay", {"delay_s": 0.0085})).whole, HARDWARE)
    on_time = design_estimator(model().whole, HARDWARE)
    errors = [np.std(estimate_motion(e, seen.count, volts, HARDWARE).speed - seen.speed) for e in (late, on_time)]
    assert late.late == 1 and errors[0] < 0.85 * errors[1]


def test_nonsense_is_a_sentence():
    estimator = design_estimator(model().whole, HARDWARE)
    with pytest.raises(JaxmotorError, match="one voltage per count"):
        estimate_motion(estimator, np.zeros(4), np.zeros(5), HARDWARE)
    with pytest.raises(JaxmotorError, match="not positive"):
        design_estimator(model().whole, HARDWARE, disturbance_V=0.0)


def test_a_motor_that_turns_against_the_voltage_is_its_mirror_image():
    volts = DUTIES * HARDWARE.step_V
    rng = np.random.default_rng(0)
    count = np.cumsum(rng.integers(-20, 21, len(volts)))
    ahead, back = (design_estimator(model(*FRICTION, gain=gain).whole, HARDWARE) for gain in (10.6, -10.6))
    one = estimate_motion(ahead, count, volts, HARDWARE)
    other = estimate_motion(back, -count - 1, volts, HARDWARE)
    np.testing.assert_allclose(other.speed, -one.speed, atol=1e-9 * np.abs(one.speed).max())
