"""Recordings of known motors in plain numpy, for benchmarks and tests: exact zero-order hold, then the encoder."""

from typing import Any

import numpy as np
from scipy.signal import lfilter

from jaxmotor.recording import Recording, Segment

PERIOD, COUNTS, SUPPLY, SCALE = 0.005, 617.4, 7.4, 255
FINE = 50
"""Parts of a tick, of which counts are read some off."""
FREQUENCIES = tuple(np.geomspace(0.5, 10, 8) * 1.0037)


def held(volts):
    """What the bridge makes of `volts`."""
    return np.rint(SCALE * np.asarray(volts) / SUPPLY) / SCALE * SUPPLY


def motion(volts, gain, pole, period=PERIOD, speed=0.0):
    """Speed at each tick and angle turned until the next (recursion of the exact hold)."""
    p = np.exp(-pole * period)
    g = (1 - p) / (pole * period)
    after, _ = lfilter([gain * (1 - p)], [1, -p], volts, zi=[p * speed])
    at = np.concatenate([[speed], after[:-1]])
    return at, period * (g * at + gain * (1 - g) * volts)


def with_friction(volts, gain, pole, friction):
    """Angle at each tick of a motor with Coulomb friction [V]: exponentials from stop to stop, tick by tick."""
    angle, speed, now = np.empty(len(volts)), 0.0, 0.0
    for k, u in enumerate(volts):
        angle[k], left = now, PERIOD
        for _ in range(2):
            towards = np.sign(speed) if speed else np.sign(u) * (abs(u) > friction)
            if not towards:
                break
            final = gain * (u - towards * friction)
            stop = np.log(1 - speed / final) / pole if speed * final < 0 else np.inf
            time = min(stop, left)
            fall = np.exp(-pole * time)
            now += final * time + (speed - final) * (1 - fall) / pole
            speed = 0.0 if stop < left else final + (speed - final) * fall
            left -= time
            if left <= 0:
                break
    return angle


def sine(frequency, ticks=800, amplitude=5.1):
    volts = held(amplitude * np.sin(2 * np.pi * frequency * np.arange(ticks) * PERIOD))
    return "sine", {"frequency_Hz": float(frequency), "amplitude_V": amplitude}, volts


def step(volts, ticks=181):
    return "step", {"amplitude_V": float(volts)}, np.concatenate([[0.0], np.full(ticks - 1, held(volts))])


def plan(frequencies=FREQUENCIES, heights=(5.1, -4.2, 3.4, -2.7, 2.0, 4.6)):
    return [sine(f) for f in frequencies] + [step(h) for h in heights]


def counted(angles, runs, rng, **header):
    """Recording of shaft `angles` [rad], one array per run, through an encoder."""
    segments, turned, start = [], 0, 0.0
    for angle, (kind, parameters, volts) in zip(angles, runs, strict=True):
        count = np.floor(angle * COUNTS / (2 * np.pi) + rng.uniform()).astype(np.int64) + turned
        tick = np.arange(len(volts))
        segments.append(Segment(kind, start, True, parameters, tick * PERIOD, volts, tick=tick, count=count))
        turned, start = int(count[-1]), start + len(volts) * PERIOD + 0.5
    about: dict[str, Any] = {"period_s": PERIOD, "counts_per_rev": COUNTS, "supply_V": SUPPLY}
    return Recording(tuple(segments), "made.csv", duty_full_scale=float(SCALE), **(about | header))


def latched(parts, seed=1, gain=11.0, pole=40.0, **about):
    """Recording of `plan`, each tick in `FINE` exact parts; counts are read `parts` of them after the voltage changes,
    or before."""
    angles, runs = [], plan()
    for _, _, volts in runs:
        fine = np.concatenate([np.zeros(FINE), np.repeat(volts, FINE), np.full(FINE, volts[-1])])
        turned = np.concatenate([[0.0], np.cumsum(motion(fine, gain, pole, PERIOD / FINE)[1])])
        angles.append(turned[FINE + parts :: FINE][: len(volts)])
    return counted(angles, runs, np.random.default_rng(seed), **about)


def recording(seed, gain=11.0, pole=40.0, offset=0.0, wander=0.0, torque=0.0, friction=0.0, runs=None):
    """A motor's recording; `wander` [counts²/tick] is added to positions, `torque` [V rms, 50 ms] to the input."""
    rng, runs = np.random.default_rng(seed), runs or plan()
    angles = []
    for _, _, volts in runs:
        volts = volts + offset
        if torque:
            keep = np.exp(-PERIOD / 0.05)
            volts = volts + lfilter([np.sqrt(1 - keep**2) * torque], [1, -keep], rng.normal(size=len(volts)))
        if friction:
            angle = with_friction(volts, gain, pole, friction)
        else:
            angle = np.concatenate([[0.0], np.cumsum(motion(volts, gain, pole)[1])[:-1]])
        walk = np.cumsum(rng.normal(size=len(volts))) * np.sqrt(wander) * 2 * np.pi / COUNTS
        angles.append(angle + walk)
    return counted(angles, runs, rng)
