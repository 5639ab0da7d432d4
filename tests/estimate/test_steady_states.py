"""Steady states beside a log: motors come to them from rest, and slow ones do not fit them."""

import dataclasses

import numpy as np
import pytest
from scipy.signal import lfilter

from jaxmotor import JaxmotorError, diagnose, identify, join
from jaxmotor.fleet._ready import ready
from jaxmotor.prediction import pack
from jaxmotor.recording import Recording, Segment, import_steady

GAIN, POLE, PERIOD_S = 12.0, 9.0, 0.02
"""[rad/s/V, rad/s, s]"""


@pytest.fixture
def curve(tmp_path):
    volts = np.linspace(-5, 5, 21)
    rows = [f"{volt:.3f},{GAIN * volt:.6f}" for volt in volts]
    (tmp_path / "curve.csv").write_text("\n".join(["u,w", *rows]) + "\n")
    return import_steady(
        tmp_path / "curve.csv", input="u:V", speed="w:rad/s", period_s=PERIOD_S, speed_window_s=PERIOD_S
    )


def short_log(seed: int) -> Recording:
    """A step of a second, its mean speeds in noise of 5 %."""
    volts = np.concatenate([[0.0], np.full(49, 3.0)])
    decay = np.exp(-POLE * PERIOD_S)
    at = np.asarray(lfilter([0, GAIN * (1 - decay)], [1, -decay], volts))
    rate = (1 - decay) / (POLE * PERIOD_S)
    mean = np.concatenate([[0.0], (GAIN * volts + (at - GAIN * volts) * rate)[:-1]])
    read = mean + 0.05 * GAIN * 3.0 * np.random.default_rng(seed).standard_normal(50)
    read[0] = 0.0
    rows = np.arange(50)
    segment = Segment("other", 0.0, True, {}, rows * PERIOD_S, volts, tick=rows, speed_rad_s=read)
    return Recording((segment,), "step.csv", PERIOD_S, speed_window_s=PERIOD_S)


def test_only_the_second_half_of_a_state_is_compared(curve):
    packed = pack(curve, tuple(range(len(curve.segments))))
    assert not packed.batch.free.any()
    rows = len(curve.segments[3])
    compared = packed.row_of[(packed.segment_of == 3) & packed.batch.valid]
    assert compared.min() == rows // 2
    assert len(compared) == pytest.approx(rows / 2, abs=1.0)


def test_a_curve_makes_the_gain_of_a_short_noisy_log_exact(curve):
    log = short_log(1)
    alone, together = identify(log), identify(join([log, curve]))
    assert abs(float(together.motor.gain) / GAIN - 1) < 0.002
    assert abs(float(together.motor.gain) / GAIN - 1) < abs(float(alone.motor.gain) / GAIN - 1)
    # A pole near zero would keep any initial speed; from rest it never reaches the states.
    assert abs(float(together.motor.pole) - POLE) < 3 * float(together.standard_error.pole)


def test_a_curve_alone_is_refused_at_once(curve):
    for ask in (identify, diagnose):
        with pytest.raises(JaxmotorError, match=r"curve.csv: all segments are steady states.* record a step from rest"):
            ask(curve)
    with pytest.raises(JaxmotorError, match="steady states"):
        ready(curve)


def test_states_that_are_not_said_to_be_steady_may_begin_at_any_speed(curve):
    plain = [dataclasses.replace(segment, parameters={}) for segment in curve.segments]
    packed = pack(dataclasses.replace(curve, segments=tuple(plain)), tuple(range(len(plain))))
    assert packed.batch.free.sum() == len(plain)
