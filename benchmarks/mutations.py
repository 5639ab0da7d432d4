"""Plans, plants and models that are not what they should be: each has to be run, or refused in one short sentence.

    python benchmarks/mutations.py [--runs 5000] [--seed 0] [--show]

Each damaged file goes through the command line. The table counts what came of it: docs/reliability.md holds the figures
of a full run.
"""

import argparse
import contextlib
import dataclasses
import io
import json
import random
import re
import signal
import subprocess
import sys
import tempfile
import time
import tomllib
import warnings
from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from _mutate import HOW, Tree, mutated, to_toml
from testing.made import plan, recording

from jaxmotor import identify
from jaxmotor.cli import main
from jaxmotor.estimate import Model, model_to_json, to_json
from jaxmotor.motor import EFFECTS, linear_motor
from jaxmotor.recording import write

LIMIT_S = 5.0
"""A refusal takes less; what runs longer is a file that was taken, or it hangs."""
COMPILES_S = 60.0
"""What a model that is taken may need to compile its programs."""
SUBPROCESSES = 50
"""One of so many runs is a process of its own."""
LONGEST = 300
PLAN = """
name = "mutated"
period_ms = 5
drive = "brake"
supply_V = 7.4
counts_per_rev = 617.4
rest_s = 0.02
detune = true
travel_rev = 50
supply_min_V = 4.5
no_load_rad_s = 79
motor = "Pololu"
notes = "short"
[[experiment]]
kind = "sine"
frequency_Hz = [9, 11]
amplitude_V = 5.1
offset_V = 0.5
duration_s = 0.1
periods = 2
[[experiment]]
kind = "step"
amplitude_V = 3
duration_s = 0.05
rest_s = 0.05
repeat = 2
[[experiment]]
kind = "multisine"
first_Hz = 2
tones = 3
stride = 2
amplitude_V = 1
duration_s = 0.05
[[experiment]]
kind = "prbs"
amplitude_V = 4
order = 7
hold_ticks = 2
duration_s = 0.05
[[experiment]]
kind = "closed_loop"
reference_rad_s = 30
gain = 0.1
integral_gain = 1
duration_s = 0.05
[[experiment]]
kind = "chirp"
from_Hz = 1
to_Hz = 20
amplitude_V = 3
duration_s = 0.05
[[experiment]]
kind = "ramp"
from_V = -3
to_V = 3
duration_s = 0.05
[[experiment]]
kind = "rest"
duration_s = 0.05
"""
SHORT = '[[experiment]]\nkind = "step"\namplitude_V = 5\nduration_s = 0.1\nrest_s = 0\n'
RIG = """
[motor]
resistance_ohm = 4.5
inductance_H = 524e-6
gain_rad_s_V = 10.6
pole_rad_s = 40
viscous_share = 0.045
[battery]
volts_V = 7.4
resistance_ohm = 0.15
droop_V_per_As = 0.001
smoothing_s = 1e-3
cutoff_at_s = 100
cutoff_V = 0
[bridge]
diode_V = 0.7
[encoder]
counts_per_rev = 617.4
start_fraction = 0.5
start_angle_rad = 1
[wiring]
motor_swapped = false
encoder_swapped = false
unplugged_at_s = 100
jammed_at_s = 100
[bench]
seed = 51
step_s = 1e-5
pwm_edges = true
pwm_Hz = 4000
"""
PARTS = """
[transport_delay]
delay_s = 0.002
[dead_zone]
volts_V = 0.1
[input_threshold]
volts_V = 0.1
[voltage_offset]
volts_V = 0.1
[voltage_saturation]
volts_V = 7
[current_limit]
volts_V = 7
[direction_asymmetry]
ratio = 0.05
[supply_sag]
ratio = 0.1
[supply_drift]
rate_per_s = 0.001
[electrical_pole]
time_constant_s = 1e-3
[coast_drive]
[coulomb_friction]
volts_V = 0.3
[load_torque]
volts_V = 0.2
[stiction]
volts_V = 0.2
static_volts_V = 0.4
stribeck_speed_rad_s = 2
[quadratic_drag]
volts_V_s2_rad2 = 1e-4
[cogging]
volts_V = 0.2
cycles_per_rev = 12
phase_rad = 0.3
[winding_heating]
rise_ratio = 0.2
time_constant_s = 5
[shaft_compliance]
frequency_Hz = 15
damping_ratio = 0.1
inertia_ratio = 0.5
[backlash]
gap_rad = 0.02
inertia_ratio = 0.5
contact_frequency_Hz = 90
contact_damping_ratio = 0.3
[encoder_eccentricity]
amplitude_rad = 0.01
cycles_per_rev = 1
phase_rad = 0.2
[missed_counts]
ratio = 0.1
speed_rad_s = 20
[sensor_lag]
time_constant_s = 0.002
[late_load]
start_s = 0.1
volts_V = 0.2
[outside_torque]
frequency_Hz = 3
volts_V = 0.2
phase_rad = 0.1
[wandering_torque]
volts_V = 0.1
time_constant_s = 0.3
"""


