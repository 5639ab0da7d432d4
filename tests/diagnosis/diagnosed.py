"""Recordings of one shape with something hidden in them, each diagnosed once: diagnosing compiles for seconds."""

import functools

import numpy as np
from scipy.signal import lfilter
from testing.made import PERIOD, counted, motion, plan, recording, sine

from jaxmotor import diagnose

RUNS = [*plan(), *(sine(f, amplitude=2.0) for f in (0.7037, 1.507, 3.011))]
GAIN, POLE = 11.0, 40.0


def hidden(seed, change):
    """A recording whose true voltage is `change(volts, time since the recording began)`."""
    rng, angles, begin = np.random.default_rng(seed), [], 0.0
    for _, _, volts in RUNS:
        time = begin + np.arange(len(volts)) * PERIOD
        angles.append(np.concatenate([[0.0], np.cumsum(motion(change(volts, time), GAIN, POLE)[1])[:-1]]))
        begin = time[-1] + 0.505
    return counted(angles, RUNS, rng)


def filtered(seed, time_constant, fine=50):
    """A recording whose angle was filtered, in `fine` exact steps a tick."""
    angles, keep = [], np.exp(-PERIOD / fine / time_constant)
    for _, _, volts in RUNS:
        turns = motion(np.repeat(volts, fine), GAIN, POLE, PERIOD / fine)[1]
        angle = np.concatenate([[0.0], np.cumsum(turns)[:-1]])
        angles.append(lfilter([1 - keep], [1, -keep], angle)[::fine])
    return counted(angles, RUNS, np.random.default_rng(seed))


MADE = {
    "clean": lambda: recording(0, gain=8.0, pole=20.0, runs=RUNS),
    "fast": lambda: recording(1, gain=13.0, pole=60.0, runs=RUNS),
    "friction": lambda: recording(3, friction=0.3, runs=RUNS),
    "delay": lambda: hidden(0, lambda volts, time: np.concatenate([[0.0], volts[:-1]])),
    "threshold": lambda: hidden(5, lambda volts, time: np.where(np.abs(volts) >= 0.83, volts, 0.0)),
    "clip": lambda: hidden(1, lambda volts, time: np.clip(volts, -3.8, 3.8)),
    "late": lambda: hidden(2, lambda volts, time: volts - 0.25 * (time > 21.0)),
    "periodic": lambda: hidden(3, lambda volts, time: volts + 0.2 * np.sin(2 * np.pi * 3.3 * time)),
    "lag": lambda: filtered(4, 8e-3),
}


@functools.cache
def of(name):
    """Recordings of one shape, each diagnosed once."""
    made = MADE[name]()
    return made, diagnose(made)
