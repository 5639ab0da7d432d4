"""A dead time that a linear motor lacks is told, with the motor that there is beside it."""

import dataclasses
import re

import numpy as np
import pytest
from testing.made import PERIOD, motion, recording, step

from jaxmotor.estimate import identify
from jaxmotor.estimate._open_hypotheses import SHOWN
from jaxmotor.recording import Recording, Segment

GAIN, POLE, ROWS = 11.0, 20.0, 66


def looks_like(fit):
    return [note.removeprefix(SHOWN) for note in fit.notes if note.startswith(SHOWN)]


def told(note):
    """Delay [s], gain [rad/s/V] and pole [rad/s]."""
    found = re.fullmatch(
        r"a dead time of (\S+) s: with that the gain would be about (\S+) rad/s/V and the pole (\S+) rad/s; .*", note
    )
    assert found, note
    return [float(one) for one in found.groups()]


def test_of_counts_and_several_steps():
    volts = np.repeat([5.1, -4.2, 3.4, -2.7, 2.0, 4.6], 300)
    late = recording(0, GAIN, POLE, runs=[("other", {}, np.concatenate([np.zeros(ROWS), volts[:-ROWS]]))])
    asked = dataclasses.replace(late.segments[0], volts=volts, duty=None)
    fit = identify(dataclasses.replace(late, segments=(asked,)))
    [note] = looks_like(fit)
    assert told(note) == pytest.approx([ROWS * PERIOD, GAIN, POLE], rel=0.02)
    assert float(fit.standard_error.pole) > 0.1 * float(fit.motor.pole)


@pytest.mark.parametrize("at_rest", [True, False])
@pytest.mark.parametrize("jitter", [0.0, 0.3])
def test_of_noisy_speeds_and_one_step(jitter, at_rest):
    """Of even and of uneven rows, whether or not the log says that it begins at rest; with one height the offset is
    taken to be none."""
    rng = np.random.default_rng(2)
    number = 600
    time = (np.arange(number) + jitter * rng.uniform(-0.5, 0.5, number)) * PERIOD
    dead_s = 30.4 * PERIOD
    since = time - time[0] - dead_s
    speed = np.where(since > 0, 5.0 * GAIN * (1 - np.exp(-POLE * np.maximum(since, 0.0))), 0.0)
    speed += 0.2 * rng.standard_normal(number)
    one = Segment("other", 0.0, at_rest, {}, time - time[0], np.full(number, 5.0), speed_rad_s=speed)
    if not jitter:
        one = dataclasses.replace(one, tick=np.arange(number))
    log = Recording((one,), "step", None if jitter else PERIOD, supply_V=7.4, speed_window_s=0.0, duty_delay_s=0.0)
    [note] = looks_like(identify(log))
    assert told(note) == pytest.approx([dead_s, GAIN, POLE], rel=0.03)


@pytest.mark.parametrize("friction", [0.0, 0.4, 2.5])
def test_none_is_told_of_friction(friction):
    fit = identify(
        recording(1, GAIN, POLE, friction=friction, runs=[step(h, 200) for h in (5.1, -4.2, 3.4, -2.7, 4.6)])
    )
    assert not any("dead time" in note for note in fit.notes)


def test_none_is_told_of_a_short_delay():
    volts = np.repeat([5.1, -4.2, 3.4, -2.7, 2.0, 4.6], 100)
    angle = np.cumsum(motion(np.concatenate([[0.0], volts[:-1]]), GAIN, POLE)[1])
    one = Segment("other", 0.0, True, {}, PERIOD * np.arange(600), volts, tick=np.arange(600), angle_rad=angle)
    fit = identify(Recording((one,), "late", PERIOD, supply_V=7.4, duty_delay_s=0.0))
    assert not any("dead time" in note for note in fit.notes)
