"""Gain and pole where the supply sags and drifts, and was logged: against the same motors on a stiff supply.

    make firmware && python benchmarks/supply.py [MOTORS]

Random linear motors on random plans (those of the blind tests, without closed loops) on the emulated bench's plant.
Their supply has a resistance of 12 to 35 % of the winding's, or falls by 4 to 10 % over the recording, or both. It is
logged with every row in millivolts as it is at the row, or with every row as it is from there on. Errors are root
mean squares over motors, in percent. (`board`, for the tests: a converter of 19.68 mV, averaged, told every 100 ms.)
"""

import argparse
import dataclasses
from typing import NamedTuple

import numpy as np
from hidden import plant_file, sizes
from testing.hidden_plans import Experiment, Loop, Rig, draw_plan, draw_rig
from testing.plant import Plant

from jaxmotor import Recording, identify
from jaxmotor._runtime import keep_programs
from jaxmotor.recording import Segment, supplied

MOTORS = 50
LOGS = ("each row", "from the row")
SUPPLIES = {"stiff": ("nothing",), "drifts": LOGS, "sags": LOGS, "both": ("nothing", *LOGS)}
"""And how each is logged."""
HAS = {"stiff": (), "drifts": ("supply_drift",), "sags": ("supply_sag",), "both": ("supply_sag", "supply_drift")}
ADC_STEP_V = 19.679e-3
TOLD_S = 0.1
MS = 1e-3


@dataclasses.dataclass(frozen=True)
class Driven:
    """An experiment on the plant: (n,) per row, and (m,) per millisecond."""

    experiment: Experiment
    start_s: float
    duty: np.ndarray
    count: np.ndarray
    supply_V: np.ndarray
    """Before each millisecond."""


class Drawn(NamedTuple):
    """A motor and its plan."""

    rig: Rig
    plan: list[Experiment]
    rests_s: np.ndarray
    plants: dict[str, str]
    """The plant files by the names of supplies."""


def draw(seed: int) -> Drawn:
    """A random motor with all its supplies."""
    of_rig, of_plan, of_sizes = (np.random.default_rng(child) for child in np.random.SeedSequence(seed).spawn(3))
    rig = draw_rig(of_rig)
    plan = [experiment for experiment in draw_plan(rig, of_plan) if not isinstance(experiment.drive, Loop)]
    rests = np.round(np.maximum(of_plan.uniform(0.4, 0.8, len(plan)), 14 / rig.pole), 2)
    seconds = sum(experiment.ticks for experiment in plan) * rig.period_s + float(rests.sum())
    weak = {name: sizes(name, rig, seconds, of_sizes, 1.0) for name in ("supply_sag", "supply_drift")}
    return Drawn(
        rig, plan, rests, {name: plant_file(rig, {one: weak[one] for one in has}) for name, has in HAS.items()}
    )


def drive(drawn: Drawn, supply: str) -> list[Driven]:
    """The plan on the plant, in steps of a millisecond, as the board's converter sees it."""
    rig, driven, time = drawn.rig, [], 0.0
    pace = round(rig.period_s / MS)
    with Plant(drawn.plants[supply]) as plant:
        for experiment, rest in zip(drawn.plan, drawn.rests_s, strict=True):
            plant.hold(0.0, float(rest))
            time += float(rest)
            assert isinstance(experiment.drive, np.ndarray)
            volts = np.zeros(len(experiment.drive) * pace)
            fine = np.repeat(experiment.drive, pace)
            run = plant.sequence(fine, period_s=MS, full_scale=rig.full_scale, supply=volts)
            driven.append(Driven(experiment, round(time, 6), experiment.drive, run.count[::pace].copy(), volts))
            time += experiment.ticks * rig.period_s
    return driven


def recording(drawn: Drawn, driven: list[Driven], log: str) -> Recording:
    """What was driven, with its supply logged as `log` says."""
    rig = drawn.rig
    pace = round(rig.period_s / MS)
    segments = []
    for one in driven:
        tick, duty = np.arange(len(one.duty)), one.duty.astype(np.int64)
        segments.append(
            Segment(
                one.experiment.kind,
                one.start_s,
                True,
                dict(one.experiment.parameters),
                tick * rig.period_s,
                duty / rig.full_scale * rig.supply_V,
                tick=tick,
                duty=duty,
                count=one.count,
                supply_V=logged(one.supply_V, pace, log),
            )
        )
    made = Recording(
        tuple(segments),
        "supply.csv",
        period_s=rig.period_s,
        counts_per_rev=rig.counts_per_rev,
        duty_full_scale=float(rig.full_scale),
        supply_V=rig.supply_V,
        drive="brake",
    )
    return supplied(made)


def logged(supply_V: np.ndarray, pace: int, log: str) -> np.ndarray | None:
    """(n,) readings per row of (n pace,) volts per millisecond."""
    match log:
        case "each row":
            return np.round(supply_V[::pace], 3)
        case "from the row":
            return np.round(supply_V.reshape(-1, pace)[:, min(1, pace - 1) :].mean(axis=1), 3)
        case "board":
            return _board(supply_V, pace)
    return None


def _board(supply_V: np.ndarray, pace: int) -> np.ndarray:
    """As `firmware/motor_rig/adc.c`: sixteen times the converter's value, averaged, of which a row tells."""
    value = np.floor(supply_V / ADC_STEP_V).astype(int)
    total, sums = 16 * int(value[0]), np.empty(len(value), int)
    for k, now in enumerate(value.tolist()):
        sums[k] = total
        total += now - (total >> 4)
    reading = np.floor((sums[::pace] + 8) * ADC_STEP_V / 16 * 1000) / 1000
    told = np.arange(len(reading)) // round(TOLD_S / (pace * MS)) * round(TOLD_S / (pace * MS))
    return reading[told]


def errors(drawn: Drawn, of: Recording) -> np.ndarray:
    """(2,) of gain and pole [%]."""
    motor = identify(of).motor
    return 100 * np.array([float(motor.gain) / drawn.rig.gain - 1, float(motor.pole) / drawn.rig.pole - 1])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("motors", metavar="MOTORS", nargs="?", type=int, default=MOTORS)
    motors = parser.parse_args().motors
    keep_programs(threads=True)
    found: dict[tuple[str, str], list[np.ndarray]] = {}
    for seed in range(motors):
        drawn = draw(seed)
        for supply, logs in SUPPLIES.items():
            driven = drive(drawn, supply)
            for log in logs:
                found.setdefault((supply, log), []).append(errors(drawn, recording(drawn, driven, log)))
    stiff = np.sqrt(np.mean(np.square(found["stiff", "nothing"]), axis=0))
    print(f"{motors} motors. Root mean square errors [%], and over those on a stiff supply")
    print("| supply | logged | gain | pole | gain, over stiff | pole, over stiff |")
    print("|---|---|---|---|---|---|")
    for (supply, log), each in found.items():
        rms = np.sqrt(np.mean(np.square(each), axis=0))
        cells = [*(f"{value:.4f}" for value in rms), *(f"{value:.2f}" for value in rms / stiff)]
        print(f"| {supply} | {log} | {' | '.join(cells)} |")


if __name__ == "__main__":
    main()
