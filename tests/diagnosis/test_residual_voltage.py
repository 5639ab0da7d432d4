"""Residual voltage where rows are uneven, against a motor that is computed row by row."""

import numpy as np
import pytest

from jaxmotor.diagnosis._residual_voltage import residual_voltage
from jaxmotor.estimate import Trace
from jaxmotor.recording import from_arrays

GAIN, POLE = 20.0, 15.0
ADDED_V = 0.3


def turned(volts, length_s):
    """(n,) angle that a motor from rest turns in each row [rad]."""
    speed, angles = 0.0, []
    for u, h in zip(volts.tolist(), length_s.tolist(), strict=True):
        decayed = -np.expm1(-POLE * h)
        angles.append(GAIN * u * h + (speed - GAIN * u) * decayed / POLE)
        speed += (GAIN * u - speed) * decayed
    return np.array(angles)


def log(seed, longest):
    """A recording of uneven rows, one of which is `longest` s, and the trace of a motor without the added voltage."""
    rng = np.random.default_rng(seed)
    length = rng.uniform(0.6, 1.7, 3000) * 5e-3
    length[1500] = longest
    time = np.cumsum(length) - length
    volts = rng.choice([-4.0, 1.0, 4.0], 300).repeat(10)
    on = time % 2 > 1
    measured, simulated = turned(volts + ADDED_V * on, length), turned(volts, length)
    made = from_arrays(time_s=time, volts=volts, angle_rad=np.cumsum(measured) - measured, supply_V=6.0)
    rows = slice(None, -1)
    return made, Trace(0, time[rows], (measured / length)[rows], (simulated / length)[rows])


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_voltage_is_found_with_its_size_and_its_place(seed):
    made, trace = log(seed, 7e-3)
    assert made.period_s is None
    found = residual_voltage(made, (trace,), GAIN, POLE)
    phase = found.time_s % 2
    for away, volts in (((phase > 0.15) & (phase < 0.85), 0.0), ((phase > 1.15) & (phase < 1.85), ADDED_V)):
        assert away.sum() > 50 and found.volts[away].mean() == pytest.approx(volts, abs=0.003)
    # Windows stand where they say: of their voltage, by the log's at a hundred moments within 60 ms about them.
    moments = found.time_s[:, None] + np.linspace(-0.03, 0.03, 101)
    rows = np.searchsorted(trace.time_s, moments, side="right") - 1
    near = made.segments[0].volts[rows].mean(axis=1)
    assert np.corrcoef(found.input_V, near)[0, 1] > 0.99


@pytest.mark.parametrize("longest", [0.5, 1e9])
def test_a_long_row_is_in_no_window(longest):
    """However long: a clock may jump by years."""
    made, trace = log(4, longest)
    found = residual_voltage(made, (trace,), GAIN, POLE)
    begin = trace.time_s[1500]
    assert not ((found.time_s > begin) & (found.time_s < begin + longest)).any()
    assert len(found.volts) > 200 and np.abs(found.volts).max() < 1.0