class Overrun(BaseException):
    """The time is up."""


@dataclasses.dataclass(frozen=True)
class Outcome:
    """What the command line made of one file."""

    code: int | None
    """None: the time was up."""
    out: str
    err: str
    seconds: float

    @property
    def began(self) -> bool:
        """The file was taken: the motor moves, or a result is there."""
        return self.code in (0, None) and bool(self.out)

    @property
    def said(self) -> str:
        """The sentence, without what wrong usage prints above it."""
        return self.err.strip("\n").removeprefix("jaxmotor: ").rpartition("\nError: ")[2]

    def faults(self) -> list[str]:
        """What should not be."""
        wrong = []
        if self.code is None and not self.began:
            wrong.append("hangs")
        if self.code not in (0, 1, 2, None):
            wrong.append(f"exit {self.code}")
        if self.code in (1, 2) and self.seconds > LIMIT_S:
            wrong.append("slow")
        if self.code in (1, 2) and not 0 < len(self.said) <= LONGEST:
            wrong.append(f"{len(self.said)} characters")
        if self.code == 1 and (not self.err.startswith("jaxmotor: ") or "\n" in self.said):
            wrong.append("not one sentence")
        if self.code == 0 and self.err:
            wrong.append("speaks beside a result")
        if re.search(r"[\x00-\x08\x0b-\x1f\x7f-\x9f]", self.out + self.err):
            wrong.append("control characters")
        if re.search(r"Warning|Traceback", self.err):
            wrong.append("warning")
        return wrong


def in_process(arguments: Sequence[str], limit_s: float = LIMIT_S) -> Outcome:
    """Run `jaxmotor` with `arguments` here; every warning that it raises is printed, each time."""

    def ring(*_: object) -> None:
        raise Overrun

    out, err, began = io.StringIO(), io.StringIO(), time.perf_counter()
    before = signal.signal(signal.SIGALRM, ring)
    code = None
    try:
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err), warnings.catch_warnings():
            warnings.simplefilter("always")
            warnings.simplefilter("ignore", ResourceWarning)  # as Python does for a user
            signal.setitimer(signal.ITIMER_REAL, limit_s)
            with contextlib.suppress(Overrun):
                code = main(arguments)
            signal.setitimer(signal.ITIMER_REAL, 0)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)
    return Outcome(code, out.getvalue(), err.getvalue(), time.perf_counter() - began)


def in_subprocess(arguments: Sequence[str], limit_s: float = 60.0) -> Outcome:
    """Run `jaxmotor` with `arguments` as a user does. Its start, some seconds on a busy machine, is not counted."""
    began = time.perf_counter()
    command = [sys.executable, "-m", "jaxmotor", *arguments]
    try:
        done = subprocess.run(command, capture_output=True, timeout=limit_s, check=False, start_new_session=True)
    except subprocess.TimeoutExpired as late:
        return Outcome(None, _text(late.stdout), _text(late.stderr), time.perf_counter() - began)
    return Outcome(done.returncode, _text(done.stdout), _text(done.stderr), 0.0)


def _text(data: bytes | None) -> str:
    return (data or b"").decode("utf-8", "backslashreplace")


class Case(NamedTuple):
    """One run, and how to have it again."""

    outcome: Outcome
    command: list[str]
    number: int


Found = dict[tuple[str, str], list[Case]]
"""Runs by kind of file and of damage."""


