"""Lines between recorder and emulated board that are lost, doubled, late or damaged: what the recording makes of it.

    python benchmarks/control_faults.py [--random N] [--noisy N] [--most 3] [--share 1.0] [--seed 1]

Each run records a short plan. Judged is what `record` says against what the board really did: samples that are not the
board's, samples that are missing without a word, recordings called complete that are not, runs started twice, and
runs that never end. Every recording that is said to lack something is resumed on a sound line, and must then be whole.
docs/reliability.md holds the figures of a full run.
"""

import argparse
import dataclasses
import itertools
import math
import random
import re
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

from testing.line import Board, Fault, FaultyPort, noise, runs_in, samples_in, samples_of

from jaxmotor.bench import Plan, Port, RecorderError, parse_plan, record
from jaxmotor.recording import read

PLAN = """
period_ms = 5
rest_s = 0.05
[[experiment]]
kind = "step"
amplitude_V = [5, -4]
duration_s = 0.1
"""
WHATS = ("lost", "doubled", "late", "damaged")
HANG_S = 60.0


@dataclasses.dataclass
class Outcome:
    """Of one run under faults."""

    said: str
    """The sentence; empty where the recording was called complete."""
    planned: int
    came: int
    wrong: int
    """Samples in the recording that the board did not send."""
    starts: int
    """Times that the motor was set going."""
    seconds: float
    resumed: bool | None = None
    """Whether a second recording on a sound line made it whole; None where none was needed."""

    @property
    def faults(self) -> list[str]:
        """What may not be."""
        found = {
            "wrong samples": self.wrong > 0,
            "called complete": not self.said and self.came != self.planned,
            "missing unsaid": bool(self.said) and self.came < self.planned and not self._told,
            "started twice": self.starts > 1,
            "hung": self.seconds > HANG_S,
            "not resumed": self.resumed is False,
        }
        return [name for name, true in found.items() if true]

    @property
    def _told(self) -> bool:
        """Whether the sentence has the number of samples that came, where there was a run at all.

        The recording may have fewer: of an interrupted segment of less than 20 samples only the journal has them.
        """
        told = re.search(rf"(\d+) of {self.planned} samples came", self.said)
        return self.starts == 0 or not self.came or (told is not None and self.came <= int(told[1]) < self.planned)


def run(open_port: Callable[[], Port], plan: Plan, folder: Path, sound: Callable[[], Port] | None) -> Outcome:
    """Record `plan` over the port, and judge; where `sound` is given, resume there what is missing."""
    output = folder / "r.csv"
    for path in (output, output.with_name("r.csv.part")):
        path.unlink(missing_ok=True)
    ports: list[Port] = []

    def opened() -> Port:
        ports.append(open_port())
        return ports[-1]

    said, began = "", time.monotonic()
    try:
        record(plan, opened, output, check=False)
    except RecorderError as error:
        said = str(error)
    seconds = time.monotonic() - began
    log = bytes(ports[0].said) if ports and isinstance(ports[0], FaultyPort) else b""
    sent = samples_in(log)
    came = samples_of(read(output), plan) if output.exists() else {}
    wrong = sum(sent.get(key) != value for key, value in came.items())
    outcome = Outcome(said, plan.ticks, len(came), wrong, runs_in(log), seconds)
    if said and sound is not None and output.with_name("r.csv.part").exists():
        outcome.resumed = _resumed(plan, output, sound)
    return outcome


def _resumed(plan: Plan, output: Path, sound: Callable[[], Port]) -> bool:
    """Whether resuming gives each experiment whole, and takes the journal away."""
    record(None, sound, output, resume=True, check=False)
    whole = [s for s in read(output).segments if s.tick is not None and s.tick.tolist() == list(range(len(s.tick)))]
    lengths = Counter(len(segment) for segment in whole)
    wanted = Counter(ticks for each in plan.experiments for ticks in (each.rest_ticks, each.ticks) if ticks)
    return all(lengths[ticks] >= number for ticks, number in wanted.items()) and not list(output.parent.glob("*.part"))


