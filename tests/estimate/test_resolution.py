"""The resolution of a log that was put together from logs with digits of their own."""

import numpy as np
import pytest

from jaxmotor.estimate import ROOMY, pack
from jaxmotor.recording import Recording, Segment

GRID = 0.1122


def segment(speed, start):
    n = len(speed)
    tick = np.arange(n)
    return Segment("other", start, False, {}, tick * 0.02, np.full(n, 1.0), tick=tick, speed_rad_s=speed)


def unit_of(*speeds):
    segments = tuple(segment(np.asarray(speed, float), 100.0 * k) for k, speed in enumerate(speeds))
    recording = Recording(segments, "joined.csv", period_s=0.02, speed_window_s=0.02)
    return pack(recording, tuple(range(len(segments))), ROOMY).observation.unit / 0.02


def counted(seed, rows):
    return GRID * np.round(np.cumsum(np.random.default_rng(seed).normal(0, 2, rows)))


def test_steady_states_with_more_digits_do_not_make_the_log_exact():
    steady = [np.full(50, speed) for speed in np.random.default_rng(0).normal(0, 9, 20)]
    assert unit_of(counted(1, 600), *steady) == pytest.approx(GRID)
    assert unit_of(counted(1, 600), counted(2, 300), *steady) == pytest.approx(GRID)


def test_the_longest_log_decides():
    assert unit_of(counted(1, 600), counted(2, 100) / 3) == pytest.approx(GRID)
    assert unit_of(counted(1, 600) / 3, counted(2, 100)) == pytest.approx(GRID / 3)
