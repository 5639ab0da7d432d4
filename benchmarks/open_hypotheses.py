"""What the input cannot tell apart: does the interval that allows for hidden laws hold the truth?

    python benchmarks/open_hypotheses.py [MOTORS [DIAGNOSED [SEED]]]

Random motors with one or two laws that `identify` does not know, under inputs that show little: steps of one height, a
PRBS of one amplitude, levels of one direction. Each is integrated on a fine grid and counted by an encoder with a
random offset, or its speed is logged. A case is dangerous where gain or pole is more than five standard errors off and
nothing says so. MOTORS of each are identified, DIAGNOSED of each diagnosed.
"""

import argparse
import dataclasses
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.linalg import expm

from jaxmotor import Fit, JaxmotorError, Recording, identify
from jaxmotor._runtime import keep_programs
from jaxmotor.diagnosis import diagnose
from jaxmotor.estimate import Allowed
from jaxmotor.recording import Segment

INPUTS = ("steps of one height", "PRBS of one amplitude", "one direction")
LAWS = (
    *("nothing", "friction", "dead zone", "drag", "load", "delay", "electrical lag"),
    *("friction + delay", "friction + dead zone", "load + drag"),
)
SIZED = ("friction", "dead zone", "drag", "load")
FINE = 40
"""Steps of the integration in one row."""
PERIOD = 0.005
SUPPLY = 12.0


class Case(NamedTuple):
    """A recording and the truth behind it."""

    recording: Recording
    gain: float
    pole: float


def case(rng: np.random.Generator, given: str, law: str, measured: str = "count") -> Case:
    """A random motor of 3-20 rad/s/V and 8-60 rad/s with the laws of `law` under the input `given`.

    `measured` "speed" is the mean over the last row with white noise of 0.1 to 2 % of the motion.
    """
    gain, pole = rng.uniform(3.0, 20.0), np.exp(rng.uniform(np.log(8.0), np.log(60.0)))
    height = rng.uniform(2.0, 10.0)
    counts = float(rng.integers(300, 3000))
    hidden = law.split(" + ")
    size = rng.uniform(0.02, 0.4) * height / (len(hidden) if "dead zone" in hidden else 1)
    late = rng.uniform(0.1, 2.0) if "delay" in hidden else 0.0
    lag = rng.uniform(2e-4, 2e-3) if "electrical lag" in hidden else 0.0
    noise = 10 ** rng.uniform(-3.0, np.log10(0.02))
    segments = []
    for number, volts in enumerate(_runs(rng, given, height, max(int(6.0 / (pole * PERIOD)), 20))):
        angle = _motion(
            gain,
            pole,
            volts,
            _Hidden(**{name.replace(" ", "_"): size for name in hidden if name in SIZED}, late=late, lag_s=lag),
        )
        tick = np.arange(len(volts))
        kind = "step" if given == INPUTS[0] else "prbs" if given == INPUTS[1] else "other"
        one = Segment(kind, 60.0 * number, True, {}, tick * PERIOD, volts, tick=tick)
        if measured == "speed":
            mean = np.diff(angle, prepend=0.0) / PERIOD
            one = dataclasses.replace(one, speed_rad_s=mean + noise * mean.std() * rng.standard_normal(len(mean)))
        else:
            turned = angle * counts / (2 * np.pi) + rng.uniform()
            one = dataclasses.replace(one, count=np.floor(turned).astype(np.int64))
        segments.append(one)
    made = Recording(tuple(segments), f"{given}, {law}", PERIOD, supply_V=SUPPLY, speed_window_s=PERIOD)
    if measured == "count":
        made = dataclasses.replace(made, counts_per_rev=counts, count_resets=True, speed_window_s=None)
    return Case(made, gain, pole)


