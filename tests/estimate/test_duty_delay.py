"""A board whose duties act a little after the tick at which it reads the encoder: gain and pole are the motor's."""

import dataclasses

import numpy as np
import pytest
from testing.made import PERIOD, counted, motion, plan

from jaxmotor import identify
from jaxmotor.recording import at_duty

GAIN, POLE, LATE, PARTS = 11.0, 40.0, 1e-4, 50


def logged(seed):
    """Each tick in 50 exact parts, of which the first still has the voltage of the tick before."""
    angles, runs = [], plan()
    for _, _, volts in runs:
        fine = np.repeat(volts, PARTS)
        fine[::PARTS] = np.concatenate([[0.0], volts[:-1]])
        turned = np.cumsum(motion(fine, GAIN, POLE, PERIOD / PARTS)[1])
        angles.append(np.concatenate([[0.0], turned[PARTS - 1 :: PARTS]])[: len(volts)])
    return counted(angles, runs, np.random.default_rng(seed), duty_delay_s=LATE)


@pytest.mark.parametrize("seed", [1, 2])
def test_gain_and_pole_are_those_of_the_motor(seed):
    fit = identify(logged(seed))
    assert fit.chi2_per_sample < 1.05
    error = float(fit.motor.gain) - GAIN, float(fit.motor.pole) - POLE
    stated = float(fit.standard_error.gain), float(fit.standard_error.pole)
    assert stated[1] < 1e-3 * POLE
    assert np.all(np.abs(np.divide(error, stated)) < 3)


def test_the_response_is_that_of_the_motor():
    """Against the recursion's own response; without the delay phases lag by 2 π f times it."""
    made = logged(3)
    knowing, ignorant = (
        identify(dataclasses.replace(made, duty_delay_s=late)).frequency_response for late in (LATE, None)
    )
    assert knowing is not None and ignorant is not None
    frequency = np.asarray(knowing.frequency_Hz)
    z, p = np.exp(2j * np.pi * frequency * PERIOD), np.exp(-POLE * PERIOD)
    g = (1 - p) / (POLE * PERIOD)
    exact = g * GAIN * (1 - p) / (z - p) + GAIN * (1 - g)
    off = np.abs(knowing.response - exact) / np.asarray(knowing.standard_error)
    assert off.max() < 4
    lag = -np.angle(np.asarray(ignorant.response) / exact)
    np.testing.assert_allclose(lag[-3:], 2 * np.pi * frequency[-3:] * LATE, rtol=0.1)


def test_it_is_a_taylor_step():
    time = np.sort(np.random.default_rng(0).uniform(0, 1, 50))
    made = logged(0)
    np.testing.assert_allclose(at_duty(made, 3 * time + 1, time), 3 * (time + LATE) + 1, rtol=1e-12)
    assert at_duty(dataclasses.replace(made, duty_delay_s=None), time, time) is time
