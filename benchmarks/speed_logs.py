"""Logs of speeds: is the noise found, and do the intervals of gain and pole hold the truth?

    python benchmarks/speed_logs.py [MOTORS [SEED]]

Random linear motors under voltages of random height and length, simulated on a fine grid by scipy. The speed is the
mean over 1 to 20 rows, which the log states, or comes through a first-order filter, which it cannot; rows are even or
not; the noise, 0.1 to 5 % of the motion, is white or an autoregression whose memory is up to 20 rows.
"""

import sys
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from scipy.linalg import expm
from scipy.signal import lfilter

from jaxmotor import JaxmotorError, Recording, identify
from jaxmotor.cli._runtime import prepare_jax
from jaxmotor.recording import Segment

ROWS = 2000
SEEN = ("instantaneous", "one row", "window", "uneven", "filter")
FINE = 20
"""Steps of the simulation in one row."""


class SpeedLog(NamedTuple):
    """A log and the truth behind it."""

    recording: Recording
    gain: float
    pole: float
    noise: float
    """Standard deviation [rad/s]."""
    seen: str
    """How the speed was made."""


class Result(NamedTuple):
    """What was found of one log."""

    seen: str
    noise: float
    """Level found over the true one."""
    chi2: float
    z: tuple[float, float]
    """Errors of gain and pole in standard errors."""


def speed_log(rng: np.random.Generator, seen: str, rows: int = ROWS) -> SpeedLog:
    """`seen` is one of `SEEN`; "uneven" is a window, too."""
    gain, pole = rng.uniform(3.0, 50.0), np.exp(rng.uniform(np.log(4.0), np.log(80.0)))
    period = rng.uniform(0.05, 0.4) / pole
    fine = period / FINE
    steps = np.full(rows, FINE)
    if seen == "uneven":
        steps = rng.integers(FINE // 2, 2 * FINE, rows)
    at = np.concatenate([[0], np.cumsum(steps)])
    volts = _volts(rng, rows, 3.0 / (pole * period))
    speed, angle = _motion(gain, pole, np.repeat(volts, steps), fine)
    window = 0
    if seen in ("one row", "window", "uneven"):
        window = FINE if seen == "one row" else int(rng.integers(1, 20 * FINE))
        padded = np.concatenate([np.zeros(window), angle])
        speed = (padded[window:] - padded[: len(angle)]) / (window * fine)
    elif seen == "filter":
        keep = np.exp(-1 / (rng.uniform(0.5, 5.0) * FINE))
        speed = np.asarray(lfilter([1 - keep], [1, -keep], speed))
    read = speed[at[:-1]]
    level = 10 ** rng.uniform(-3, np.log10(0.05)) * read.std()
    read = read + level * _coloured(rng, rows)
    segment = Segment("other", 0.0, True, {}, at[:-1] * fine, volts, speed_rad_s=read)
    if seen != "uneven":
        segment = Segment("other", 0.0, True, {}, at[:-1] * fine, volts, tick=np.arange(rows), speed_rad_s=read)
    recording = Recording(
        (segment,), seen, None if seen == "uneven" else period, speed_window_s=window * fine, supply_V=24.0
    )
    return SpeedLog(recording, gain, pole, level, seen)


def _volts(rng: np.random.Generator, rows: int, hold: float) -> np.ndarray:
    """Random heights, each held for `hold` rows in the mean."""
    lengths = 1 + rng.geometric(1 / hold, rows)
    return np.concatenate([[0.0], np.repeat(rng.uniform(-12, 12, rows), lengths)])[:rows]


def _motion(gain: float, pole: float, volts: np.ndarray, step: float) -> tuple[np.ndarray, np.ndarray]:
    """Speed [rad/s] and angle [rad] at the beginning of each `step` [s]."""
    rates = np.array([[-pole, 0.0, gain * pole], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    exact = np.asarray(expm(rates * step))
    keep, push, turn, push_turn = exact[0, 0], exact[0, 2], exact[1, 0], exact[1, 2]
    speed = np.asarray(lfilter([0.0, push], [1.0, -keep], volts))
    angle = np.concatenate([[0.0], np.cumsum(turn * speed + push_turn * volts)[:-1]])
    return speed, angle


def _coloured(rng: np.random.Generator, rows: int) -> np.ndarray:
    """Unit noise: white, or remembered for up to 20 rows."""
    memory = rng.choice([0.0, rng.uniform(1.0, 20.0)])
    keep = np.exp(-1 / memory) if memory else 0.0
    warm_up = 500
    return (
        np.sqrt(1 - keep**2) * np.asarray(lfilter([1.0], [1.0, -keep], rng.standard_normal(rows + warm_up)))[warm_up:]
    )


def results(motors: int, seed: int, seen: str) -> Iterator[Result | str]:
    """One for each motor; a sentence where it was refused."""
    for number in range(motors):
        log = speed_log(np.random.default_rng([seed, number]), seen)
        try:
            fit = identify(log.recording)
        except JaxmotorError as error:
            yield str(error)
            continue
        errors = fit.standard_error
        z = (
            (float(fit.motor.gain) - log.gain) / float(errors.gain),
            (float(fit.motor.pole) - log.pole) / float(errors.pole),
        )
        yield Result(seen, fit.noise.level / log.noise, fit.chi2_per_sample, z)


def summary(found: list[Result]) -> str:
    """Spread of noise and chi2, and how many intervals held, as cells of a table."""
    spreads = []
    for values in ([one.noise for one in found], [one.chi2 for one in found]):
        spreads.append(", ".join(f"{value:.2f}" for value in np.quantile(values, [0.05, 0.5, 0.95])))
    gain, pole = 100 * np.mean(np.abs([one.z for one in found]) < 1.96, axis=0)
    return f"{spreads[0]} | {spreads[1]} | {gain:.1f} | {pole:.1f}"


def main() -> None:
    given = [int(text) for text in sys.argv[1:]]
    motors, seed = [*given, *(100, 0)[len(given) :]]
    prepare_jax()
    print("| speed | logs | noise found / true: 5, 50, 95 % | chi2: 5, 50, 95 % | gain held, % | pole held, % |")
    print("|---|---|---|---|---|---|")
    for seen in SEEN:
        found = list(results(motors, seed, seen))
        kept = [one for one in found if isinstance(one, Result)]
        print(f"| {seen} | {len(kept)} of {motors} | {summary(kept)} |", flush=True)
        for refused in [one for one in found if isinstance(one, str)]:
            print(refused)


if __name__ == "__main__":
    main()