def _runs(rng: np.random.Generator, given: str, height: float, settle: int) -> list[np.ndarray]:
    """Voltages of each segment, which begins at rest."""
    if given == INPUTS[0]:
        return [np.full(settle, height * sign) for sign in (1, -1) * 5]
    if given == INPUTS[1]:
        return [height * np.repeat(rng.choice([-1.0, 1.0], 40), settle // 4) for _ in range(2)]
    return [np.repeat(rng.uniform(0.5, 1.0, 12) * height, settle // 2) for _ in range(2)]


class _Hidden(NamedTuple):
    """Amounts of the laws."""

    friction: float = 0.0
    """[V], as the next three."""
    dead_zone: float = 0.0
    drag: float = 0.0
    """At the highest speed."""
    load: float = 0.0
    late: float = 0.0
    """[rows]."""
    lag_s: float = 0.0


def _motion(gain: float, pole: float, volts: np.ndarray, hidden: _Hidden) -> np.ndarray:
    """Angle [rad] at each row: w' = a (K (u - laws) - w), in exact steps of a `FINE`th of a row."""
    drive = np.repeat(volts, FINE)
    shift = round(hidden.late * FINE)
    drive = np.concatenate([np.zeros(shift), drive])[: len(drive)]
    drive = np.sign(drive) * np.maximum(np.abs(drive) - hidden.dead_zone, 0.0) - 0.3 * hidden.load
    fine, top = PERIOD / FINE, gain * np.abs(volts).max()
    if hidden.lag_s:
        return _lagging(gain, pole, drive, hidden.lag_s)[::FINE]
    keep = np.exp(-pole * fine)
    angle, speed, turned = np.empty(len(drive)), 0.0, 0.0
    for step, volt in enumerate(drive.tolist()):
        angle[step] = turned
        free = keep * speed + gain * (1 - keep) * (volt - hidden.drag * speed * abs(speed) / top**2)
        drop = gain * (1 - keep) * hidden.friction
        new = 0.0 if abs(free) <= drop else free - drop * (1 if free > 0 else -1)
        turned += 0.5 * (speed + new) * fine
        speed = new
    return angle[::FINE]


def _lagging(gain: float, pole: float, drive: np.ndarray, lag_s: float) -> np.ndarray:
    """Angle [rad] at each fine step of τ w'' + w' + a w = a K u, exactly."""
    rates = np.zeros((4, 4))
    rates[0, 1] = rates[1, 2] = 1.0
    rates[2, 1:] = -pole / lag_s, -1 / lag_s, pole * gain / lag_s
    exact = np.asarray(expm(rates * PERIOD / FINE))[:3]
    state, angle = np.zeros(3), np.empty(len(drive))
    for step, volt in enumerate(drive):
        angle[step] = state[0]
        state = exact @ np.append(state, volt)
    return angle


class Result(NamedTuple):
    """What was found of one case."""

    z: float
    """The larger error of gain and pole, in standard errors if nothing else were there."""
    allowed: bool
    """Both are inside the intervals that allow for hidden laws."""
    told: bool
    """It is said that the motor does more, or which law is open."""
    complete: bool
    """`diagnose` calls the linear motor complete."""


def errors(fit: Fit, made: Case) -> np.ndarray:
    """Of gain and pole in standard errors of the conditional interval."""
    off = np.array([float(fit.motor.gain) - made.gain, float(fit.motor.pole) - made.pole])
    return off / np.array([float(fit.standard_error.gain), float(fit.standard_error.pole)])


def identified(made: Case) -> Result:
    fit = identify(made.recording)
    told = bool(fit.open_hypotheses) or any("does more than a linear one" in note for note in fit.notes)
    return Result(float(np.abs(errors(fit, made)).max()), _inside(fit.allowed, made), told, False)


def diagnosed(made: Case) -> Result:
    found = diagnose(made.recording)
    linear, error = found.motor.linear, found.standard_error
    off = np.array([float(linear.gain) - made.gain, float(linear.pole) - made.pole])
    z = np.abs(off / np.array([error["gain_rad_s_V"], error["pole_rad_s"]])).max()
    told = bool(found.open_hypotheses) or found.verdict == "unexplained"
    return Result(float(z), _inside(found.allowed, made), told, found.verdict == "complete")


def _inside(allowed: Allowed | None, made: Case) -> bool:
    assert allowed is not None
    return bool(allowed.gain[0] <= made.gain <= allowed.gain[1] and allowed.pole[0] <= made.pole <= allowed.pole[1])


def result(
    given: str, law: str, seed: list[int], measured: str = "count", by: Callable[[Case], Result] = identified
) -> Result | None:
    """None where the recording was refused."""
    try:
        return by(case(np.random.default_rng(seed), given, law, measured))
    except JaxmotorError:
        return None


def table(by: Callable[[Case], Result], measured: str, motors: int, seed: int) -> None:
    """Print a row for each input and law."""
    print(f"\n{by.__name__}, logs of {measured}s\n")
    print("| input | hidden | cases | inside | beyond 5 standard errors | of these without a word | complete |")
    print("|---|---|---|---|---|---|---|")
    total = np.zeros(5, int)
    for number, given in enumerate(INPUTS):
        for law in LAWS:
            tried = [result(given, law, [seed, motor, number], measured, by) for motor in range(motors)]
            found = [one for one in tried if one is not None]
            far = [one for one in found if one.z > 5]
            silent, complete = sum(not one.told for one in far), sum(one.complete for one in found)
            counts = (len(found), sum(one.allowed for one in found), len(far), silent, complete)
            total += counts
            print(f"| {given} | {law} | {' | '.join(map(str, counts))} |", flush=True)
    print(f"| all | | {' | '.join(map(str, total.tolist()))} |")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name, usual in (("MOTORS", 7), ("DIAGNOSED", 1), ("SEED", 0)):
        parser.add_argument(name, nargs="?", type=int, default=usual)
    motors, few, seed = vars(parser.parse_args()).values()
    keep_programs(threads=True)
    for by, number in ((identified, motors), (diagnosed, few)):
        for measured in ("count", "speed"):
            table(by, measured, number, seed)


if __name__ == "__main__":
    main()
