"""Counts of rows whose time stamps are whole milliseconds: rounded down, or made to the millisecond."""

import numpy as np
import pytest

from jaxmotor import Recording, identify
from jaxmotor.estimate import STAMPS
from jaxmotor.prediction import coarse_stamps
from jaxmotor.recording import from_arrays

GAIN, POLE, COUNTS, ROWS = 5.0, 15.0, 1320, 2500
"""[rad/s/V, rad/s]"""


def stamped(seed: int, exact: bool, resolution_s: float) -> Recording:
    """Rows 8 to 13 ms apart; `exact`: times are whole multiples of the resolution, else stamps are rounded down."""
    rng = np.random.default_rng(seed)
    time = np.cumsum(rng.uniform(0.008, 0.013, ROWS))
    printed = np.floor(time / resolution_s + 1e-9) * resolution_s
    time = printed if exact else time
    volts = np.repeat(rng.uniform(-9, 9, ROWS), rng.integers(10, 80, ROWS))[:ROWS]
    angle, speed = np.zeros(ROWS), 0.0
    for row, length in enumerate(np.diff(time)):
        decay, final = np.exp(-POLE * length), GAIN * volts[row]
        angle[row + 1] = angle[row] + final * length + (speed - final) * (1 - decay) / POLE
        speed = final + (speed - final) * decay
    counts = np.floor(angle / (2 * np.pi) * COUNTS).astype(int)
    return from_arrays(time_s=printed - printed[0], volts=volts, counts=counts, counts_per_rev=COUNTS)


def test_stamps_that_were_rounded_are_told_from_exact_ones() -> None:
    assert coarse_stamps(stamped(1, exact=False, resolution_s=1e-3), (0,)) == 1e-3
    assert coarse_stamps(stamped(1, exact=True, resolution_s=1e-3), (0,)) is None
    assert coarse_stamps(stamped(1, exact=False, resolution_s=1e-6), (0,)) is None


@pytest.mark.parametrize("seed", [2, 3])
def test_the_error_of_readings_is_then_estimated(seed: int) -> None:
    fit = identify(stamped(seed, exact=False, resolution_s=1e-3))
    assert not fit.floor_known
    assert 0.5 < fit.chi2_per_sample < 1.5
    assert sum(note.startswith(STAMPS) for note in fit.notes) == 1
    assert abs(float(fit.motor.gain) - GAIN) < 3 * float(fit.standard_error.gain) < 0.01 * GAIN
    assert abs(float(fit.motor.pole) - POLE) < 3 * float(fit.standard_error.pole) < 0.05 * POLE


def test_exact_stamps_leave_the_rounding_known() -> None:
    fit = identify(stamped(4, exact=True, resolution_s=1e-3))
    assert fit.floor_known
    assert not any(note.startswith(STAMPS) for note in fit.notes)
