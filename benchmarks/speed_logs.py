"""Logs of speeds: is the noise found, and do the intervals of gain and pole hold the truth?

    python benchmarks/speed_logs.py [MOTORS [SEED]] [--diagnose]

Random linear motors under voltages of random height and length, simulated exactly on a fine grid by scipy. The speed is
the mean over 1 to 20 rows, or comes through a first-order filter of 0.5 to 5 rows; rows are even or not; the noise, 0.1
to 5 % of the motion, is white or an autoregression whose memory is up to 20 rows. "Smoothed" speeds have no such noise:
they are what an encoder counted in each row (30 to 1000 counts at the highest speed), smoothed from row to row with a
weight of 0.1 to 0.8 and printed in rpm with two decimals. The header states the window, or nothing of how the speeds
were made: a window is near where it is within 5 % of the true one. `--diagnose` diagnoses the logs that state nothing
instead. Where a filter is slower than its motor the pole is that of the filter: which of the two is which no log of
speeds of a linear motor says.
"""

import argparse
import dataclasses
import math
from collections import Counter
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from scipy.linalg import expm
from scipy.signal import lfilter

from jaxmotor import JaxmotorError, Recording, diagnose, identify
from jaxmotor._runtime import keep_programs
from jaxmotor.estimate import SpeedAverage
from jaxmotor.recording import Segment

ROWS = 2000
SEEN = ("instantaneous", "one row", "window", "uneven", "filter", "smoothed")
UNSTATED = ("filter", "smoothed")
"""No header states these."""
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
    length_s: float
    """Of the window, or the filter's time constant [s]."""

    @property
    def unstated(self) -> Recording:
        """With a header that does not say how the speed was made."""
        return dataclasses.replace(self.recording, speed_window_s=None)


class Result(NamedTuple):
    """What was found of one log."""

    seen: str
    noise: float
    """Level found over the true one."""
    chi2: float
    z: tuple[float, float]
    """Errors of gain and pole in standard errors."""
    length: float = math.nan
    """Of the window or filter found, over the true one; infinite where there is none."""
    said: str = ""
    """What the diagnosis says, and the effects that it names."""


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
    window, lag = 0, 0.0
    if seen in ("one row", "window", "uneven"):
        window = FINE if seen == "one row" else int(rng.integers(1, 20 * FINE))
        padded = np.concatenate([np.zeros(window), angle])
        speed = (padded[window:] - padded[: len(angle)]) / (window * fine)
    elif seen == "filter":
        lag = rng.uniform(0.5, 5.0) * period
        other, _ = _motion(1.0, 1 / lag, np.repeat(volts, steps), fine)
        # Two lags in a row are a difference of two side by side.
        speed = (gain * pole * other - speed / lag) / (pole - 1 / lag)
    read = speed[at[:-1]]
    if seen == "smoothed":
        read, level = _smoothed(rng, angle[at[:-1]], period)
        segment = Segment("other", 0.0, True, {}, at[:-1] * fine, volts, tick=np.arange(rows), speed_rad_s=read)
        recording = Recording((segment,), seen, period, speed_window_s=period, supply_V=24.0)
        return SpeedLog(recording, gain, pole, level, seen, period)
    level = 10 ** rng.uniform(-3, np.log10(0.05)) * read.std()
    read = read + level * _coloured(rng, rows)
    segment = Segment("other", 0.0, True, {}, at[:-1] * fine, volts, speed_rad_s=read)
    if seen != "uneven":
        segment = Segment("other", 0.0, True, {}, at[:-1] * fine, volts, tick=np.arange(rows), speed_rad_s=read)
    recording = Recording(
        (segment,), seen, None if seen == "uneven" else period, speed_window_s=window * fine, supply_V=24.0
    )
    return SpeedLog(recording, gain, pole, level, seen, lag or window * fine)


def _smoothed(rng: np.random.Generator, angle: np.ndarray, period: float) -> tuple[np.ndarray, float]:
    """Speeds of an encoder's counts in each row, smoothed; and the standard deviation of those before [rad/s]."""
    count = np.abs(np.diff(angle)).max() / np.exp(rng.uniform(np.log(30), np.log(1000)))
    mean = np.diff(np.floor(angle / count), prepend=0.0) * count / period
    weight = rng.uniform(0.1, 0.8)
    smoothed = np.asarray(lfilter([weight], [1.0, weight - 1.0], mean))
    rpm = 60 / (2 * np.pi)
    return np.round(smoothed * rpm, 2) / rpm, count / period / np.sqrt(6)


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


