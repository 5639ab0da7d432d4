"""Speeds that a board's program smoothed from row to row: counts of an exactly simulated motor, y += b (x - y)."""

import dataclasses
import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from jaxmotor import Recording, identify, validate
from jaxmotor.estimate import read_model
from jaxmotor.estimate._model_file import to_json
from jaxmotor.prediction import smoothing, unsmoothed
from jaxmotor.recording import Segment, from_arrays

GAIN, POLE = 8.0, 18.0
"""[rad/s/V, rad/s]"""
COUNTS, PERIOD_S, ROWS = 700, 0.02, 1500


def driven(rng: np.random.Generator, lengths_s: np.ndarray, counts: int = COUNTS) -> tuple[np.ndarray, np.ndarray]:
    """(n,) voltages, and (n,) counts in the row before each."""
    volts = np.repeat(rng.uniform(-7, 7, len(lengths_s)), rng.integers(4, 30, len(lengths_s)))[: len(lengths_s)]
    angle, speed = np.zeros(len(volts) + 1), 0.0
    for row, (volt, length) in enumerate(zip(volts, lengths_s, strict=True)):
        decay, final = np.exp(-POLE * length), GAIN * volt
        angle[row + 1] = angle[row] + final * length + (speed - final) * (1 - decay) / POLE
        speed = final + (speed - final) * decay
    return volts, np.diff(np.floor(angle / (2 * np.pi) * counts), prepend=0.0)[: len(volts)]


def smooth(speeds: np.ndarray, weight: float) -> np.ndarray:
    smoothed, now = np.zeros_like(speeds), 0.0
    for row, speed in enumerate(speeds):
        now += weight * (speed - now)
        smoothed[row] = now
    return smoothed


def log(seed: int, weight: float, digits: int = 2) -> Recording:
    """Speeds in rpm with so many decimals."""
    volts, counted = driven(np.random.default_rng(seed), np.full(ROWS, PERIOD_S))
    rpm = np.round(smooth(counted / COUNTS / PERIOD_S * 60, weight), digits)
    return from_arrays(time_s=PERIOD_S * np.arange(ROWS), volts=volts, speed_rad_s=rpm * (2 * np.pi / 60))


@pytest.mark.parametrize(("weight", "digits"), [(0.1, 2), (0.3, 2), (0.5, 1), (0.75, 2)])
def test_the_weight_and_the_count_are_found(weight: float, digits: int) -> None:
    found = smoothing(log(1, weight, digits), (0,))
    assert found is not None
    assert abs(found.weight - weight) < 1e-3 * weight
    np.testing.assert_allclose(found.count_rad_s, 2 * np.pi / COUNTS / PERIOD_S, rtol=1e-3)


def test_rows_that_are_not_even_are_told_by_what_was_counted_in_each() -> None:
    rng = np.random.default_rng(4)
    lengths = PERIOD_S * rng.uniform(0.8, 1.2, ROWS)
    volts, counted = driven(rng, lengths)
    before = np.insert(lengths[:-1], 0, PERIOD_S)
    speed = np.round(smooth(counted * 2 * np.pi / COUNTS / before, 0.4), 4)
    time = np.round(np.cumsum(lengths) - lengths, 6)
    found = smoothing(from_arrays(time_s=time, volts=volts, speed_rad_s=speed), (0,))
    assert found is not None
    assert abs(found.weight - 0.4) < 1e-3


def test_nothing_is_found_where_nothing_was_smoothed() -> None:
    plain = log(2, 1.0)
    assert smoothing(plain, (0,)) is None
    assert smoothing(dataclasses.replace(log(2, 0.3), speed_window_s=0.02), (0,)) is None


@pytest.mark.parametrize("counts", [COUNTS, 10 * COUNTS, 50 * COUNTS])
def test_speeds_on_a_grid_are_not_smoothed(counts: int) -> None:
    """A driver's speeds are whole multiples of a step, but for printed digits: 2 y[k] - y[k-1] are such, too."""
    rng = np.random.default_rng(5)
    volts, counted = driven(rng, np.full(ROWS, PERIOD_S), counts)
    speed = counted * 2 * np.pi / counts / PERIOD_S + rng.uniform(-1e-7, 1e-7, ROWS)
    assert smoothing(from_arrays(time_s=PERIOD_S * np.arange(ROWS), volts=volts, speed_rad_s=speed), (0,)) is None


def test_segments_of_one_row_say_nothing() -> None:
    one = log(1, 0.3)
    [long] = one.segments
    about = (long.kind, 0.0, True, {}, long.time_s[:1], long.volts[:1])
    short = Segment(*about, tick=np.arange(1), speed_rad_s=np.zeros(1))
    assert smoothing(dataclasses.replace(one, segments=(short,)), (0,)) is None
    found = smoothing(dataclasses.replace(one, segments=(short, long)), (0, 1))
    assert found is not None and abs(found.weight - 0.3) < 1e-3


