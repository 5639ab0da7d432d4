"""An emulated board behind a line that loses, doubles, delays or damages what passes, in both directions."""

import dataclasses
import random
import re
import subprocess
import time
from collections import Counter
from collections.abc import Callable, Sequence

from jaxmotor.bench import Decoder, Patience, Plan, Port
from jaxmotor.bench._emulator import find_or_build
from jaxmotor.bench._protocol import Begin, Sample
from jaxmotor.recording import Recording

IMPATIENT = Patience(hello_s=10.0, again_s=0.03, silent_s=6.0)
"""The emulated board answers in a few ms; a command that is sent again too early does no harm."""
LATE_S = 0.08
"""Longer than the host waits for an answer."""
Samples = dict[tuple[int, int], tuple[int, int]]
"""(segment, tick): (duty, count)."""


class Board:
    """An emulated board on a TCP port, to be opened again and again; each time it starts anew."""

    def __init__(self, *options: str, mode: str = "lockstep", once: bool = False) -> None:
        command = [find_or_build(), "--socket", "0", "--mode", mode, *(["--once"] if once else []), *options]
        self.process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
        assert self.process.stderr is not None
        told = re.search(r"socket://\S+", self.process.stderr.readline())
        assert told is not None
        self.url = told[0]

    def __enter__(self) -> "Board":
        return self

    def __exit__(self, *exc: object) -> None:
        self.process.terminate()
        self.process.wait(timeout=10)
        assert self.process.stderr is not None
        self.process.stderr.close()


@dataclasses.dataclass(frozen=True)
class Fault:
    """What happens to a line: the `nth` (from 0) from the host or the board that begins with `letter`."""

    by_host: bool
    letter: str
    nth: int
    what: str
    """`lost`, `doubled`, `late` or `damaged`."""


class FaultyPort(Port):
    """A port whose lines suffer `faults`, or whose bytes pass through `hurt`."""

    def __init__(
        self,
        url: str,
        faults: Sequence[Fault] = (),
        hurt: Callable[[bytes], bytes] | None = None,
        patience: Patience = IMPATIENT,
    ) -> None:
        self.said = bytearray()
        """What the board said, undamaged."""
        self.points: list[tuple[bool, str, int]] = []
        """The lines that passed, as a fault names them."""
        self._faults = {(fault.by_host, fault.letter, fault.nth): fault.what for fault in faults}
        self._hurt = hurt
        self._seen: Counter[tuple[bool, str]] = Counter()
        self._torn = b""
        self._held: list[tuple[float, bool, bytes]] = []
        super().__init__(url, patience=patience)

    def read(self) -> bytes:
        """See `Port`."""
        data = super().read()
        self.said += data
        if self._hurt is not None:
            return self._hurt(data)
        *lines, self._torn = (self._torn + data).split(b"\n")
        passed = b"".join(self._pass(line + b"\n", by_host=False) for line in lines)
        return passed + self._due(by_host=False)

    def write(self, data: bytes) -> None:
        """See `Port`."""
        passed = self._hurt(data) if self._hurt is not None else self._pass(data, by_host=True)
        super().write(passed)

    def close(self) -> None:
        """See `Port`; without the third of a second that pyserial gives a network device to recover."""
        if (plug := getattr(self._serial, "_socket", None)) is not None:
            plug.close()
            self._serial.is_open = False

    def _due(self, *, by_host: bool) -> bytes:
        """What was held back long enough."""
        now = time.monotonic()
        for held in [held for held in self._held if held[0] <= now]:
            self._held.remove(held)
            if held[1]:
                super().write(held[2])
            else:
                return held[2] + self._due(by_host=by_host)
        return b""

    def _pass(self, line: bytes, *, by_host: bool) -> bytes:
        letter = chr(line[0]) if line[:1].isalpha() else ""
        point = by_host, letter, self._seen[by_host, letter]
        self._seen[by_host, letter] += 1
        self.points.append(point)
        match self._faults.get(point):
            case "lost":
                return b""
            case "doubled":
                return line + line
            case "damaged":
                at = len(line) // 2
                return line[:at] + bytes([line[at] ^ 1]) + line[at + 1 :]
            case "late":
                self._held.append((time.monotonic() + LATE_S, by_host, line))
                return b""
        return line


def samples_in(log: bytes) -> Samples:
    """The samples of the last run in an undamaged log."""
    samples: Samples = {}
    for message in Decoder().feed(log):
        if isinstance(message, Begin) and message.segment == 0:
            samples.clear()
        if isinstance(message, Sample):
            samples[message.segment, message.tick] = (message.duty, message.count)
    return samples


def runs_in(log: bytes) -> int:
    """How often the motor was set going."""
    return sum(isinstance(m, Begin) and m.segment == 0 for m in Decoder().feed(log))


def samples_of(recording: Recording, plan: Plan) -> Samples:
    """The same of a recording of one run of `plan`, by the segments' start."""
    starts, at = {}, 0
    for experiment in plan.experiments:
        for ticks in (experiment.rest_ticks, experiment.ticks):
            if ticks:
                starts[at] = len(starts)
                at += ticks
    samples = {}
    for segment in recording.segments:
        number = starts[round(segment.start_s / plan.period_s)]
        assert segment.tick is not None and segment.duty is not None and segment.count is not None
        rows = zip(segment.tick.tolist(), segment.duty.tolist(), segment.count.tolist(), strict=True)
        samples |= {(number, tick): (duty, count) for tick, duty, count in rows}
    return samples


def damage(data: bytes, faults: int, rng: random.Random) -> bytes:
    """Random byte errors, flipped bits, drops, repeats and torn lines."""
    damaged = bytearray(data)
    for _ in range(faults):
        if not damaged:
            break
        at = rng.randrange(len(damaged))
        match rng.randrange(5):
            case 0:
                damaged[at] = rng.randrange(256)
            case 1:
                damaged[at] ^= 1 << rng.randrange(8)
            case 2:
                del damaged[at]
            case 3:
                damaged[at:at] = damaged[at : at + rng.randrange(1, 80)]
            case 4:
                del damaged[at : at + rng.randrange(1, 80)]
    return bytes(damaged)


def noise(rate: float, rng: random.Random) -> Callable[[bytes], bytes]:
    """Damage of `rate` faults per byte."""
    return lambda data: damage(data, sum(rng.random() < rate for _ in range(len(data))), rng)
