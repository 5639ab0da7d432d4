"""What the board says of itself in its hello. The host knows none of it beforehand."""

import dataclasses
from collections.abc import Iterable, Mapping

from jaxmotor.bench._protocol import Hello, RecorderError

PROTOCOL = 2
BAUDS = (115200, 250000, 500000, 1000000)
LINE_BITS = 32 * 10
"""Of a sample's line on the wire, generously."""


@dataclasses.dataclass(frozen=True)
class Board:
    """The board's constants, SI where they have a unit."""

    firmware: str
    period_max_ms: int
    full_scale: int
    duty_delay_s: float
    """From a tick to the moment at which its duty takes effect."""
    counts_per_rev: float
    slots: int
    tones: int
    supply_V: float
    """When it said hello."""
    supply_min_V: float
    reset: str
    """Why it had started: `power`, `watchdog`."""
    last_run: int = 0
    """Number of the last run since then."""


def gather(parts: Iterable[Hello]) -> dict[str, str] | None:
    """All keys of one hello; None while parts are missing."""
    found = {part.part: part for part in parts}
    if not found or set(found) != set(range(1, next(iter(found.values())).parts + 1)):
        return None
    return {key: value for number in sorted(found) for key, value in found[number].values.items()}


def board_of(values: Mapping[str, str], port: str) -> Board:
    """The board that said `values`.

    **Raises:** `RecorderError` where it speaks another protocol or leaves something out.
    """
    if values.get("protocol") != str(PROTOCOL):
        spoken = values.get("protocol", "none")
        raise RecorderError(
            f"{port}: the board speaks protocol {spoken}, this jaxmotor protocol {PROTOCOL}; "
            "flash the firmware that belongs to it (make -C firmware flash PORT=...)"
        )
    try:
        return Board(
            firmware=values["firmware"],
            period_max_ms=int(values["period_max"]) * int(values["tick_us"]) // 1000,
            full_scale=int(values["full_scale"]),
            duty_delay_s=int(values["duty_delay_us"]) / 1e6,
            counts_per_rev=int(values["counts_per_rev_milli"]) / 1000,
            slots=int(values["slots"]),
            tones=int(values["tones"]),
            supply_V=int(values["supply_mV"]) / 1000,
            supply_min_V=int(values["supply_min_mV"]) / 1000,
            reset=values["reset"],
            last_run=int(values["run"]),
        )
    except (KeyError, ValueError) as error:
        raise RecorderError(
            f"{port}: the board's hello is not understood ({error}); flash the firmware that belongs to this jaxmotor"
        ) from error


def baud_for(period_ms: int, baud: int) -> int:
    """The rate that carries a sample every `period_ms` with a third to spare: `baud` or the next that does."""
    needed = 1.5 * LINE_BITS * 1000 / period_ms
    return next((rate for rate in sorted({baud, *BAUDS}) if rate >= baud and rate >= needed), max(BAUDS))
