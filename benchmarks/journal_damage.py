"""Journals of interrupted recordings with bytes changed, lines lost, doubled or torn: what is recovered of them.

    python benchmarks/journal_damage.py [--step 1] [--seed 1]

Every `step`-th byte is changed, one at a time; then as many journals are damaged in more than one place. Judged is
that a recovered recording has the rig's own units and no sample that was not there, and that anything else is refused
in a sentence. docs/reliability.md holds the figures of a full run.
"""

import argparse
import contextlib
import random
import tempfile
from collections import Counter
from collections.abc import Callable, Iterable
from pathlib import Path

from testing.line import Board, FaultyPort, Samples, damage, samples_of

from jaxmotor._errors import JaxmotorError
from jaxmotor.bench import Plan, RecorderError, parse_plan, record, recover
from jaxmotor.bench._journal import journal_path
from jaxmotor.recording import Recording

PLAN = """
period_ms = 5
rest_s = 0.1
supply_V = 7.5
counts_per_rev = 600
travel_rev = 1.5
[[experiment]]
kind = "sine"
frequency_Hz = 5.013
amplitude_V = 3
duration_s = 0.4
[[experiment]]
kind = "step"
amplitude_V = [5, -4]
duration_s = 0.4
"""


def interrupted(folder: Path) -> tuple[Plan, Path]:
    """A plan, and its recording that the travel limit ended, with its journal."""
    plan, output = parse_plan(PLAN, "journal"), folder / "r.csv"
    with Board() as board, contextlib.suppress(RecorderError):
        record(plan, lambda: FaultyPort(board.url), output, check=False)
    return plan, output


def assess(plan: Plan, output: Path, data: bytes, whole: Recording, there: Samples) -> str:
    """What becomes of the journal `data`: a word."""
    journal_path(output).write_bytes(data)
    try:
        recording = recover(output)
    except JaxmotorError as error:
        return "refused" if len(str(error)) <= 300 + len(str(output)) else "long sentence"
    except Exception as error:
        return f"crashed: {type(error).__name__} {error}"
    units = [(r.period_s, r.counts_per_rev, r.supply_V, r.duty_full_scale, r.drive) for r in (recording, whole)]
    if units[0] != units[1]:
        return "wrong units"
    came = samples_of(recording, plan)
    if not came.items() <= there.items():
        return "wrong samples"
    return "whole" if came == there else "partly recovered"


def bytes_changed(data: bytes, step: int, rng: random.Random) -> Iterable[bytes]:
    """One byte changed, at every `step`-th place."""
    for at in range(rng.randrange(step), len(data), step):
        yield data[:at] + bytes([data[at] ^ rng.randrange(1, 256)]) + data[at + 1 :]


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--step", type=int, default=1)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    rng = random.Random(options.seed)
    with tempfile.TemporaryDirectory() as name:
        plan, output = interrupted(Path(name))
        data, whole = journal_path(output).read_bytes(), recover(output)
        there = samples_of(whole, plan)
        number = len(data) // options.step
        cases: dict[str, Callable[[], Iterable[bytes]]] = {
            "one byte changed": lambda: bytes_changed(data, options.step, rng),
            "2 to 40 faults": lambda: (damage(data, rng.randrange(2, 41), rng) for _ in range(number // 4)),
            "torn": lambda: (data[: rng.randrange(len(data))] for _ in range(number // 8)),
        }
        for title, made in cases.items():
            words = Counter(assess(plan, output, each, whole, there) for each in made())
            print(f"{title}: {words.total()} journals: " + ", ".join(f"{n} {word}" for word, n in words.most_common()))


if __name__ == "__main__":
    main()
