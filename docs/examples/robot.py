"""A robot from two identified motors: a differentiable simulation of a differential drive, and voltages for a path.

    python docs/examples/robot.py [LEFT.json RIGHT.json] [-o robot.png]

Each wheel turns as its motor's model says, sample by sample under the held voltage. With the angles dl and dr that the
wheels (radius r, track b) turn in a tick, the robot moves on an arc of

    ds = r (dl + dr)/2,    dphi = r (dr - dl)/b,    x += ds sinc(dphi/2) cos(phi + dphi/2),    y += ... sin(...)

exactly. All of it is JAX: the voltages that follow a path come from its Jacobian. Motors have to be identified with
the robot's load on them, its wheels on the floor.
"""

import argparse
from pathlib import Path
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import optimistix as optx

import jaxmotor as jm
from jaxmotor.motor import Motor, Rows, simulate_motor
from jaxmotor.recording import bundled

PERIOD_S, SUPPLY_V = 0.005, 7.4
WHEEL_m, TRACK_m = 0.016, 0.07
"""Of a robot of 7.5 cm."""
SECONDS, KNOT_TICKS = 4.0, 16
"""Voltages change every 80 ms."""


class Pose(NamedTuple):
    """Where the robot is."""

    x: jax.Array
    """[m]"""
    y: jax.Array
    """[m]"""
    heading: jax.Array
    """From the x axis, anticlockwise [rad]."""


def wheel_turns(motor: Motor, volts: jax.Array) -> jax.Array:
    """(n,) angle [rad] that a wheel turns in each tick under `volts` (n,) [V], from rest."""
    none = jnp.zeros_like(volts)
    time = jnp.arange(volts.shape[0], dtype=volts.dtype) * PERIOD_S
    rows = Rows(volts, none.astype(bool).at[0].set(True), none, time)
    steps = 5 if motor.effects else 1  # without effects any number is exact
    return simulate_motor(motor, rows, jnp.asarray(PERIOD_S), jnp.asarray(SUPPLY_V), steps).turn


def drive(left: Motor, right: Motor, volts: jax.Array) -> Pose:
    """The robot's way (n,) after each tick under `volts` (n, 2) of the left and the right motor, from the origin."""
    turned = WHEEL_m * jnp.stack([wheel_turns(left, volts[:, 0]), wheel_turns(right, volts[:, 1])])
    ahead, around = turned.mean(axis=0), (turned[1] - turned[0]) / TRACK_m
    heading = jnp.cumsum(around)
    middle = heading - around / 2
    chord = ahead * jnp.sinc(around / (2 * jnp.pi))
    return Pose(jnp.cumsum(chord * jnp.cos(middle)), jnp.cumsum(chord * jnp.sin(middle)), heading)


def wanted_path(ticks: int) -> np.ndarray:
    """(ticks, 2) a figure of eight [m] that begins at the origin along the x axis, from rest to rest."""
    s = np.linspace(0, 1, ticks + 1)[1:]
    phase = 2 * np.pi * s - np.sin(2 * np.pi * s)
    length, width = 0.25, 0.12
    eight = np.stack([length * np.sin(phase), width * np.sin(2 * phase)], axis=1)
    turn = np.arctan2(2 * width, length)
    return eight @ np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])


def held(knots: jax.Array, ticks: int) -> jax.Array:
    """(ticks, 2) voltages [V] from `knots` (k, 2), kept within the supply smoothly."""
    return SUPPLY_V * jnp.tanh(jnp.repeat(knots, KNOT_TICKS, axis=0)[:ticks] / SUPPLY_V)


