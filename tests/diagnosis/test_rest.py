"""What would have turned the shaft where the log shows it at rest is no cause."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from jaxmotor.diagnosis import diagnose
from jaxmotor.diagnosis._free import linear_of
from jaxmotor.diagnosis._rest import PLAIN, may_rest, rest_of
from jaxmotor.motor.effects import (
    BristleFriction,
    CoastDrive,
    Cogging,
    CoulombFriction,
    DeadZone,
    LoadTorque,
    Rig,
    Stiction,
    VoltageOffset,
)
from jaxmotor.recording import from_arrays

GAIN, POLE, SUPPLY_V = 20.0, 8.0, 12.0


def rig(rest_s, slowest_rad_s):
    return Rig(SUPPLY_V, (6.0,), 200.0, 0.01, 10.0, True, rest_s=rest_s, slowest_rad_s=slowest_rad_s)


def mean_speed(push_V, rest_s):
    """Over a time `rest_s` of a motor that a constant voltage pushes from rest, by integration [rad/s]."""

    def moves(_, state):
        return [state[1], POLE * (GAIN * push_V - state[1])]

    return solve_ivp(moves, (0, rest_s), [0.0, 0.0], rtol=1e-9, atol=1e-12).y[0, -1] / rest_s


@pytest.mark.parametrize("rest_s", [0.02, 0.3, 5.0])
@pytest.mark.parametrize(
    ("effects", "push_V"),
    [
        ((LoadTorque.of(volts_V=0.3),), 0.3),
        ((LoadTorque.of(volts_V=-0.3), CoulombFriction.of(volts_V=0.2)), 0.1),
        ((VoltageOffset.of(volts_V=0.4), LoadTorque.of(volts_V=0.3)), 0.1),
        ((LoadTorque.of(volts_V=0.5), Stiction.of(volts_V=0.1, static_volts_V=0.4, stribeck_speed_rad_s=3.0)), 0.1),
        ((LoadTorque.of(volts_V=0.3), Cogging.of(volts_V=0.5, cycles_per_rev=4.0, phase_rad=0.3)), 0.3),
    ],
)
def test_a_push_beyond_friction_turns_the_shaft_as_a_plant_does(effects, push_V, rest_s):
    motor, speed = linear_of(GAIN, POLE, effects=effects), mean_speed(push_V, rest_s)
    assert may_rest(motor, rig(rest_s, 1.001 * speed / PLAIN))
    assert not may_rest(motor, rig(rest_s, 0.999 * speed / PLAIN))


@pytest.mark.parametrize(
    "effects",
    [
        (),
        (LoadTorque.of(volts_V=0.3), CoulombFriction.of(volts_V=0.31)),
        (VoltageOffset.of(volts_V=0.3), CoastDrive.of()),
        (VoltageOffset.of(volts_V=0.3), DeadZone.of(volts_V=0.5), CoulombFriction.of(volts_V=0.3)),
        (LoadTorque.of(volts_V=0.3), BristleFriction.start()),
        (Cogging.of(volts_V=0.5, cycles_per_rev=4.0, phase_rad=0.3),),
    ],
)
def test_what_holds_the_shaft_or_only_moves_it_a_little_may_be_there(effects):
    assert may_rest(linear_of(GAIN, POLE, effects=effects), rig(10.0, 1e-6))


def test_a_log_without_rest_forbids_nothing():
    assert may_rest(linear_of(GAIN, POLE, effects=(LoadTorque.of(volts_V=5.0),)), rig(0.0, math.inf))


@pytest.mark.parametrize(
    ("column", "step", "slowest"),
    [("speed_rad_s", 0.5, 0.5), ("angle_rad", 0.01, 0.01 / 0.48), ("counts", 2, 2 * 2 * np.pi / 600 / 0.48)],
)
def test_how_long_it_rests_and_what_would_be_seen(column, step, slowest):
    time = 0.02 * np.arange(100)
    volts = np.where(np.arange(100) < 25, 0.0, 3.0)
    shaft = step * np.maximum(np.arange(100) - 26, 0)
    known = {"counts_per_rev": 600} if column == "counts" else {}
    recording = from_arrays(time_s=time, volts=volts, **{column: shaft}, **known)
    assert rest_of(recording) == pytest.approx((0.48, slowest))
    moving = from_arrays(time_s=time, volts=volts, **{column: step * np.arange(100)}, **known)
    assert rest_of(moving) == (0.0, math.inf)


def with_friction(seed):
    """A log of speeds of one plant with friction alone: at rest, then driven forward in steps."""
    rng = np.random.default_rng(seed)
    time, fine = 0.01 * np.arange(1200), 20
    volts = np.where(time < 2, 0.0, np.repeat(rng.uniform(3, 9, 12), 100))
    speed, measured = 0.0, []
    for volt in volts:
        measured.append(speed)
        for _ in range(fine):
            driven = volt - np.sign(speed) * 0.6 if speed else np.sign(volt) * max(abs(volt) - 0.6, 0.0)
            speed += 0.01 / fine * 6.0 * (25.0 * driven - speed)
    noisy = np.asarray(measured) + np.where(time < 2, 0.0, rng.normal(0, 0.8, len(time)))
    return from_arrays(time_s=time, volts=volts, speed_rad_s=noisy, speed_window_s=0.0)


def test_no_load_is_named_where_the_shaft_rested():
    found = diagnose(with_friction(1))
    laws = {name for effect in found.named for name in (effect.name, *(one.name for one in effect.alternatives))}
    assert "coulomb_friction" in {effect.name for effect in found.named}
    assert not {"load_torque", "voltage_offset"} & laws
