"""The shaft's column of a foreign log: speed, angle, running counter or pulses per interval, in SI."""

import dataclasses
from collections.abc import Collection
from typing import Literal

import numpy as np

from jaxmotor._sentences import shown
from jaxmotor.recording._recording import RecordingError
from jaxmotor.recording._table import Table
from jaxmotor.recording._units import Scale, angle_factor, existing, speed_factor, split_unit

MOST_TURNED = 3 / 8
"""Of a counter's range from one row to the next; beyond that a turn forward may have been one backward."""
WIDTHS = (2, 56)
"""Least and greatest width of a counter that wraps [bit]."""


@dataclasses.dataclass(frozen=True)
class Shaft:
    """What was stated of the shaft's column; one of the first four is given."""

    speed: str | None = None
    angle: str | None = None
    count: str | None = None
    pulses: str | None = None
    wrap: int | Literal["turn"] | None = None
    """Width of a counter that wraps [bit], or an angle that was logged within one turn."""

    def check(self) -> None:
        """**Raises:** `RecordingError` where not exactly one column is stated, or `wrap` does not fit it."""
        if sum(choice is not None for choice in (self.speed, self.angle, self.count, self.pulses)) != 1:
            raise RecordingError(
                "exactly one of --speed, --angle, --count and --pulses is needed; state which column is the shaft"
            )
        if self.wrap is None:
            return
        if self.wrap == "turn":
            if self.angle is None:
                raise RecordingError("--wrap turn belongs to --angle; of a counter state its width in bits")
        elif self.count is None:
            raise RecordingError("--wrap BITS belongs to --count; of an angle within one turn say --wrap turn")
        elif isinstance(self.wrap, str) or not WIDTHS[0] <= self.wrap <= WIDTHS[1]:
            raise RecordingError(
                f"--wrap is {shown(self.wrap)}; it is the width of the counter, {WIDTHS[0]} to {WIDTHS[1]} bit"
            )

    def column(self, names: Collection[str]) -> tuple[str, str]:
        """The column that is meant, and its unit.

        **Raises:** `RecordingError`.
        """
        if self.speed is not None:
            return split_unit(self.speed, names, "the speed")
        if self.angle is not None:
            return split_unit(self.angle, names, "the angle")
        return existing(self.count or self.pulses or "", names), "counts"

    def read(self, table: Table, scale: Scale) -> dict[str, np.ndarray]:
        """(n,) of one name: `speed_rad_s`, `angle_rad`, or `count`, which runs on where the logged one wrapped.

        **Raises:** `RecordingError`.
        """
        column, unit = self.column(table.cells)
        if self.speed is not None:
            return {"speed_rad_s": table.numbers(column) * speed_factor(unit, scale)}
        if self.angle is not None:
            angle = table.numbers(column) * angle_factor(unit, scale)
            return {"angle_rad": _unwrapped_angle(table, angle) if self.wrap == "turn" else angle}
        angle_factor(unit, scale)
        counts = table.integers(column)
        if counts is None:
            hint = "" if self.count is None else f"; give it as --angle {column}:counts"
            raise RecordingError(f"column {column!r} has counts that are not whole{hint}")
        if self.pulses is not None:
            if np.abs(counts.astype(float)).sum() > 2.0**62:
                raise RecordingError(f"column {column!r} adds up to more counts than can be meant; correct it")
            return {"count": np.cumsum(counts)}
        return {"count": counts if self.wrap is None else _unwrapped_count(table, column, counts, int(self.wrap))}


def _unwrapped_count(table: Table, column: str, counts: np.ndarray, bits: int) -> np.ndarray:
    """Each step is the least one modulo 2^bits, whether the counter has a sign or not."""
    size = 2**bits
    low, high = int(counts.min()), int(counts.max())
    if high >= size or low < -size // 2 or (low < 0 and high >= size // 2):
        row = int(np.argmax(counts) if high >= size // 2 else np.argmin(counts))
        raise table.fault(
            row, f"{column} is {counts[row]}, more than a counter of {bits} bit holds; state another width"
        )
    step = (np.diff(counts) + size // 2) % size - size // 2
    _check_steps(table, np.abs(step) / size, f"a counter of {bits} bit")
    return counts[0] + np.concatenate([[0], np.cumsum(step)])


def _unwrapped_angle(table: Table, angle: np.ndarray) -> np.ndarray:
    if np.ptp(angle) > 2 * np.pi * (1 + 1e-6):
        raise table.fault(
            int(np.argmax(angle)), "the angle goes beyond one turn, so it does not wrap; leave --wrap out"
        )
    step = np.diff(angle)
    step -= 2 * np.pi * np.rint(step / (2 * np.pi))
    _check_steps(table, np.abs(step) / (2 * np.pi), "an angle within one turn")
    return angle[0] + np.concatenate([[0.0], np.cumsum(step)])


def _check_steps(table: Table, share: np.ndarray, what: str) -> None:
    # Across missing rows nothing can be told, and nothing is made of the step.
    neighbours = np.diff(np.asarray(table.lines)) == 1
    far = neighbours & (share > MOST_TURNED)
    if far.any():
        row = int(np.argmax(far)) + 1
        raise table.fault(
            row, f"{what} moves by {share[row - 1]:.0%} of its range in one row, too far to tell wraps; log faster"
        )
