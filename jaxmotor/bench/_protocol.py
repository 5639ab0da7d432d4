"""The lines between board and host (docs/protocol.md): bytes in, messages out; commands as bytes. No port is opened.

A line is taken only where its checksum is right, its fields are those of its type, its sequence number is a little
ahead of the last one, and, for a sample, its tick has advanced by no more than the sequence number. What is damaged
or missing is counted.
"""

import binascii
import dataclasses
import re

from jaxmotor._errors import JaxmotorError

LONGEST = 200
"""No line of the board is longer [byte]."""
WINDOW = 2048
"""So many lines may be missing in a row; a number farther ahead is not believed at once."""
KEEPALIVE = b"K*185F\n"


class RecorderError(JaxmotorError):
    """What stopped a recording, and what to do, in one sentence."""


@dataclasses.dataclass(frozen=True, slots=True)
class Message:
    """A line from the board."""

    line: str
    """As it came, with its checksum and without its end."""
    sequence: int
    """Counts all lines since the reset, 0 to 65535 and round again."""


@dataclasses.dataclass(frozen=True, slots=True)
class Hello(Message):
    """One part of who the board is; as if to command 0 after a reset."""

    command: int
    part: int
    parts: int
    values: dict[str, str]


@dataclasses.dataclass(frozen=True, slots=True)
class Answer(Message):
    """A command was obeyed, or refused."""

    command: int
    refusal: str
    """Why not; empty where it was obeyed."""


@dataclasses.dataclass(frozen=True, slots=True)
class Begin(Message):
    """A segment begins."""

    run: int
    """The host's number for it."""
    segment: int
    slot: int
    kind: str
    start: int
    """Ticks since the run began."""
    ticks: int
    """Planned."""


@dataclasses.dataclass(frozen=True, slots=True)
class Sample(Message):
    """The count latched at a tick, and the duty set then."""

    segment: int
    tick: int
    duty: int
    count: int
    supply_mV: int | None


@dataclasses.dataclass(frozen=True, slots=True)
class End(Message):
    """A segment ends: why, after how many ticks; the rest since the run began."""

    run: int
    segment: int
    reason: str
    ticks: int
    count: int
    illegal: int
    lost: int


@dataclasses.dataclass(frozen=True, slots=True)
class RunEnd(Message):
    """The run ends: why, after how many ticks."""

    run: int
    reason: str
    ticks: int
    illegal: int
    lost: int


@dataclasses.dataclass(frozen=True, slots=True)
class Status(Message):
    """How the board is."""

    command: int
    run: int
    """The last that was started; 0 = none since the reset."""
    state: str
    """`running`, `idle` where there was no run, else the reason for which the last one ended."""
    ticks: int
    """Of that run, so far or in all."""
    slots: int
    count: int
    illegal: int
    supply_mV: int
    bad_lines: int
    lost: int


@dataclasses.dataclass(frozen=True, slots=True)
class Ran(Message):
    """How long experiments ran: of each slot from `slot` on the ticks of the rest before it and its own."""

    command: int
    run: int
    slot: int
    ticks: tuple[tuple[int, int], ...]


_FIELDS = {
    "D": r"(\d{1,5}) (\d{1,3}) (\d{1,5}) (-?\d{1,5}) (-?\d{1,10})(?: (\d{1,5}))?",
    "A": r"(\d{1,5}) (\d{1,5})",
    "N": r"(\d{1,5}) (\d{1,5}) ([a-z_]+)",
    "B": r"(\d{1,5}) (\d{1,10}) (\d{1,3}) (\d{1,3}) ([a-z]+) (\d{1,10}) (\d{1,5})",
    "E": r"(\d{1,5}) (\d{1,10}) (\d{1,3}) ([a-z_]+) (\d{1,5}) (-?\d{1,10}) (\d{1,5}) (\d{1,5})",
    "Z": r"(\d{1,5}) (\d{1,10}) ([a-z_]+) (\d{1,10}) (\d{1,5}) (\d{1,5})",
    "Q": r"(\d{1,5}) (\d{1,5}) (\d{1,10}) ([a-z_]+) (\d{1,10}) (\d{1,3}) (-?\d{1,10}) (\d{1,5}) (\d{1,5}) "
    r"(\d{1,5}) (\d{1,5})",
    "R": r"(\d{1,5}) (\d{1,5}) (\d{1,10}) (\d{1,3})((?: \d{1,5} \d{1,5}){0,4})",
    "H": r"(\d{1,5}) (\d{1,5}) (\d)/(\d)((?: [A-Za-z_]+=[^ =]+)+)",
}
_LINES = {kind: re.compile(f"{kind} {fields}", re.ASCII) for kind, fields in _FIELDS.items()}


def checksum(body: bytes) -> bytes:
    """CRC-16 (polynomial 1021, start FFFF) as four digits."""
    return b"%04X" % binascii.crc_hqx(body, 0xFFFF)


def encode(kind: str, command: int, *fields: int | str) -> bytes:
    """A line for the board: `kind`, the command's number, its fields, the checksum."""
    body = " ".join(map(str, (kind, command, *fields))).encode("ascii")
    return body + b"*" + checksum(body) + b"\n"


