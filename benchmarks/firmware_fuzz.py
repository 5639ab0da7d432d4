"""Fuzzed commands with right checksums to the emulated board: its answers, its pins, its stack, its resets.

    python benchmarks/firmware_fuzz.py [--lines 50000] [--seed 1]

Half of the lines come one at a time, and each answer is compared with the model in _board_model.py, written from
docs/protocol.md. The others come as fast as the wire carries them, stops and skips in mid-run among them. In both the
bridge's pins are followed edge by edge: they may drive only what the log says was set, in runs that a `G` started.
"""

import argparse
import dataclasses
import itertools
import json
import random
import subprocess
import tempfile
from collections.abc import Iterator
from pathlib import Path

from _board_model import KINDS, LEVEL_MAX, ORDERS, BoardModel, Said

from jaxmotor.bench._emulator import find_or_build
from jaxmotor.bench._protocol import Begin, Decoder, Hello, Message, RunEnd, Sample, Status, checksum

PERIOD_CYCLES = 4000
"""Of the PWM at 4 kHz and 16 MHz."""
STACK_LEFT = 64
EDGES = (0, 1, 2, 59, 60, 255, 256, 32767, 32768, 65535, 65536, 2**31 - 1, 2**31, 2**32 - 1, 2**32, 2**32 + 5, 10**19)
CHUNK = 2_500
"""Lines to one board."""
LONGEST_RUN_S = 0.6


@dataclasses.dataclass
class Result:
    """Of lines to one board."""

    lines: int = 0
    runs: int = 0
    refused: int = 0
    wrong_answers: int = 0
    pulses_outside: int = 0
    """PWM periods in which the pins drove otherwise than the log says."""
    runs_twice: int = 0
    resets: int = 0
    stack_left: int = 2048
    notes: list[str] = dataclasses.field(default_factory=list)

    def __add__(self, other: "Result") -> "Result":
        mine, theirs = dataclasses.astuple(self), dataclasses.astuple(other)
        added = [a + b for a, b in zip(mine, theirs, strict=True)]
        return dataclasses.replace(Result(*added), stack_left=min(self.stack_left, other.stack_left))

    @property
    def sound(self) -> bool:
        """Nothing that may not be."""
        bad = self.wrong_answers + self.pulses_outside + self.runs_twice + self.resets
        return bad == 0 and self.stack_left >= STACK_LEFT