class Kinds:
    """Plans, plants and models to damage, and the commands that read them."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._recording = folder / "rec.csv"
        write(recording(1, runs=plan((1.3,), (5.1, -3.0))), self._recording)
        (folder / "short.toml").write_text(SHORT)
        self._models = list(_models())

    def tree(self, kind: str, rng: random.Random) -> Tree:
        """A sound file of `kind`: for plans some of its experiments, for plants some of its effects."""
        if kind == "model":
            return rng.choice(self._models)
        if kind == "plan":
            whole = tomllib.loads(PLAN)
            whole["experiment"] = rng.sample(whole["experiment"], rng.choice((1, 2, 4)))
            return whole
        parts = tomllib.loads(PARTS)
        names = rng.sample(sorted(parts), rng.choice((1, 2, 4)))
        return tomllib.loads(RIG) | {name: parts[name] for name in names}

    def command(self, kind: str, rng: random.Random, data: bytes) -> list[str]:
        """What reads `data`, a file of `kind`, beside sound files of the other kinds."""
        file = self._folder / ("mutated.json" if kind == "model" else "mutated.toml")
        file.write_bytes(data)
        short, output = str(self._folder / "short.toml"), str(self._folder / "out.csv")
        recorder = ["record", "--port", "emulated", "-o", output, "--force"]
        if kind == "plan":
            return [*recorder, "--no-check", "--plan", str(file)]
        if kind == "plant":
            return [*recorder, "--plan", short, "--plant", str(file), *rng.choice(([], ["--no-check"]))]
        rig = ["--counts-per-rev", "617.4", "--supply", "7.4"]
        return rng.choice(
            (
                ["simulate", str(file), "--plan", short, "-o", output, *rig],
                ["validate", str(file), str(self._recording), "--json"],
                *(["export", str(file), "--to", to, *rig, "-o", output] for to in ("json", "c", "control")),
                ["export", str(file), "--to", "wpilib"],
                ["export", str(file), "--to", "spice", "--resistance", "4.5"],
                ["export", str(file), "--to", "mujoco", "--inertia", "4e-5", "--supply", "7.4"],
            )
        )


WRITERS = {"plan": to_toml, "plant": to_toml, "model": lambda tree: json.dumps(tree, default=str)}


def _models() -> Iterator[Tree]:
    """A linear motor from sines, one with a winding's lag, and one for each effect."""
    import numpy as np

    fitted = to_json(identify(recording(0)))
    yield fitted
    covariance = np.diag([1e-4, 1e-2, 1e-10])
    yield model_to_json(Model(linear_motor([10.6, 40.0, 1e-3]), covariance, 0.01, 0.005, "r", frozenset("ab"), "m"))
    names = sorted(EFFECTS)
    for first, second in zip(names[::2], names[1::2], strict=False):
        yield fitted | {"effects": [_effect(first), _effect(second)], "joint_covariance": _joint()}


def _effect(name: str) -> dict[str, Any]:
    from jaxmotor.motor.effects import parameters

    about = parameters(EFFECTS[name])
    return {"name": name, "parameters": dict.fromkeys(about, 0.1), "standard_error": dict.fromkeys(about, 0.01)}


def _joint() -> dict[str, Any]:
    return {"names": ["gain_rad_s_V", "pole_rad_s"], "covariance": [[1e-4, 1e-4], [1e-4, 1e-2]]}


def run(
    runs: int,
    seed: int,
    folder: Path,
    kinds: Iterable[str] = tuple(WRITERS),
    subprocesses: int = SUBPROCESSES,
    limit_s: float = LIMIT_S,
) -> Found:
    """What came of `runs` damaged files."""
    makers = Kinds(folder)
    found: Found = defaultdict(list)
    kinds = list(kinds)
    for number in range(runs):
        rng = random.Random(f"{seed} {number}")
        kind, how = kinds[number % len(kinds)], HOW[number // len(kinds) % len(HOW)]
        command = makers.command(kind, rng, mutated(how, rng, makers.tree(kind, rng), WRITERS[kind]))
        alone = subprocesses and number % subprocesses == 0
        outcome = (
            in_subprocess(command) if alone else in_process(command, max(limit_s, COMPILES_S if kind == "model" else 0))
        )
        found[kind, how].append(Case(outcome, command, number))
    return found


def table(found: Found) -> str:
    """Rows for people: what was damaged and how, and what came of it."""
    heads = ("file", "damage", "runs", "taken", "exit 1", "exit 2", "faults", "longest sentence", "longest refusal")
    lines = [f"| {' | '.join(heads)} |", "|---" * len(heads) + "|"]
    lines += [_row(kind, how, cases) for (kind, how), cases in sorted(found.items())]
    return "\n".join([*lines, _row("all", "", [case for cases in found.values() for case in cases])])


def _row(kind: str, how: str, cases: list[Case]) -> str:
    refused = [case.outcome for case in cases if case.outcome.code in (1, 2)]
    codes = [sum(outcome.code == code for outcome in refused) for code in (1, 2)]
    taken = sum(case.outcome.began for case in cases)
    faults = sum(bool(case.outcome.faults()) for case in cases)
    longest = max((len(outcome.said) for outcome in refused), default=0)
    slowest = max((outcome.seconds for outcome in refused), default=0.0)
    cells = (kind, how, len(cases), taken, *codes, faults, longest, f"{slowest:.2f} s")
    return f"| {' | '.join(map(str, cells))} |"


def cli() -> None:
    parser = argparse.ArgumentParser(description="Damaged plans, plants and models.")
    parser.add_argument("--runs", type=int, default=5000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--kinds", nargs="+", choices=list(WRITERS), default=list(WRITERS))
    parser.add_argument("--show", action="store_true", help="print each fault")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        found = run(options.runs, options.seed, Path(folder), options.kinds)
    print(table(found))
    for (kind, how), cases in found.items():
        for outcome, command, number in cases:
            if options.show and outcome.faults():
                print(f"\n{kind}, {how}, {number}: {', '.join(outcome.faults())}; jaxmotor {' '.join(command)[:200]}")
                print(f"  exit {outcome.code} after {outcome.seconds:.2f} s: {outcome.err[:1000]!r}")
    sys.exit(any(case.outcome.faults() for cases in found.values() for case in cases))


if __name__ == "__main__":
    cli()