def parse(line: bytes) -> Message | None:
    """The message in `line`; None where it is damaged."""
    body, star, sum_ = line.rpartition(b"*")
    if not star or checksum(body) != sum_ or not body.isascii():
        return None
    text = body.decode("ascii")
    pattern = _LINES.get(text[:1])
    match = pattern.fullmatch(text) if pattern else None
    if match is None or int(match[1]) > 0xFFFF:
        return None
    return _message(text[0], line.decode("ascii"), match)


def _message(kind: str, line: str, match: re.Match[str]) -> Message:
    first, *rest = match.groups()
    sequence = int(first)
    if kind == "D":
        segment, tick, duty, count = map(int, rest[:4])
        return Sample(line, sequence, segment, tick, duty, count, None if rest[4] is None else int(rest[4]))
    if kind == "H":
        pairs = dict(pair.split("=") for pair in rest[3].split())
        return Hello(line, sequence, int(rest[0]), int(rest[1]), int(rest[2]), pairs)
    if kind == "B":
        run, segment, slot = map(int, rest[:3])
        return Begin(line, sequence, run, segment, slot, rest[3], int(rest[4]), int(rest[5]))
    if kind == "E":
        return End(line, sequence, int(rest[0]), int(rest[1]), rest[2], *map(int, rest[3:]))
    if kind == "Z":
        return RunEnd(line, sequence, int(rest[0]), rest[1], *map(int, rest[2:]))
    if kind == "Q":
        return Status(line, sequence, int(rest[0]), int(rest[1]), rest[2], *map(int, rest[3:]))
    if kind == "R":
        ticks = list(map(int, rest[3].split()))
        command, run, slot = map(int, rest[:3])
        return Ran(line, sequence, command, run, slot, tuple(zip(ticks[::2], ticks[1::2], strict=True)))
    return Answer(line, sequence, int(rest[0]), rest[1] if kind == "N" else "")


class Decoder:
    """Bytes as they come become messages; whatever is not certain is left out and counted."""

    def __init__(self) -> None:
        self.damaged = 0
        """Lines with a wrong checksum or with fields that do not fit."""
        self.missing = 0
        """Lines whose sequence numbers never came; damaged ones are among them."""
        self.repeated = 0
        """Lines that had come before, or that later ones have overtaken."""
        self._torn = b""
        self._last: int | None = None
        self._stray: int | None = None
        self._sample: Sample | None = None
        self._answered = 0

    def feed(self, data: bytes) -> list[Message]:
        """The messages that `data` completes, in order."""
        *lines, torn = (self._torn + data).split(b"\n")
        self._torn = torn[-LONGEST:]
        taken = (self._take(line.rstrip(b"\r")) for line in lines if line.strip())
        return [message for message in taken if message is not None]

    def _take(self, line: bytes) -> Message | None:
        message = parse(line)
        if message is None:
            self.damaged += 1
            return None
        if not self._follows(message):
            return None
        if isinstance(message, Sample):
            self._sample = message
        elif isinstance(message, RunEnd | Answer | Hello) or (isinstance(message, Begin) and message.segment == 0):
            self._sample = None
        return message

    def _follows(self, message: Message) -> bool:
        """Whether the message comes next, or soon after what came last."""
        ahead = 0 if self._last is None else (message.sequence - self._last - 1) & 0xFFFF
        if ahead < WINDOW:
            if isinstance(message, Sample) and not self._fits(message):
                self.damaged += 1
                return False
            return self._accept(message, ahead)
        if isinstance(message, Hello) and message.command == 0 and message.sequence < message.parts:
            return True  # a reset, or a hello that was late: its number says nothing, the next answer's will
        if self._answers_anew(message):
            return self._accept(message, 0)
        behind = ahead >= 0x10000 - WINDOW
        if not behind and self._stray is not None and message.sequence == (self._stray + 1) & 0xFFFF:
            return self._accept(message, ahead)  # two in a row say the same: so many are missing
        if behind:
            self.repeated += 1
        else:
            self._stray = message.sequence
            self.damaged += 1
        return False

    def _answers_anew(self, message: Message) -> bool:
        """Whether it answers a command that was not answered before: after a reset, when numbers begin anew."""
        if not isinstance(message, Answer | Status | Ran | Hello):
            return False
        return 0 < (message.command - self._answered) & 0xFFFF < 0x8000

    def _accept(self, message: Message, ahead: int) -> bool:
        if isinstance(message, Answer | Status | Ran | Hello) and message.command:
            self._answered = message.command
        self._last, self._stray = message.sequence, None
        self.missing += ahead
        return True

    def _fits(self, sample: Sample) -> bool:
        before = self._sample
        if before is None:
            return True
        lines = (sample.sequence - before.sequence) & 0xFFFF
        if sample.segment == before.segment:
            return 0 < sample.tick - before.tick <= lines
        return 0 < sample.segment - before.segment <= lines and sample.tick < lines
