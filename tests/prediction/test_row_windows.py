"""Speeds of uneven rows, made of the last rows' counts: the rows are found, and the motor is read through them."""

import dataclasses

import numpy as np
import pytest

from jaxmotor.estimate import identify
from jaxmotor.prediction import row_window
from jaxmotor.prediction._row_windows import SURE, _errors
from jaxmotor.recording import Recording, from_arrays

GAIN, POLE, PERIOD_S = 4.0, 25.0, 0.005


def turned(time: np.ndarray, volts: np.ndarray, delay_s: float = 0.0) -> tuple[np.ndarray, np.ndarray]:
    """Times and angle of w' = a (K v - w), finely integrated, from a second before the first row on."""
    fine = np.arange(time[0] - 1.0, time[-1] + 1e-9, 1e-4)
    drive = volts[np.clip(np.searchsorted(time, fine - delay_s + 1e-9, side="right") - 1, 0, None)]
    drive = np.where(fine - delay_s < time[0] - 1e-9, 0.0, drive)
    speed, keep = np.zeros(len(fine)), np.exp(-POLE * 1e-4)
    for k in range(1, len(fine)):
        speed[k] = keep * speed[k - 1] + (1 - keep) * GAIN * drive[k - 1]
    return fine, np.append(0.0, np.cumsum(GAIN * drive * 1e-4)[:-1]) - speed / POLE


def uneven(way: str, rows: int, seed: int, jitter: float = 0.2, delay_s: float = 0.0) -> Recording:
    """Speeds of the last `rows` rows: over their time, over as many usual ones ("as even"), or over a fixed time."""
    rng = np.random.default_rng(seed)
    times, volts, speeds = [], [], []
    for _ in range(4):
        number = 700
        time = PERIOD_S * np.arange(number)
        time[1:] += np.round(jitter * PERIOD_S * rng.uniform(-1, 1, number - 1), 4)
        drive = np.repeat(rng.uniform(-10, 10, number // 20), 20)
        drive[:5] = 0.0
        fine, angle = turned(time, drive, delay_s)
        before = np.concatenate([time[0] - PERIOD_S * np.arange(rows, 0, -1), time])[:number]
        usual = rows * PERIOD_S
        begin = time - usual if way == "fixed" else before
        over = time - before if way == "rows" else usual
        speed = (np.interp(time, fine, angle) - np.interp(begin, fine, angle)) / over
        times, volts = [*times, time], [*volts, drive]
        speeds.append(speed + 0.05 * rng.standard_normal(number))
    return from_arrays(time_s=times, volts=volts, speed_rad_s=speeds)


def found(recording: Recording) -> tuple[int, bool] | None:
    window = row_window(recording, tuple(range(len(recording.segments))))
    return None if window is None else (window.rows, window.as_even)


@pytest.mark.parametrize("rows", [1, 4, 9, 16])
def test_rows_of_a_window_are_found(rows: int) -> None:
    for seed, delay_s in ((3, 0.0), (4, 0.012)):
        assert found(uneven("rows", rows, seed, delay_s=delay_s)) == (rows, False)
        assert found(uneven("as even", rows, seed, delay_s=delay_s)) == (rows, True)


@pytest.mark.parametrize("rows", [1, 4, 9, 16])
def test_a_fixed_time_is_not_taken_for_rows(rows: int) -> None:
    assert [found(uneven("fixed", rows, seed)) for seed in range(5)] == [None] * 5


def test_even_rows_and_other_readings_have_no_such_window() -> None:
    even = uneven("rows", 4, 5, jitter=0.0)
    assert even.period_s == PERIOD_S and found(even) is None
    stated = dataclasses.replace(uneven("rows", 4, 5), speed_window_s=0.02, speed_window_rows=4)
    assert found(stated) is None


def test_a_stated_window_is_tried_alone() -> None:
    recording = uneven("rows", 4, 6)
    assert found(dataclasses.replace(recording, speed_window_s=0.02)) == (4, False)
    assert found(dataclasses.replace(recording, speed_window_s=0.03)) is None


@pytest.mark.parametrize("way", ["rows", "as even", "fixed"])
def test_motor_through_its_window(way: str) -> None:
    """Inside the stated intervals, with the noise that was put in."""
    fit = identify(uneven(way, 6, 7))
    assert fit.average is not None and fit.average.length_s == pytest.approx(0.03, rel=0.01)
    assert fit.average.rows == (None if way == "fixed" else 6)
    assert fit.average.as_even == (way == "as even")
    assert fit.noise.level == pytest.approx(0.05, rel=0.1)
    assert 0.9 < fit.chi2_per_sample < 1.15
    # Two standard errors and a half: of three motors with two parameters one in fifteen would be outside two.
    assert abs(float(fit.motor.gain) - GAIN) < 2.5 * float(fit.standard_error.gain)
    assert abs(float(fit.motor.pole) - POLE) < 2.5 * float(fit.standard_error.pole)
    assert any("speed_window" in note for note in fit.notes)


@pytest.mark.parametrize("seed", range(6))
def test_a_fixed_time_is_not_taken_for_rows_that_differ_much(seed: int) -> None:
    """Rows of half to twice their usual length, whose times wander away from even ones."""
    rng = np.random.default_rng(seed)
    time = np.cumsum(np.round(PERIOD_S * rng.uniform(0.5, 2.0, 1500), 4))
    drive = np.repeat(rng.uniform(-10, 10, 75), 20)
    drive[:5] = 0.0
    fine, angle = turned(time, drive)
    window = rng.uniform(0.3, 9.0) * PERIOD_S
    speed = (np.interp(time, fine, angle) - np.interp(time - window, fine, angle)) / window
    assert found(from_arrays(time_s=time, volts=drive, speed_rad_s=speed + 0.05 * rng.standard_normal(1500))) is None


@pytest.mark.parametrize("weight", [1.0, 0.6, 0.25])
@pytest.mark.parametrize("seed", range(3))
def test_speeds_at_rows_are_no_means(seed: int, weight: float) -> None:
    """Nor are these smoothed from row to row, of a motor that is about as fast as rows are long."""
    rng = np.random.default_rng(seed)
    lengths = PERIOD_S * rng.uniform(0.7, 1.3, 2000)
    volts = np.repeat(rng.choice([-6.0, 6.0], 500), 4)
    speed, read = np.zeros(2000), np.zeros(2000)
    for k in range(1, 2000):
        keep = np.exp(-4 * POLE * lengths[k - 1])
        speed[k] = keep * speed[k - 1] + (1 - keep) * GAIN * volts[k - 1]
        read[k] = read[k - 1] + weight * (speed[k] + 0.1 * rng.standard_normal() - read[k - 1])
    time = np.append(0.0, np.cumsum(lengths)[:-1])
    assert found(from_arrays(time_s=time, volts=volts, speed_rad_s=read)) is None


@pytest.mark.parametrize("seed", range(4))
def test_rows_that_belong_together_say_less(seed: int) -> None:
    """Of a motion that is not followed well, through hundreds of rows the share is four, and then minus two."""
    change = np.random.default_rng(seed).standard_normal(2000)
    by_turns = 1 + 3 * np.where(np.arange(2000) // 200 % 2 == 0, 1.0, -1.0)
    at_random = np.random.default_rng(seed + 10).permutation(by_turns)
    assert 0 <= _errors(by_turns * change, change) < SURE < _errors(at_random * change, change) < 12
