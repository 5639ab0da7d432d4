"""The plant without effects against closed forms and the exact hold, and its encoder."""

import math

import numpy as np
import pytest
from plant_cases import FIRST_ORDER, MEAN, A, K, T, V, exact
from testing.plant import Plant

pytestmark = pytest.mark.usefixtures("plant_library")


def test_linear_values_are_those_of_the_file():
    with Plant("[motor]\ngain_rad_s_V = 11\npole_rad_s = 31\nviscous_share = 0.06\nresistance_ohm = 3\n") as p:
        m = p.linear
    assert m.gain == pytest.approx(11) and m.pole == pytest.approx(31)
    total = m.damping * m.resistance + m.torque_constant**2
    assert m.damping * m.resistance / total == pytest.approx(0.06)
    with Plant("[motor]\ntorque_constant_Nm_A = 0.09\ninertia_kgm2 = 5e-5\ndamping_Nms = 1e-4\n") as p:
        assert p.linear.gain == pytest.approx(0.09 / (1e-4 * 4.5 + 0.09**2))


def test_second_order_motor_is_exact(excitation):
    with Plant(MEAN) as p:
        speed, angle = exact(p, excitation)
        run = p.sequence(excitation)
    assert np.abs(run.speed - speed).max() < 2e-6 * np.abs(speed).max()
    assert np.abs(run.angle - angle).max() < 1e-6


def test_first_order_motor_is_exact(excitation):
    p_, g = math.exp(-A * T), (1 - math.exp(-A * T)) / (A * T)
    with Plant(FIRST_ORDER) as p:
        run = p.sequence(excitation)
    w, angle = 0.0, run.angle[0]
    for k, u in enumerate(excitation * V / 250):
        assert run.speed[k] == pytest.approx(w, abs=1e-7)
        assert run.angle[k] == pytest.approx(angle, abs=1e-8)
        angle += T * (g * w + K * (1 - g) * u)
        w = p_ * w + K * (1 - p_) * u


def test_pulses_mean_what_their_duty_says(excitation):
    with Plant() as edges, Plant(MEAN) as mean:
        a, b = edges.sequence(excitation), mean.sequence(excitation)
    # A centred pulse has the mean's zeroth and first moments; what is left is its second, 1e-4 rad here.
    assert np.abs(a.angle - b.angle).max() < 3e-4
    counts = a.count - b.count
    assert np.abs(counts).max() <= 1


def test_delay_of_the_duty(excitation):
    """A duty 2 ms late is 2/5 of the tick the old one."""
    with Plant(MEAN + "[transport_delay]\ndelay_s = 0.002\n") as p, Plant(MEAN) as q:
        fine = np.repeat(excitation, 5)
        fine = np.concatenate(([0, 0], fine[:-2]))
        late, reference = p.sequence(excitation), q.sequence(fine, period_s=0.001)
    assert np.abs(late.angle - reference.angle[::5]).max() < 1e-9
    with Plant(MEAN) as p:
        board = p.sequence(excitation, delay_s=0.002)
    assert np.abs(late.angle - board.angle).max() < 1e-9


def test_counts_are_the_angle_rounded_down(excitation):
    with Plant("[encoder]\nstart_fraction = 0.25\n") as p:
        run = p.sequence(excitation)
    expected = np.floor((run.angle - run.angle[0]) * 617.4 / (2 * np.pi) + 0.25)
    assert np.array_equal(run.count, expected)


def test_edges_come_in_order_and_where_the_angle_says():
    with Plant(MEAN + "[encoder]\nstart_fraction = 0.0\n") as p:
        p.sequence([250] * 200)
        count, speed = p.count, p.speed
        edges = p.hold(1.0, 0.01)
    times, counts = np.array(edges).T
    assert np.array_equal(counts, np.arange(count + 1, count + 1 + len(counts)))
    assert np.all(np.diff(times) > 0)
    assert np.diff(times) == pytest.approx(2 * np.pi / 617.4 / speed, rel=1e-4)
