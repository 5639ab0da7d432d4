"""The robot example: its arc is exact, its gradient is right, and it drives where it should."""

import importlib.util
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxmotor.motor import EFFECTS, FirstOrder, Motor

SCRIPT = Path(__file__).parents[3] / "docs" / "examples" / "robot.py"


@pytest.fixture(scope="module")
def robot():
    spec = importlib.util.spec_from_file_location("robot_example", SCRIPT)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def motor(gain, pole, *effects):
    return Motor(FirstOrder(jnp.asarray(gain), jnp.asarray(pole)), effects)


def test_constant_speeds_drive_a_circle(robot, x64):
    """At steady speeds wl, wr the robot's circle has the radius b/2 (wr + wl)/(wr - wl)."""
    alike = motor(10.0, 400.0)
    way = robot.drive(alike, alike, jnp.tile(jnp.asarray([2.0, 4.0]), (2000, 1)))
    x, y = np.asarray(way.x[100:]), np.asarray(way.y[100:])
    design = np.stack([x, y, np.ones_like(x)], axis=1)
    a, b, c = np.linalg.lstsq(design, x**2 + y**2)[0]
    radius = np.sqrt(c + a**2 / 4 + b**2 / 4)
    assert radius == pytest.approx(robot.TRACK_m / 2 * 60 / 20, rel=1e-6)


def test_the_gradient_is_that_of_differences(robot, x64):
    friction = EFFECTS["coulomb_friction"].of(volts_V=0.2)
    left, right = motor(10.0, 40.0, friction), motor(11.0, 35.0)
    volts = jnp.asarray(2 + np.random.default_rng(0).uniform(0, 2, (60, 2)))

    def end(volts):
        return robot.drive(left, right, volts).y[-1]

    slope = jax.grad(end)(volts)
    for row, column in ((0, 0), (20, 1), (45, 0)):
        change = jnp.zeros_like(volts).at[row, column].set(1e-5)
        difference = (end(volts + change) - end(volts - change)) / 2e-5
        assert float(slope[row, column]) == pytest.approx(float(difference), rel=1e-5)


def test_it_follows_the_path_with_the_motors_it_knows(robot, tmp_path, capsys):
    figure = tmp_path / "robot.png"
    misses = robot.main(["-o", str(figure)])
    assert misses["each as identified"] < 0.001 < 0.02 < misses["motors taken as alike"]
    assert figure.stat().st_size > 10_000 and "mm from the path" in capsys.readouterr().out
