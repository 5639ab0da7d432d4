"""What a board must answer, by docs/protocol.md and nothing else: the model that the firmware is held against."""

import binascii
import dataclasses
import re
import struct

KINDS = ("rest", "step", "ramp", "sine", "multisine", "chirp", "prbs", "loop")
LEVEL_MAX = 250 * 128
WORD_32 = 2**32
ORDERS = (5, 6, 7, 9, 10, 11, 15)
LONGEST = 79


@dataclasses.dataclass(frozen=True)
class Said:
    """An answer: its letter, the fields that the model knows, and whether it starts a run."""

    letter: str
    fields: tuple[str, ...]
    starts: bool = False


class Refused(Exception):
    """The word of a refusal."""


def number(text: str, low: int, high: int) -> int:
    """A decimal integer in range."""
    if not re.fullmatch(r"-?[0-9]+", text, re.ASCII) or abs(int(text)) >= WORD_32 or not low <= int(text) <= high:
        raise Refused("argument")
    return int(text)


def unsigned(text: str) -> int:
    """32 bits, without a sign."""
    if text.startswith("-"):
        raise Refused("argument")
    return number(text, 0, WORD_32 - 1)


class BoardModel:
    """A board at rest between runs, which end before the next line comes."""

    def __init__(self, supply_mV: int) -> None:
        self.supply_mV = supply_mV
        self.bad_lines = 0
        self.run = self.claimed = 0
        self.settings = (5, 0)
        self.limits = (10_000_000, 3_600_000, 6000)
        self.plan: list[tuple[int, int, int, int, int, int]] = []
        self.spent: list[tuple[int, int, int, int, int, int]] = []

    @property
    def sum(self) -> int:
        """Over what a `G` starts."""
        data = struct.pack("<BBiIH", *self.settings, *self.limits)
        data += b"".join(struct.pack("<BHHIih", *slot) for slot in self.plan)
        return binascii.crc_hqx(data, 0xFFFF)

    def hears(self, body: bytes) -> Said | None:
        """The answer to a line with a right sum, `body` being what stands before its asterisk."""
        if any(not 32 <= byte < 127 for byte in body) or len(body) + 5 > LONGEST or not body:
            self.bad_lines += 1
            return None
        letter, text = chr(body[0]), body[1:].decode("ascii")
        if not text:
            return self._obey(letter, "0", [])
        fields = text.split(" ")
        try:
            if fields[0]:
                raise Refused("argument")
            number(fields[1], 0, 65535)
        except Refused:
            self.bad_lines += 1
            return Said("N", ("0", "argument"))
        return self._obey(letter, str(int(fields[1])), fields[2:])

    def _obey(self, letter: str, command: str, fields: list[str]) -> Said:
        try:
            if letter in "HQR":
                return self._tell(letter, command, fields)
            act = {"X": self._stop, "J": self._skip, "G": self._go, "C": self._claim, "S": self._slot}
            act |= {"P": self._period, "L": self._limits, "U": self._baud}
            if letter not in act:
                raise Refused("unknown" if letter != "K" else "argument")
            starts = act[letter](fields)
        except Refused as refused:
            return Said("N", (command, str(refused)))
        return Said("A", (command,), bool(starts))

    def _tell(self, letter: str, command: str, fields: list[str]) -> Said:
        if letter == "R":
            [slot] = _exactly(fields, 1)
            first = number(slot, 0, 59)
            told = len(self.plan[first : first + 4]) if self.claimed == self.run else 0
            return Said("R", (command, str(self.run), str(first), f"{2 * told} numbers"))
        _exactly(fields, 0)
        return Said(letter, (command,) if letter == "H" else (command, str(self.run)))

    def _stop(self, fields: list[str]) -> None:
        _exactly(fields, 0)

    def _skip(self, fields: list[str]) -> None:
        run, segment = _exactly(fields, 2)
        unsigned(run)
        number(segment, 0, 255)
        raise Refused("idle")

    def _claim(self, fields: list[str]) -> None:
        [run] = map(unsigned, _exactly(fields, 1))
        if run <= self.run:
            raise Refused("old")
        if run != self.claimed:
            self.plan = []
        self.claimed = run

    def _slot(self, fields: list[str]) -> None:
        index_text, kind, *texts = _exactly(fields, 7)
        index = number(index_text, 0, 255)
        if kind not in KINDS:
            raise Refused("argument")
        rest, ticks = number(texts[0], 0, 65535), number(texts[1], 2, 65535)
        a, b, c = unsigned(texts[2]), number(texts[3], -(2**31), 2**31 - 1), number(texts[4], -32768, 32767)
        if rest == 1 or not _runs(kind, a, b, c):
            raise Refused("argument")
        if index > len(self.plan) or self.claimed == self.run:
            raise Refused("order")
        if index >= 60:
            raise Refused("full")
        slot = (KINDS.index(kind), rest, ticks, a, b, c)
        if index == len(self.plan) or self.plan[index] != slot:
            self.plan[index:] = [slot]

    def _go(self, fields: list[str]) -> bool:
        run_text, slots_text, sum_text = _exactly(fields, 3)
        run, slots, sum_ = unsigned(run_text), number(slots_text, 0, 255), number(sum_text, 0, 65535)
        if run and run == self.run:
            return False
        if run <= self.run:
            raise Refused("old")
        if run != self.claimed:
            raise Refused("order")
        if not self.plan:
            raise Refused("empty")
        if slots != len(self.plan) or sum_ != self.sum:
            raise Refused("plan")
        if self.supply_mV < self.limits[2]:
            raise Refused("supply")
        self.run = run
        return True

    def _period(self, fields: list[str]) -> None:
        period, drive = _exactly(fields, 2)
        self.settings = number(period, 1, 20), number(drive, 0, 1)

    def _limits(self, fields: list[str]) -> None:
        travel, time, supply = _exactly(fields, 3)
        self.limits = number(travel, 1, 2**31 - 1), number(time, 1, 2**31 - 1), number(supply, 0, 20000)

    def _baud(self, fields: list[str]) -> None:
        [baud] = map(unsigned, _exactly(fields, 1))
        if baud not in (115200, 250000, 500000, 1000000):
            raise Refused("argument")


def _exactly(fields: list[str], number_of: int) -> list[str]:
    if len(fields) != number_of:
        raise Refused("argument")
    return fields


def _runs(kind: str, a: int, b: int, c: int) -> bool:
    """Whether the numbers are in the ranges of the kind."""
    swing = abs(b) <= LEVEL_MAX and abs(c) + abs(b) <= LEVEL_MAX
    return {
        "rest": a == b == c == 0,
        "step": a == c == 0 and abs(b) <= LEVEL_MAX,
        "ramp": a == 0 and abs(b) <= LEVEL_MAX and abs(c) <= LEVEL_MAX,
        "sine": swing,
        "multisine": abs(b) <= LEVEL_MAX and 1 <= c % 256 <= 8 and c // 256 > 0,
        "chirp": abs(c) <= LEVEL_MAX,
        "prbs": swing and a % 256 in ORDERS and 1 <= a // 256 <= 255,
        "loop": abs(b) <= 16384 and c == 0,
    }[kind]
