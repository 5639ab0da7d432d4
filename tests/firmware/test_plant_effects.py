"""The plant's effects one at a time, by what each does to a steady state."""

import math

import numpy as np
import pytest
from plant_cases import FIRST_ORDER, HALF, MEAN, A, K, V, exact, steady_speed
from testing.plant import COAST, Plant

pytestmark = pytest.mark.usefixtures("plant_library")


@pytest.mark.parametrize(
    ("effect", "volts"),
    [
        ("", 3.7),
        ("[dead_zone]\nvolts_V = 0.5", 3.2),
        ("[input_threshold]\nvolts_V = 3.6", 3.7),
        ("[input_threshold]\nvolts_V = 3.8", 0),
        ("[voltage_offset]\nvolts_V = -0.3", 3.4),
        ("[voltage_saturation]\nvolts_V = 2.2", 2.2),
        ("[direction_asymmetry]\nratio = 0.1", 4.07),
        ("[load_torque]\nvolts_V = 0.4", 3.3),
        ("[coulomb_friction]\nvolts_V = 0.4", 3.3),
        ("[battery]\nvolts_V = 6.0", 3.0),
        ("[wiring]\nmotor_swapped = true", -3.7),
        ("[dead_zone]\nvolts_V = 0.5\n[load_torque]\nvolts_V = 0.2", 3.0),
    ],
)
@pytest.mark.parametrize("mode", [MEAN, ""])
def test_steady_speed(effect, volts, mode):
    # With pulses the speed at the tick differs from its mean by the ripple.
    assert steady_speed(mode + effect + "\n") == pytest.approx(K * volts, rel=1e-3 if not mode else 1e-5, abs=1e-9)


def test_asymmetry_is_one_way():
    assert steady_speed(MEAN + "[direction_asymmetry]\nratio = 0.1\n", -HALF) == pytest.approx(-K * 3.7 * 0.9)


def test_quadratic_drag():
    c = 2e-4
    w = steady_speed(MEAN + f"[quadratic_drag]\nvolts_V_s2_rad2 = {c}\n")
    assert w == pytest.approx(K * (3.7 - c * w * w), rel=1e-6)


def test_supply_sag():
    """u = D (Vs - Rs |D i|)."""
    with Plant(MEAN + "[supply_sag]\nratio = 0.2\n[motor]\nviscous_share = 0.2\n") as p:
        run = p.sequence([HALF] * 400)
        m, i = p.linear, p.current
        volts = 0.5 * (V - 0.2 * m.resistance * 0.5 * i)
        assert run.speed[-1] == pytest.approx(m.gain * volts, rel=1e-6)
        assert i * m.torque_constant == pytest.approx(m.damping * run.speed[-1], rel=1e-5)
        assert p.supply == pytest.approx(V - 0.2 * m.resistance * 0.5 * i, rel=1e-6)


def test_battery_droops_with_the_charge_drawn():
    plant = "[battery]\ndroop_V_per_As = 0.5\n[motor]\nviscous_share = 0.3\n"
    with Plant(MEAN + plant) as p:
        supply = np.zeros(400)
        run = p.sequence([250] * 400, supply=supply)
    assert 5 < supply[-1] < supply[200] < V
    assert run.speed[-1] < 0.99 * run.speed[150]


def test_supply_drift():
    with Plant(MEAN + "[supply_drift]\nrate_per_s = 0.02\n") as p:
        p.sequence([HALF] * 2000)
        now = p.sequence([HALF]).speed[0]
    # The speed follows the ramp 1/a behind.
    assert now == pytest.approx(K * 3.7 * (1 - 0.02 * (10 - 1 / A)), rel=1e-5)


def test_current_limit():
    """A stalled start: the torque is that of the limit until the back-EMF has come up."""
    with Plant(MEAN + "[current_limit]\nvolts_V = 1.5\n") as p:
        run = p.sequence([250] * 5, period_s=0.001)
        m = p.linear
    acceleration = m.torque_constant * 1.5 / m.resistance / m.inertia
    # The viscous share of the pole takes a little: 40 rad/s x 0.045 x the speed.
    assert run.speed[4] - run.speed[1] == pytest.approx(0.003 * acceleration, rel=0.01)


def test_electrical_pole_takes_the_place_of_the_inductance(excitation):
    with Plant(MEAN + "[electrical_pole]\ntime_constant_s = 0.003\n") as p:
        assert p.linear.electrical_time_constant == pytest.approx(0.003)
        speed, _ = exact(p, excitation)
        assert np.abs(p.sequence(excitation).speed - speed).max() < 1e-6


def test_a_very_short_winding_time_constant_is_stable(excitation):
    with Plant(MEAN + "[electrical_pole]\ntime_constant_s = 2e-6\n") as p, Plant(FIRST_ORDER) as q:
        assert np.abs(p.sequence(excitation).speed - q.sequence(excitation).speed).max() < 0.02


def test_coast_drive_steady_state():
    """Back-EMF and volts act for the share D, friction and its viscous part beta for all of the time."""
    beta, friction = 0.045, 0.3
    for duty in (50, 125, 250):
        share = duty / 250
        expected = K * (share * V - friction) / (share * (1 - beta) + beta)
        w = steady_speed(MEAN + f"[coast_drive]\n[coulomb_friction]\nvolts_V = {friction}\n", duty, ticks=2000)
        assert w == pytest.approx(expected, rel=1e-5)
        # Asked for by the bridge instead of hidden in the plant: the same law.
        asked = steady_speed(MEAN + f"[coulomb_friction]\nvolts_V = {friction}\n", duty, COAST, ticks=2000)
        assert asked == w


def test_coasting_leaves_only_the_viscous_friction():
    with Plant(MEAN) as p:
        p.sequence([250] * 200)
        w = p.sequence([0] * 101, drive=COAST).speed
    assert w[100] / w[0] == pytest.approx(math.exp(-A * 0.045 * 0.5), rel=1e-5)


def test_coast_pulses_are_faster_than_brake_pulses_and_flow_one_way():
    brake, coast = steady_speed("", 50), steady_speed("", 50, COAST, ticks=3000)
    assert coast > 2 * brake
    with Plant() as p:
        currents = []
        for _ in range(400):
            p.hold(0.2, 250e-6, COAST)
            currents.append(p.current)
    assert min(currents) >= 0


def test_winding_heating_moves_the_pole_and_keeps_the_gain():
    plant = MEAN + "[winding_heating]\nrise_ratio = 2.0\ntime_constant_s = 0.5\n[motor]\nviscous_share = 0.001\n"
    with Plant(plant + "[wiring]\njammed_at_s = 0.0\n") as p:
        p.sequence([125] * 2000)
        # i^2 R / (Vs^2 / R0) at standstill with half the supply is R0 / (4 R)
        hot = p.resistance / 4.5
    assert hot - 1 == pytest.approx(2.0 / (4 * hot), rel=1e-3)
    w = steady_speed(plant, ticks=3000)
    assert w == pytest.approx(K * 3.7, rel=2e-3)
