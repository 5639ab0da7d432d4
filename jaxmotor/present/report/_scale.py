"""Axes of plots: from values to places, and where the ticks stand."""

import dataclasses
import math

import numpy as np

STEPS = (1.0, 2.0, 5.0, 10.0)
MOST_TICKS = 7


@dataclasses.dataclass(frozen=True)
class Scale:
    """One axis, linear or logarithmic."""

    low: float
    high: float
    label: str
    log: bool = False

    @classmethod
    def of(cls, values: np.ndarray, label: str, *, log: bool = False, margin: float = 0.04) -> "Scale":
        """The scale that holds all finite `values` (on a logarithmic one the positive) and a `margin` [1] beside."""
        seen = np.asarray(values, dtype=float).ravel()
        seen = seen[np.isfinite(seen) & ((seen > 0) | (not log))]
        if not len(seen):
            return cls(0.1, 1.0, label, log)
        ends = np.array([seen.min(), seen.max()])
        if log:
            ends = np.log(ends)
        width = ends[1] - ends[0]
        room = margin * width if width > 0 else 0.5 * max(abs(ends[1]), 1e-9)
        low, high = (np.exp if log else float)(ends[0] - room), (np.exp if log else float)(ends[1] + room)
        return cls(float(low), float(high), label, log)

    def place(self, values: np.ndarray, begin: float, end: float) -> np.ndarray:
        """Where `values` stand between `begin`, the place of `low`, and `end`, that of `high`."""
        shown = np.asarray(values, dtype=float)
        if not self.log:
            return begin + (end - begin) * (shown - self.low) / (self.high - self.low)
        with np.errstate(divide="ignore", invalid="ignore"):
            share = (np.log(shown) - math.log(self.low)) / (math.log(self.high) - math.log(self.low))
        return begin + (end - begin) * np.where(shown > 0, share, np.nan)

    def spot(self, value: float, begin: float, end: float) -> float:
        """Where one `value` stands."""
        return float(self.place(np.array([value]), begin, end)[0])

    def ticks(self) -> list[float]:
        """Round numbers on the axis, eight at most."""
        if not self.log:
            return self._even()
        decades = range(math.floor(math.log10(self.low)), math.ceil(math.log10(self.high)) + 1)
        for steps in ((1.0, 2.0, 5.0), (1.0,)):
            found = [step * 10.0**k for k in decades for step in steps if self.low <= step * 10.0**k <= self.high]
            if 2 <= len(found) <= MOST_TICKS + 2:
                return found
        return found[:: 1 + len(found) // MOST_TICKS] if len(found) > 1 else self._even()

    def _even(self) -> list[float]:
        rough = (self.high - self.low) / MOST_TICKS
        unit = 10.0 ** math.floor(math.log10(rough))
        step = next(unit * one for one in STEPS if unit * one >= rough * (1 - 1e-9))
        first, last = math.ceil(self.low / step - 1e-9), math.floor(self.high / step + 1e-9)
        return [round(k * step, 12 - math.floor(math.log10(step))) for k in range(first, last + 1)]


def tick_text(value: float) -> str:
    """As short as it can be, with a true minus sign."""
    return f"{value + 0.0:.6g}".replace("-", "\N{MINUS SIGN}")