class Writer:
    """Lines that a board may hear: right ones, wrong ones, and none at all, with a right checksum each."""

    def __init__(self, rng: random.Random, model: BoardModel, *, at_once: bool) -> None:
        self._rng, self._model, self._at_once = rng, model, at_once
        self._letters = "CSSSSSGGGPLQRHUYZa !\x01\x80" + ("XJJK" if at_once else "")

    def line(self) -> bytes:
        """The next."""
        kind = self._rng.random()
        if kind < 0.25 and (line := self._good()):
            return line
        if kind < 0.32:
            return bytes(self._rng.randrange(256) for _ in range(self._rng.randrange(1, 90)))
        letter = self._rng.choice(self._letters)
        fields = [str(self._rng.randrange(1, 65536)), *self._fields(letter)]
        if self._rng.random() < 0.4:
            self._spoil(fields)
        return " ".join([letter, *fields]).encode("latin-1")

    def _good(self) -> bytes:
        """A step towards a run that really runs."""
        model, command = self._model, self._rng.randrange(1, 65536)
        if model.claimed <= model.run:
            return f"C {command} {min(model.run + self._rng.randrange(1, 50), 2**32 - 1)}".encode()
        ticks = sum(slot[1] + slot[2] for slot in model.plan)
        seconds = ticks * model.settings[0] / 1000
        if len(model.plan) > self._rng.randrange(1, 5) and seconds < LONGEST_RUN_S:
            return f"G {command} {model.claimed} {len(model.plan)} {model.sum}".encode()
        if seconds >= LONGEST_RUN_S:
            return f"C {command} {model.claimed + 1}".encode()
        fields = self._slot(len(model.plan), self._rng.randrange(2, 20))
        return " ".join(["S", str(command), *fields]).encode()

    def _fields(self, letter: str) -> list[str]:
        rng, model = self._rng, self._model
        if letter == "S":
            return self._slot(rng.choice([len(model.plan), rng.randrange(62)]), rng.choice([2, 5, 65535, 1, 65536]))
        if letter == "G":
            run = rng.choice([model.claimed, model.run, model.run + 1, self._any()])
            seconds = sum(slot[1] + slot[2] for slot in model.plan) * model.settings[0] / 1000
            right = model.sum if seconds < LONGEST_RUN_S else (model.sum + 1) % 65536
            return [str(run), str(rng.choice([len(model.plan), self._any()])), str(rng.choice([right, self._any()]))]
        if letter == "P":
            return [str(rng.choice([5, 10, 20, 1, 0, 21])), str(rng.randrange(3))]
        if letter == "L":
            travel, time = rng.choice([10**7, 2**31 - 1, 50]), rng.choice([400, 10**6, 2**31])
            return [str(travel), str(time), str(rng.choice([0, 6000, 20000]))]
        if letter == "C":
            return [str(rng.choice([model.run + 1, model.run, model.claimed, self._any()]))]
        if letter == "U":
            return [str(rng.choice([57600, 0, 4294967296 + 115200, 1000001]))]
        if letter == "J":
            return [str(rng.choice([model.run, self._any()])), str(rng.randrange(4))]
        return [str(rng.choice([0, 3, 59, 60]))] if letter == "R" else []

    def _slot(self, index: int, ticks: int) -> list[str]:
        rng = self._rng
        kind = rng.choice(KINDS)
        half, small = rng.randrange(-LEVEL_MAX // 2, LEVEL_MAX // 2), rng.randrange(-16384, 16385)
        a, b, c = {
            "rest": (0, 0, 0),
            "step": (0, 2 * half, 0),
            "ramp": (0, 2 * half, small),
            "sine": (rng.randrange(2**32), half, small // 2),
            "multisine": (rng.randrange(2**32), half, rng.randrange(0, 10) + 256 * rng.randrange(0, 20)),
            "chirp": (rng.randrange(2**32), rng.randrange(-(2**31), 2**31), half),
            "prbs": (rng.choice([*ORDERS, 8]) + 256 * rng.randrange(0, 300), half, small // 2),
            "loop": (rng.randrange(2**32), small, 0),
        }[kind]
        return [str(index), kind, str(rng.choice([0, 2, 5, 1])), str(ticks), str(a), str(b), str(c)]

    def _any(self) -> int:
        value = self._rng.choice(EDGES)
        return value if self._rng.random() < 0.8 else -value

    def _spoil(self, fields: list[str]) -> None:
        rng, at = self._rng, self._rng.randrange(len(fields))
        match rng.randrange(6):
            case 0:
                fields[at] = str(self._any())
            case 1:
                fields[at] = rng.choice(["", "-", "+1", "1.5", "0x1", "1e3", "a", "--1", "1-", "\x00", "\xff"])
            case 2:
                del fields[at]
            case 3:
                fields.insert(at, str(self._any()))
            case 4:
                fields[at] = "0" * rng.randrange(1, 12) + fields[at]
            case 5:
                fields[at] += rng.choice([" ", "\t", "\x00", "\x07", "9999999999"])


def sealed(body: bytes) -> bytes:
    """With its checksum and its end."""
    return body + b"*" + checksum(body) + b"\n"


def _may_be_sent(body: bytes, *, at_once: bool) -> bool:
    """The emulator takes keepalives for itself, and hands stops and skips over out of turn."""
    return not set(body) & set(b"\r\n") and (at_once or body[:1] not in (b"K", b"X", b"J"))


def one_board(lines: int, seed: int, *, at_once: bool, folder: Path) -> Result:
    """That many lines to a board, `at_once` or each when the one before is answered."""
    rng = random.Random(seed)
    model = BoardModel(0)
    expected: list[Said] = []
    bodies: list[bytes] = []
    model.supply_mV = 7389
    first = b"U 1 1000000"
    writer = Writer(rng, model, at_once=at_once)
    while len(bodies) < lines:
        body = writer.line() if bodies else first
        if not _may_be_sent(body, at_once=at_once):
            continue
        said = model.hears(body)
        if said is not None and said.letter == "H" and said.fields == ("0",):
            continue  # cannot be told from the hello after a reset
        bodies.append(body)
        expected += [said] if said is not None else []
    script = b"".join(map(sealed, [*bodies, b"Q 1"]))
    pins, stats = folder / f"{seed}.csv", folder / f"{seed}.json"
    command = [find_or_build(), "--mode", "fast" if at_once else "lockstep", "--pins", pins, "--stats", stats]
    done = subprocess.run(list(map(str, command)), input=script, capture_output=True, check=True, timeout=1200)
    received = Decoder().feed(done.stdout)
    result = Result(lines, stack_left=json.loads(stats.read_text())["stack_left_bytes"])
    _judge_runs(result, received, pins)
    if not at_once:
        _judge_answers(result, received, expected, model)
    pins.unlink()
    stats.unlink()
    return result


def _judge_answers(result: Result, received: list[Message], expected: list[Said], model: BoardModel) -> None:
    answers = [said for said in map(_as_said, received) if said is not None]
    *answers, _ = answers
    for got, wanted in itertools.zip_longest(answers, expected):
        result.refused += wanted is not None and wanted.letter == "N"
        if got != (None if wanted is None else dataclasses.replace(wanted, starts=False)):
            result.wrong_answers += 1
            result.notes.append(f"answered {got}, expected {wanted}")
            break  # what follows is out of step
    ends = [message for message in received if isinstance(message, RunEnd)]
    if len(ends) != sum(said.starts for said in expected):
        result.notes.append(f"{len(ends)} runs for {sum(said.starts for said in expected)} that were started")
        result.wrong_answers += 1
    last = received[-1]
    if not isinstance(last, Status) or last.bad_lines != model.bad_lines:
        result.wrong_answers += 1
        result.notes.append(f"bad lines: {last} for {model.bad_lines}")


def _as_said(message: Message) -> Said | None:
    letter, _, *fields = message.line.rpartition("*")[0].split(" ")
    if letter in "AN":
        return Said(letter, tuple(fields))
    if letter == "Q":
        return Said(letter, tuple(fields[:2]))
    if letter == "R":
        return Said(letter, (*fields[:3], f"{len(fields) - 3} numbers"))
    if letter == "H" and fields[1] == "1/4" and fields[0] != "0":
        return Said(letter, (fields[0],))
    return None


def _judge_runs(result: Result, received: list[Message], pins: Path) -> None:
    begins = [message.run for message in received if isinstance(message, Begin) and message.segment == 0]
    result.runs = len(begins)
    result.runs_twice = len(begins) - len(set(begins))
    result.resets = sum(isinstance(m, Hello) and m.command == 0 and m.part == 1 for m in received) - 1
    got, spare = list(_driven(pins)), 0
    for run in _set(received):
        # A limit may stop the motor in the tick that set the last duty, before it drives.
        after = next(
            (end for way in (run.duties, run.without_last) if (end := _after(got, way, run.unknown + spare))), 0
        )
        if after < len(run.without_last):
            result.pulses_outside += 1
            result.notes.append(f"pins drove {got[: len(run.duties)]}, the log says {run}")
            return
        spare = max(0, run.unknown + spare - (after - len(run.duties)))
        got = got[after:]
    result.pulses_outside += max(0, len(got) - spare)


@dataclasses.dataclass(frozen=True)
class _Run:
    """What the log says of a run's duties: one for each stretch of equal ones, zeros left out."""

    duties: list[int]
    without_last: list[int]
    unknown: int
    """Stretches that samples may have made which found no room on the line: each its own, and another behind it."""


def _after(got: list[int], duties: list[int], spare: int) -> int:
    """How many of `got` it takes to find `duties` in order, among at most `spare` others; 0 where that fails."""
    at = 0
    for number, duty in enumerate(got):
        if at == len(duties):
            return number
        if duty == duties[at]:
            at += 1
        elif spare:
            spare -= 1
        else:
            return 0
    return len(got) if at == len(duties) else 0


def _set(received: list[Message]) -> Iterator[_Run]:
    duties: list[int] = []
    before = 0
    for message in received:
        if isinstance(message, Sample):
            duties += [message.duty] if message.duty != before else []
            before = message.duty
        if isinstance(message, RunEnd):
            whole = [duty for duty in duties if duty]
            last = duties if message.reason == "done" else duties[:-1]
            yield _Run(whole, [duty for duty in last if duty], 2 * message.lost)
            duties, before = [], 0


def _driven(pins: Path) -> Iterator[int]:
    """The same of the pins; a last period that a stop cut short is its stretch's."""
    rows = [tuple(map(int, line.split(","))) for line in pins.read_text().split()[1:]]
    before = 0
    for number, (_, forward, backward) in enumerate(rows):
        drove = forward - backward
        duty = round(drove * 250 / PERIOD_CYCLES)
        ends = number + 1 < len(rows) and rows[number + 1][1:] == (0, 0)
        cut = ends and rows[number + 1][0] - rows[number][0] == PERIOD_CYCLES and drove * before > 0
        if forward and backward:
            yield 10_000 + duty  # never
        elif duty not in (0, before) and not (cut and abs(duty) < abs(before)):
            yield duty
        before = duty


def fuzz(lines: int, seed: int) -> Result:
    """`lines` in all, half of them one at a time."""
    total = Result()
    with tempfile.TemporaryDirectory() as name:
        for number, first in enumerate(range(0, lines, CHUNK)):
            many = min(CHUNK, lines - first)
            total += one_board(many, seed * 1000 + number, at_once=number % 2 == 1, folder=Path(name))
    return total


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--lines", type=int, default=50_000)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    result = fuzz(options.lines, options.seed)
    for field in dataclasses.fields(result):
        if field.name != "notes":
            print(f"{field.name.replace('_', ' ')}: {getattr(result, field.name)}")
    for note in result.notes[:10]:
        print(f"  {note}")


if __name__ == "__main__":
    main()
