"""Counts of rows whose time stamps are whole milliseconds, rounded down or made to the millisecond; and of rows that
are read a while after they were stamped, each time another one."""

import numpy as np
import pytest

from jaxmotor import Recording, identify
from jaxmotor.estimate import STAMPS
from jaxmotor.prediction import coarse_stamps, late_readings
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
    return read_at(time, volts, time, printed)


def read_at(time: np.ndarray, volts: np.ndarray, read: np.ndarray, printed: np.ndarray, friction: float = 0.0):
    """Counts at the times `read`, each within the row that begins at `time`, stamped as `printed`; `friction` [V] as
    long as the motor turns."""
    angle, seen, speed = 0.0, np.zeros(len(time)), 0.0
    for row, length in enumerate(np.diff(time, append=time[-1] + 0.01)):
        way = np.sign(speed) if speed else np.sign(volts[row])
        final = GAIN * (volts[row] - friction * way)
        seen[row] = angle + _turned(read[row] - time[row], final, speed)
        angle += _turned(length, final, speed)
        speed = final + (speed - final) * np.exp(-POLE * length)
        speed = 0.0 if friction and speed * way < 0 else speed
    counts = np.floor(seen / (2 * np.pi) * COUNTS).astype(int)
    return from_arrays(time_s=printed - printed[0], volts=volts, counts=counts, counts_per_rev=COUNTS)


def _turned(length: float, final: float, speed: float) -> float:
    return final * length + (speed - final) * (1 - np.exp(-POLE * length)) / POLE


def late(seed: int, spread_s: float, friction: float = 0.0) -> Recording:
    """Read after the stamp, by a time of this standard deviation; up to four of these, less than a row."""
    rng = np.random.default_rng(seed)
    time = np.cumsum(rng.uniform(0.008, 0.013, ROWS))
    volts = np.repeat(rng.uniform(-9, 9, ROWS), rng.integers(10, 80, ROWS))[:ROWS]
    return read_at(time, volts, time + np.minimum(rng.exponential(spread_s, ROWS), 4 * spread_s), time, friction)


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


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("friction", [0.0, 0.4])
def test_readings_off_their_stamps_are_told_with_how_far(seed: int, friction: float) -> None:
    for spread_s in (0.5e-3, 1.5e-3):
        found = late_readings(late(seed, spread_s, friction), (0,))
        # Of an exponential distribution that is cut off at four times its mean.
        assert found == pytest.approx(0.94 * spread_s, rel=0.15)


@pytest.mark.parametrize("seed", range(6))
def test_readings_on_their_stamps_are_not(seed: int) -> None:
    for friction in (0.0, 0.4):
        assert late_readings(late(seed, 0.0, friction), (0,)) is None
    assert late_readings(late(seed, 2e-5), (0,)) is None


def test_the_pole_is_then_as_sure_as_it_seems() -> None:
    """Rounding alone would have its standard error ten times too small."""
    fit = identify(late(7, 0.7e-3))
    assert not fit.floor_known and 0.5 < fit.chi2_per_sample < 1.5
    assert [note for note in fit.notes if note.startswith(STAMPS) and "at random" in note]
    assert fit.timing is not None and fit.timing.offset_s == pytest.approx(0.7e-3, abs=4 * fit.timing.standard_error_s)
    assert abs(float(fit.motor.gain) - GAIN) < 3 * float(fit.standard_error.gain) < 0.01 * GAIN
    assert abs(float(fit.motor.pole) - POLE) < 3 * float(fit.standard_error.pole) < 0.05 * POLE