def first_guess(left: Motor, right: Motor, path: jax.Array) -> jax.Array:
    """(k, 2) voltages [V] of the knots: the wheel speeds that the path asks for, over each motor's gain and pole."""
    step = jnp.diff(path, axis=0, prepend=jnp.zeros((1, 2)))
    heading = jnp.unwrap(jnp.arctan2(step[:, 1], step[:, 0]))
    ahead = jnp.hypot(step[:, 0], step[:, 1])
    around = jnp.diff(heading, prepend=jnp.zeros(1)) * TRACK_m / 2
    columns = []
    for motor, turn in ((left, ahead - around), (right, ahead + around)):
        speed = turn / WHEEL_m / PERIOD_S
        late = speed + jnp.gradient(speed, PERIOD_S) / motor.linear.pole
        columns.append((late / motor.linear.gain)[KNOT_TICKS // 2 :: KNOT_TICKS])
    return jnp.stack(columns, axis=1)


@eqx.filter_jit
def follow(left: Motor, right: Motor, path: jax.Array) -> jax.Array:
    """(n, 2) voltages [V] that drive along `path` (n, 2) [m], by Levenberg-Marquardt through the simulation."""
    ticks = path.shape[0]

    def residual(knots: jax.Array, _: None) -> tuple[jax.Array, ...]:
        way = drive(left, right, held(knots, ticks))
        # In centimetres, and a little of every change of voltage, which settles what the path leaves open.
        return 100 * (way.x - path[:, 0]), 100 * (way.y - path[:, 1]), 0.02 * jnp.diff(knots, axis=0)

    begin = first_guess(left, right, path)
    solver = optx.LevenbergMarquardt(rtol=1e-4, atol=1e-4)
    found = optx.least_squares(residual, solver, begin, options={"jac": "fwd"}, max_steps=50, throw=False)
    return held(found.value, ticks)


def miss_m(way: Pose, path: jax.Array) -> float:
    """Root mean square distance [m] of `way` from `path`."""
    return float(jnp.sqrt(jnp.mean((way.x - path[:, 0]) ** 2 + (way.y - path[:, 1]) ** 2)))


def draw(ways: dict[str, Pose], volts: jax.Array, path: jax.Array, file: Path) -> None:
    """The path and the ways driven, and the voltages."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(7.2, 3.2), layout="constrained")
    plane, time = figure.subplots(1, 2, width_ratios=(1.3, 1))
    plane.plot(*100 * path.T, color="black", linestyle=":", label="wanted")
    for (name, way), (color, line) in zip(ways.items(), (("#D55E00", "--"), ("#0072B2", "-")), strict=True):
        plane.plot(100 * way.x, 100 * way.y, color=color, linestyle=line, label=name)
    plane.set(xlabel="x (cm)", ylabel="y (cm)", aspect="equal")
    plane.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=3, frameon=False, fontsize=8)
    for column, (name, line) in enumerate((("left", "-"), ("right", "--"))):
        time.step(np.arange(len(volts)) * PERIOD_S, volts[:, column], line, where="post", label=name, color="#0072B2")
    time.set(xlabel="Time (s)", ylabel="Voltage (V)")
    time.legend(frameon=False, fontsize=8)
    figure.savefig(file, dpi=150)


def motors(files: list[Path]) -> tuple[Motor, Motor]:
    """Of the model files, or without them of two bundled recordings, the second of a motor with friction."""
    if files:
        left, right = (jm.read_model(file).whole for file in files)
    else:
        left, right = (Motor(jm.identify(bundled(name)).motor) for name in ("linear", "paper"))
    return jax.tree.map(jnp.asarray, (left, right))


def main(arguments: list[str] | None = None) -> dict[str, float]:
    """Print and draw; returns the misses [m] by name."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("models", nargs="*", type=Path, help="none, or LEFT.json RIGHT.json")
    parser.add_argument("-o", "--output", type=Path, help="the figure")
    options = parser.parse_args(arguments)
    if len(options.models) not in (0, 2):
        parser.error("give two models, LEFT.json and RIGHT.json, or none")
    with jax.enable_x64(True):
        left, right = motors(options.models)
        path = jnp.asarray(wanted_path(round(SECONDS / PERIOD_S)))
        volts = follow(left, right, path)
        # The voltages for two motors like the left one, on the robot as it is.
        alike = follow(left, left, path)
        ways = {"motors taken as alike": drive(left, right, alike), "each as identified": drive(left, right, volts)}
        misses = {name: miss_m(way, path) for name, way in ways.items()}
        for name, miss in misses.items():
            print(f"{name}: {1000 * miss:.2f} mm from the path (RMS)")
        if options.output is not None:
            draw(ways, volts, path, options.output)
    return misses


if __name__ == "__main__":
    main()