def points(board: Board, plan: Plan, folder: Path, letters: str) -> list[tuple[bool, str, int]]:
    """The control lines of an undisturbed recording, and the questions that only a disturbed one asks."""
    ports: list[FaultyPort] = []

    def opened() -> Port:
        ports.append(FaultyPort(board.url))
        return ports[-1]

    run(opened, plan, folder, None)
    passed = [point for point in ports[0].points if point[1] and point[1] in letters]
    asked = [(by_host, letter, 0) for by_host in (True, False) for letter in "QR" if letter in letters]
    return passed + [point for point in asked if point not in passed]


def combinations(points: list[tuple[bool, str, int]], most: int) -> Iterator[tuple[Fault, ...]]:
    """Every choice of up to `most` lines, with every fault of each."""
    for number in range(1, most + 1):
        for chosen in itertools.combinations(points, number):
            for whats in itertools.product(WHATS, repeat=number):
                yield tuple(Fault(*point, what) for point, what in zip(chosen, whats, strict=True))


def count(
    board: Board, cases: Iterable[Callable[[], Port]], plan: Plan, folder: Path
) -> tuple[Counter[str], list[str]]:
    """Run all cases: how many ended how, and what went wrong."""
    totals: Counter[str] = Counter()
    wrongs: list[str] = []
    for number, case in enumerate(cases):
        outcome = run(case, plan, folder, lambda: FaultyPort(board.url))
        totals["runs"] += 1
        totals["complete"] += not outcome.said
        totals["said to lack something"] += bool(outcome.said) and outcome.came > 0
        totals["not recorded, said"] += bool(outcome.said) and outcome.came == 0
        totals["resumed"] += outcome.resumed is True
        for fault in outcome.faults:
            totals[f"FAULT {fault}"] += 1
            wrongs.append(f"{number}: {fault}: {outcome}")
    return totals, wrongs


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--random", type=int, default=10_000, help="runs with faults at random lines")
    parser.add_argument("--noisy", type=int, default=1_000, help="runs with damaged bytes in both directions")
    parser.add_argument("--most", type=int, default=2, help="faults in a combination of control lines")
    parser.add_argument("--share", type=float, default=1.0, help="of the combinations that are run, drawn at random")
    parser.add_argument("--letters", default="GABEZQH", help="of the control lines")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    rng, plan = random.Random(options.seed), parse_plan(PLAN, "faults")
    with tempfile.TemporaryDirectory() as name, Board() as board:
        folder = Path(name)
        control = points(board, plan, folder, options.letters)
        every = points(board, plan, folder, "ABCDEGHLPQRSZ")
        chosen = (faults for faults in combinations(control, options.most) if rng.random() < options.share)
        _print(
            f"up to {options.most} of {len(control)} control lines",
            board,
            (lambda faults=faults: FaultyPort(board.url, faults) for faults in chosen),
            plan,
            folder,
        )
        _print(
            "1 to 6 of all lines, at random",
            board,
            (lambda: FaultyPort(board.url, _drawn(every, rng)) for _ in range(options.random)),
            plan,
            folder,
        )
        _print(
            "bytes damaged, 0.1 to 10 in 1000",
            board,
            (
                lambda: FaultyPort(board.url, hurt=noise(math.exp(rng.uniform(-7, -4.6)), rng))
                for _ in range(options.noisy)
            ),
            plan,
            folder,
        )


def _drawn(every: list[tuple[bool, str, int]], rng: random.Random) -> list[Fault]:
    return [Fault(*point, rng.choice(WHATS)) for point in rng.sample(every, rng.randrange(1, 7))]


def _print(title: str, board: Board, cases: Iterable[Callable[[], Port]], plan: Plan, folder: Path) -> None:
    began = time.monotonic()
    totals, wrongs = count(board, cases, plan, folder)
    took = time.monotonic() - began
    print(f"{title}: " + ", ".join(f"{value} {key}" for key, value in totals.items()) + f" ({took:.0f} s)", flush=True)
    for wrong in wrongs[:10]:
        print(f"  {wrong}", flush=True)


if __name__ == "__main__":
    main()
