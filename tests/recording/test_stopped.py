"""A shaft that stands still although it is driven is told; one that has not broken away, or rests, is not."""

import numpy as np
import pytest

from jaxmotor.recording import check, from_arrays, warn_stopped

PERIOD_S = 0.01
ROWS = 2000


def recorded(volts, shaft, name="speed_rad_s"):
    known, name = ({"counts_per_rev": 600.0}, "counts") if name == "count" else ({}, name)
    return from_arrays(time_s=PERIOD_S * np.arange(len(volts)), volts=volts, **{name: shaft}, **known)


def moved(volts, dead_V=0.0):
    """(n,) speed [rad/s] of a motor of 10 rad/s/V and 5 rad/s that no less than `dead_V` moves."""
    speed = np.zeros(len(volts))
    for row, volt in enumerate(volts[:-1]):
        driven = np.sign(volt) * max(abs(volt) - dead_V, 0.0)
        speed[row + 1] = speed[row] + 0.05 * (10 * driven - speed[row])
        speed[row + 1] = 0.0 if abs(speed[row + 1]) < 0.05 else speed[row + 1]
    return speed


def levels(seed):
    rng = np.random.default_rng(seed)
    return np.repeat(rng.uniform(1, 6, ROWS // 50) * rng.choice([-1, 1], ROWS // 50), 50)


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("name", ["speed_rad_s", "angle_rad", "count"])
def test_a_shaft_that_stops_while_it_is_driven(seed, name):
    volts = levels(seed)
    speed = moved(volts)
    speed[1500:] = 0
    angle = np.append(0.0, np.cumsum(speed[:-1] * PERIOD_S))
    shaft = {"speed_rad_s": speed, "angle_rad": angle, "count": np.rint(angle / 2 / np.pi * 600).astype(int)}[name]
    [told] = warn_stopped(recorded(volts, shaft, name))
    assert "driven as where it moves" in told and "--end 1" in told
    assert float(told.split("--end ")[1].rstrip(")")) == pytest.approx(14.99, abs=0.05)
    assert told in check(recorded(volts, shaft, name))


def test_where_it_stops_and_goes_on_no_end_is_named():
    volts = levels(0)
    volts[950:1000] = 6.0
    speed = moved(volts)
    speed[300:600] = 0
    speed[900:1100] = 0
    [told] = warn_stopped(recorded(volts, speed))
    assert "for 2.99 s from 3 s on, and 1 times more" in told and "--end" not in told


@pytest.mark.parametrize(
    "volts",
    [
        np.concatenate([np.zeros(500), np.repeat([3.0, 0.0, 5.0], 500)]),
        np.linspace(0, 6, ROWS),
        np.tile(np.repeat([1.0, 0.0, 4.0, 0.0], 100), 5),
        3 * np.sin(np.arange(ROWS) / 200),
    ],
    ids=["rest", "ramp", "steps below and above", "slow sine"],
)
def test_a_motor_that_rests_or_has_not_broken_away_has_not_stopped(volts):
    assert not warn_stopped(recorded(volts, moved(volts, dead_V=2.0)))