def test_smoothed_speeds_that_were_not_counted_are_no_multiples() -> None:
    rng = np.random.default_rng(5)
    volts, counted = driven(rng, np.full(ROWS, PERIOD_S))
    speed = smooth(counted * 2 * np.pi / COUNTS / PERIOD_S + rng.normal(0, 1.0, ROWS), 0.3)
    assert smoothing(from_arrays(time_s=PERIOD_S * np.arange(ROWS), volts=volts, speed_rad_s=speed), (0,)) is None


@pytest.mark.parametrize("friction_V", [0.0, 0.4])
@pytest.mark.parametrize("levels", [[-255, 255], range(-255, 256)])
def test_a_motor_without_noise_under_whole_duties_is_not_smoothed(levels: Sequence[int], friction_V: float) -> None:
    rng = np.random.default_rng(8)
    duty = np.repeat(rng.choice(levels, ROWS), rng.integers(4, 30, ROWS))[:ROWS]
    drive = 9 * duty / 255 - friction_V * np.sign(duty)
    keep, speed = np.exp(-POLE * PERIOD_S), np.zeros(ROWS)
    for row in range(1, ROWS):
        speed[row] = keep * speed[row - 1] + (1 - keep) * GAIN * drive[row - 1]
    time = PERIOD_S * np.arange(ROWS)
    given = from_arrays(time_s=time, duty=duty, duty_full_scale=255, supply_V=9.0, speed_rad_s=np.round(speed, 4))
    assert smoothing(given, (0,)) is None


def test_undone_speeds_are_the_means_over_their_rows() -> None:
    _, counted = driven(np.random.default_rng(3), np.full(ROWS, PERIOD_S))
    undone = unsmoothed(log(3, 0.3, digits=9), 0.3)
    [segment] = undone.segments
    assert segment.speed_rad_s is not None
    np.testing.assert_allclose(segment.speed_rad_s, counted * 2 * np.pi / COUNTS / PERIOD_S, atol=1e-7)
    assert undone.speed_window_s == PERIOD_S


def test_the_motor_is_that_of_the_counts(tmp_path: Path) -> None:
    """Taken as they are, such speeds are those of a motor with another lag."""
    fit = identify(log(6, 0.25))
    assert abs(float(fit.motor.pole) - POLE) < 3 * float(fit.standard_error.pole)
    assert abs(float(fit.motor.gain) - GAIN) < 3 * float(fit.standard_error.gain)
    assert float(fit.standard_error.pole) < 0.01 * POLE
    assert fit.average is not None
    assert fit.average.weight is not None
    assert any("exponential smoothing" in note for note in fit.notes)

    path = tmp_path / "motor.json"
    path.write_text(json.dumps(to_json(fit)))
    model = read_model(path)
    assert model.average == fit.average
    again = validate(model, log(7, 0.25))
    assert again.open_loop is not None
    assert again.open_loop.pooled.fit_percent > 95
    assert any("exponential smoothing" in note for note in again.notes)


@pytest.mark.parametrize("jitter", [0, 1])
def test_speeds_that_are_smoothed_from_reading_to_reading_and_repeated_meanwhile(jitter: int) -> None:
    """Counts over about four rows, and voltages that change in any row."""
    rows, period_s, weight = 6000, 0.005, 0.4
    rng = np.random.default_rng(8)
    volts, counted = driven(rng, np.full(rows, period_s))
    every = 4 + rng.integers(-jitter, jitter + 1, rows)
    at = np.concatenate([[0], np.cumsum(every)])
    at = at[at < rows]
    angle = np.cumsum(counted)
    took_s = np.diff(at) * period_s
    speeds = smooth(np.concatenate([[0.0], np.diff(angle[at]) / COUNTS / took_s * 60]), weight)
    held = np.round(speeds, 2)[np.searchsorted(at, np.arange(rows), side="right") - 1]
    recording = from_arrays(time_s=period_s * np.arange(rows), volts=volts, speed_rad_s=held * (2 * np.pi / 60))
    found = smoothing(recording, (0,))
    assert found is not None and abs(found.weight - weight) < 1e-3
    again = unsmoothed(recording, found.weight)
    assert again.speed_window_rows == 0 and again.speed_window_s == pytest.approx(0.02)
    fit = identify(recording)
    assert float(fit.motor.gain) == pytest.approx(GAIN, rel=0.002)
    assert float(fit.motor.pole) == pytest.approx(POLE, rel=0.005)