def results(motors: int, seed: int, seen: str, stated: bool = True) -> Iterator[Result | str]:
    """One for each motor; a sentence where it was refused."""
    for number in range(motors):
        log = speed_log(np.random.default_rng([seed, number]), seen)
        try:
            fit = identify(log.recording if stated else log.unstated)
        except JaxmotorError as error:
            yield str(error)
            continue
        z = assessed(log, fit.motor, (float(fit.standard_error.gain), float(fit.standard_error.pole)))
        length = math.nan if stated else length_of(log, fit.average)
        yield Result(seen, fit.noise.level / log.noise, fit.chi2_per_sample, z, length)


def diagnosed(motors: int, seed: int, seen: str) -> Iterator[Result]:
    """The same of `diagnose`, of logs that do not state how the speed was made."""
    for number in range(motors):
        log = speed_log(np.random.default_rng([seed, number]), seen)
        found = diagnose(log.unstated)
        errors = found.standard_error
        z = assessed(log, found.motor.linear, (errors["gain_rad_s_V"], errors["pole_rad_s"]))
        said = ", ".join([found.outcome, *(effect.name for effect in found.effects)])
        level, chi2 = found.fit.noise.level / log.noise, found.whole.after.chi2_per_sample
        yield Result(seen, level, chi2, z, length_of(log, found.average), said)


def assessed(log: SpeedLog, motor: Any, errors: tuple[float, float]) -> tuple[float, float]:
    """Errors of gain and pole in standard errors; the pole is the slower one of motor and filter."""
    pole = min(log.pole, 1 / log.length_s) if log.seen == "filter" else log.pole
    return (float(motor.gain) - log.gain) / errors[0], (float(motor.pole) - pole) / errors[1]


def length_of(log: SpeedLog, average: SpeedAverage | None) -> float:
    """The length that was found over the true one, 1 where there is none and none was found, else infinite."""
    kind = {"instantaneous": None, "filter": "filter"}.get(log.seen, "window")
    if average is None or average.kind != kind:
        return 1.0 if average is None and kind is None else math.inf
    return average.length_s / (min(log.length_s, 1 / log.pole) if kind == "filter" else log.length_s)


def summary(found: list[Result]) -> str:
    """Spread of noise and chi2, and how many intervals held, as cells of a table."""
    spreads = []
    for values in ([one.noise for one in found], [one.chi2 for one in found]):
        spreads.append(", ".join(f"{value:.2f}" for value in np.quantile(values, [0.05, 0.5, 0.95])))
    gain, pole = 100 * np.mean(np.abs([one.z for one in found]) < 1.96, axis=0)
    return f"{spreads[0]} | {spreads[1]} | {gain:.1f} | {pole:.1f}"


def row(name: str, motors: int, found: list[Result | str]) -> str:
    kept = [one for one in found if isinstance(one, Result)]
    lengths = np.array([one.length for one in kept])
    near = "" if np.isnan(lengths).any() else f"{100 * np.mean(np.abs(lengths - 1) < 0.05):.1f}"
    said = ", ".join(f"{number} {words}" for words, number in Counter(one.said for one in kept).most_common() if words)
    return f"| {name} | {len(kept)} of {motors} | {summary(kept)} | {near} | {said} |"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("motors", metavar="MOTORS", nargs="?", type=int, default=100)
    parser.add_argument("seed", metavar="SEED", nargs="?", type=int, default=0)
    parser.add_argument("--diagnose", action="store_true")
    chosen = parser.parse_args()
    motors, seed = chosen.motors, chosen.seed
    keep_programs(threads=chosen.diagnose)
    columns = "speed | logs | noise found / true: 5, 50, 95 % | chi2: 5, 50, 95 % | gain held, % | pole held, %"
    print(f"| {columns} | length within 5 %, % | diagnosis |\n|---|---|---|---|---|---|---|---|")
    if chosen.diagnose:
        for seen in SEEN:
            print(row(f"{seen}, not stated", motors, list(diagnosed(motors, seed, seen))), flush=True)
        return
    for stated, seen in [(True, seen) for seen in SEEN if seen not in UNSTATED] + [(False, seen) for seen in SEEN]:
        found = list(results(motors, seed, seen, stated))
        print(row(seen if stated else f"{seen}, not stated", motors, found), flush=True)
        for refused in [one for one in found if isinstance(one, str)]:
            print(refused)


if __name__ == "__main__":
    main()
