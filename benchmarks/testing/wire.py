"""The protocol from the host's side, as small as the tests need it."""

import binascii
import dataclasses
import struct

KINDS = ("rest", "step", "ramp", "sine", "multisine", "chirp", "prbs", "loop")
RUN = 7


def seal(text: str) -> bytes:
    """The line with its checksum."""
    return seal_bytes(text.encode())


def seal_bytes(body: bytes) -> bytes:
    """The same of bytes that need not be text."""
    return body + f"*{binascii.crc_hqx(body, 0xFFFF):04X}\n".encode()


@dataclasses.dataclass(frozen=True)
class Line:
    type: str
    sequence: int
    fields: tuple[str, ...]
    run: int | None = None
    """Of a `B`, `E` or `Z`, which have it before their other fields."""

    def ints(self, start: int = 0) -> list[int]:
        return [int(field) for field in self.fields[start:]]


def unseal(line: bytes) -> Line | None:
    """The line without its checksum, None where that is wrong."""
    body, star, crc = line.rstrip(b"\n").rpartition(b"*")
    if not star or f"{binascii.crc_hqx(body, 0xFFFF):04X}".encode() != crc:
        return None
    kind, sequence, *fields = body.decode("ascii").split(" ")
    run = int(fields.pop(0)) if kind in "BEZ" else None
    return Line(kind, int(sequence), tuple(fields), run)


def hertz(frequency: float, period_s: float) -> int:
    """Phase increment of a sine."""
    return round(frequency * period_s * 2**32) % 2**32


def level(duty: float) -> int:
    """Amplitude, offset or level in the board's 1/128 duty."""
    return round(duty * 128)


class Script:
    """Commands with running numbers, for the run `run`."""

    def __init__(self, run: int = RUN, first: int = 1):
        self.lines: list[bytes] = []
        self.run, self.first = run, first
        self.slots: list[tuple] = []
        self.period, self.limits = (5, 0), (10_000_000, 3_600_000, 6000)

    def command(self, text: str) -> "Script":
        kind, _, rest = text.partition(" ")
        if kind in "PL":
            numbers = tuple(map(int, rest.split()))
            self.period, self.limits = (numbers, self.limits) if kind == "P" else (self.period, numbers)
        self.lines.append(seal(f"{kind} {len(self.lines) + self.first} {rest}".rstrip()))
        return self

    def add(self, kind: str, ticks: int, a: int = 0, b: int = 0, c: int = 0, rest: int = 0) -> "Script":
        if not self.slots:
            self.command(f"C {self.run}")
        self.slots.append((KINDS.index(kind), rest, ticks, a, b, c))
        return self.command(f"S {len(self.slots) - 1} {kind} {rest} {ticks} {a} {b} {c}")

    @property
    def sum(self) -> int:
        """Over period, drive, limits and slots, as `G` has it."""
        data = struct.pack("<BBiIH", *self.period, *self.limits)
        data += b"".join(struct.pack("<BHHIih", *slot) for slot in self.slots)
        return binascii.crc_hqx(data, 0xFFFF)

    def go(self) -> "Script":
        return self.command(f"G {self.run} {len(self.slots)} {self.sum}")

    def __bytes__(self) -> bytes:
        return b"".join(self.lines)
