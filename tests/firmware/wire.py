"""The protocol from the host's side, as small as the tests need it."""

import binascii
import dataclasses


def seal(text: str) -> bytes:
    """The line with its checksum."""
    return f"{text}*{binascii.crc_hqx(text.encode(), 0xFFFF):04X}\n".encode()


@dataclasses.dataclass(frozen=True)
class Line:
    type: str
    sequence: int
    fields: tuple[str, ...]

    def ints(self, start: int = 0) -> list[int]:
        return [int(field) for field in self.fields[start:]]


def unseal(line: bytes) -> Line | None:
    """The line without its checksum, None where that is wrong."""
    body, star, crc = line.rstrip(b"\n").rpartition(b"*")
    if not star or f"{binascii.crc_hqx(body, 0xFFFF):04X}".encode() != crc:
        return None
    kind, sequence, *fields = body.decode("ascii").split(" ")
    return Line(kind, int(sequence), tuple(fields))


def hertz(frequency: float, period_s: float) -> int:
    """Phase increment of a sine."""
    return round(frequency * period_s * 2**32) % 2**32


def level(duty: float) -> int:
    """Amplitude, offset or level in the board's 1/128 duty."""
    return round(duty * 128)


class Script:
    """Commands with running numbers."""

    def __init__(self):
        self.lines: list[bytes] = []
        self.slots = 0

    def command(self, text: str) -> "Script":
        kind, _, rest = text.partition(" ")
        self.lines.append(seal(f"{kind} {len(self.lines) + 1} {rest}".rstrip()))
        return self

    def add(self, kind: str, ticks: int, a: int = 0, b: int = 0, c: int = 0, rest: int = 0) -> "Script":
        self.slots += 1
        return self.command(f"S {self.slots - 1} {kind} {rest} {ticks} {a} {b} {c}")

    def go(self) -> "Script":
        return self.command(f"G {self.slots}")

    def __bytes__(self) -> bytes:
        return b"".join(self.lines)
