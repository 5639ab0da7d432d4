"""What the input cannot tell apart: does the interval that allows for hidden laws hold the truth?

    python benchmarks/open_hypotheses.py [MOTORS [SEED]]

Random motors with one law that `identify` does not know, under inputs that show little: steps of one height, a PRBS of
one amplitude, levels of one direction. Each is integrated on a fine grid and counted by an encoder with a random
offset. A case is dangerous where gain or pole is more than five standard errors off and no note says so.
"""

import sys
from typing import NamedTuple

import numpy as np

from jaxmotor import Fit, JaxmotorError, Recording, identify
from jaxmotor.cli._runtime import prepare_jax
from jaxmotor.recording import Segment

INPUTS = ("steps of one height", "PRBS of one amplitude", "one direction")
LAWS = ("nothing", "friction", "dead zone", "drag", "load", "delay")
FINE = 40
"""Steps of the integration in one row."""
PERIOD = 0.005
SUPPLY = 12.0


class Case(NamedTuple):
    """A recording and the truth behind it."""

    recording: Recording
    gain: float
    pole: float


def case(rng: np.random.Generator, given: str, law: str) -> Case:
    """A random motor of 3-20 rad/s/V and 8-60 rad/s with `law` under the input `given`."""
    gain, pole = rng.uniform(3.0, 20.0), np.exp(rng.uniform(np.log(8.0), np.log(60.0)))
    height = rng.uniform(2.0, 10.0)
    counts = float(rng.integers(300, 3000))
    size = rng.uniform(0.02, 0.4) * height
    runs = _runs(rng, given, height, max(int(6.0 / (pole * PERIOD)), 20))
    segments = []
    for number, volts in enumerate(runs):
        angle = _motion(gain, pole, volts, law, size, 1.0 if law != "delay" else rng.uniform(0.1, 2.0))
        count = np.floor(angle * counts / (2 * np.pi) + rng.uniform()).astype(np.int64)
        tick = np.arange(len(volts))
        kind = "step" if given == INPUTS[0] else "prbs" if given == INPUTS[1] else "other"
        segments.append(Segment(kind, 60.0 * number, True, {}, tick * PERIOD, volts, tick=tick, count=count))
    made = Recording(tuple(segments), f"{given}, {law}", PERIOD, counts, supply_V=SUPPLY, count_resets=True)
    return Case(made, gain, pole)


def _runs(rng: np.random.Generator, given: str, height: float, settle: int) -> list[np.ndarray]:
    """Voltages of each segment, which begins at rest."""
    if given == INPUTS[0]:
        return [np.full(settle, height * sign) for sign in (1, -1) * 5]
    if given == INPUTS[1]:
        return [height * np.repeat(rng.choice([-1.0, 1.0], 40), settle // 4) for _ in range(2)]
    return [np.repeat(rng.uniform(0.5, 1.0, 12) * height, settle // 2) for _ in range(2)]


def _motion(gain: float, pole: float, volts: np.ndarray, law: str, size: float, late: float) -> np.ndarray:
    """Angle [rad] at each row: w' = a (K (u - law) - w), in exact steps of a `FINE`th of a row."""
    drive = np.repeat(volts, FINE)
    if law == "delay":
        shift = round(late * FINE)
        drive = np.concatenate([np.zeros(shift), drive])[: len(drive)]
    if law == "dead zone":
        drive = np.sign(drive) * np.maximum(np.abs(drive) - size, 0.0)
    if law == "load":
        drive = drive - 0.3 * size
    fine = PERIOD / FINE
    keep, top = np.exp(-pole * fine), gain * np.abs(volts).max()
    friction, drag = (size if law == "friction" else 0.0), (size if law == "drag" else 0.0)
    angle, speed, turned = np.empty(len(drive)), 0.0, 0.0
    for step, volt in enumerate(drive.tolist()):
        angle[step] = turned
        free = keep * speed + gain * (1 - keep) * (volt - drag * speed * abs(speed) / top**2)
        drop = gain * (1 - keep) * friction
        new = 0.0 if abs(free) <= drop else free - drop * (1 if free > 0 else -1)
        turned += 0.5 * (speed + new) * fine
        speed = new
    return angle[::FINE]


def errors(fit: Fit, made: Case) -> np.ndarray:
    """Of gain and pole in standard errors of the conditional interval."""
    off = np.array([float(fit.motor.gain) - made.gain, float(fit.motor.pole) - made.pole])
    return off / np.array([float(fit.standard_error.gain), float(fit.standard_error.pole)])


class Result(NamedTuple):
    """What was found of one case."""

    z: float
    """The larger error of gain and pole, in conditional standard errors."""
    allowed: bool
    """Both are inside the intervals that allow for hidden laws."""
    told: bool
    """A note says that the motor does more, or which law is open."""
    open_laws: tuple[str, ...]


def result(given: str, law: str, seed: list[int]) -> Result | None:
    """None where the recording was refused."""
    made = case(np.random.default_rng(seed), given, law)
    try:
        fit = identify(made.recording)
    except JaxmotorError:
        return None
    assert fit.allowed is not None
    inside = fit.allowed.gain[0] <= made.gain <= fit.allowed.gain[1]
    inside &= fit.allowed.pole[0] <= made.pole <= fit.allowed.pole[1]
    told = bool(fit.open_hypotheses) or any("does more than a linear one" in note for note in fit.notes)
    return Result(float(np.abs(errors(fit, made)).max()), inside, told, tuple(one.name for one in fit.open_hypotheses))


def main() -> None:
    given = [int(text) for text in sys.argv[1:]]
    motors, seed = [*given, *(10, 0)[len(given) :]]
    prepare_jax()
    print("| input | hidden | cases | inside | beyond 5 standard errors | of these without a word |")
    print("|---|---|---|---|---|---|")
    total = np.zeros(4, int)
    for number, shown in enumerate(INPUTS):
        for law in LAWS:
            tried = [result(shown, law, [seed, motor, number]) for motor in range(motors)]
            found = [one for one in tried if one is not None]
            far = [one for one in found if one.z > 5]
            silent = sum(not one.told for one in far)
            counts = (len(found), sum(one.allowed for one in found), len(far), silent)
            total += counts
            print(f"| {shown} | {law} | {' | '.join(map(str, counts))} |", flush=True)
    print(f"| all | | {' | '.join(map(str, total.tolist()))} |")


if __name__ == "__main__":
    main()
