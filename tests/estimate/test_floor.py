"""The floor of chi2: what an encoder's rounding alone leaves over, at rest, at constant speeds and in between."""

import numpy as np
import pytest
from testing.made import COUNTS, PERIOD, counted, motion, recording

from jaxmotor.estimate import angle_fit_percent, chi2_per_sample, floors, traces_of
from jaxmotor.prediction import pack

GAIN, POLE = 11.0, 40.0


def constant(counts_per_tick, ticks=3000, seeds=40):
    """chi2 of the true motor at one constant speed, over random positions of the encoder."""
    volts = counts_per_tick * 2 * np.pi / COUNTS / PERIOD / GAIN
    found = []
    for seed in range(seeds):
        angle = np.concatenate(
            [[0.0], np.cumsum(motion(np.full(ticks, volts), GAIN, POLE, speed=GAIN * volts)[1])[:-1]]
        )
        rng = np.random.default_rng(seed)
        made = counted([angle], [("step", {}, np.full(ticks, volts))], rng)
        packed = pack(made, (0,))
        residual = np.where(packed.batch.valid, packed.batch.observed - counts_per_tick, 0.0)
        found.append(chi2_per_sample(packed, residual, packed.batch.valid))
    return float(np.mean(found))


@pytest.mark.parametrize("counts_per_tick", [0.037, 0.31, 1.4987, 7.62, 12.9013])
def test_the_true_motor_is_at_one_at_any_constant_speed(counts_per_tick):
    """The mean of 1/6 would say up to half as much again, or next to nothing."""
    assert constant(counts_per_tick) == pytest.approx(1, abs=0.02)


def test_the_mean_over_all_speeds_is_a_sixth():
    packed = pack(recording(0), (0, 1))
    rng = np.random.default_rng(0)
    residual = np.where(packed.batch.valid, rng.uniform(-30, 30, packed.batch.valid.shape), 0.0)
    assert floors(packed, residual)[packed.batch.valid].mean() == pytest.approx(packed.observation.floor, rel=0.02)


def test_a_motor_at_rest_has_a_floor():
    packed = pack(recording(0), (0,))
    residual = np.asarray(packed.batch.observed, float)
    cells = packed.batch.valid & (residual == 0)
    assert cells.any() and chi2_per_sample(packed, residual, cells) == 0.0


def test_the_angle_is_scored_as_it_turned():
    packed = pack(recording(0), (0, 1))
    residual = np.where(packed.batch.valid, 0.01 * packed.batch.observed, 0.0)
    traces = traces_of(packed, residual)
    # A hundredth too slow everywhere: a hundredth of the angle is missing, and of its spread about the mean more.
    angles = [np.cumsum(trace.measured_rad_s) for trace in traces]
    measured = np.concatenate(angles)
    wanted = 100 * (1 - np.linalg.norm(0.01 * measured) / np.linalg.norm(measured - measured.mean()))
    assert angle_fit_percent(traces) == pytest.approx(wanted, abs=1e-6)


def test_nothing_that_moved_has_no_score():
    assert np.isnan(angle_fit_percent(()))
