"""A foreign log's columns."""

import dataclasses
from typing import NamedTuple

import numpy as np


class Inputs(NamedTuple):
    """What was applied, by row."""

    volts: np.ndarray
    """(n,) [V]"""
    duty: np.ndarray | None = None
    """(n,) whole numbers; None where there are none."""
    full_scale: float | None = None
    """The duty that means the whole supply [1]."""

    def at(self, rows: np.ndarray) -> "Inputs":
        """Of `rows`, indices or true where they are."""
        return self._replace(volts=self.volts[rows], duty=_at(self.duty, rows))


@dataclasses.dataclass(frozen=True)
class Log:
    """Columns in SI, not yet cut into segments."""

    stamps: tuple[np.ndarray, float]
    """(n,) time [s] and the step of its last printed digit [s]."""
    input: Inputs
    shaft: dict[str, np.ndarray]
    """(n,) of one name, `count`, `angle_rad` or `speed_rad_s`."""
    supply_V: np.ndarray | None = None
    """(n,) measured; NaN where it was not."""
    after_gap: np.ndarray | None = None
    """(n,) whether rows are missing before this one."""
    unread: np.ndarray | None = None
    """(n,) the rows at which the shaft was not read; None where it was in all."""
    apart: bool = False
    """Inputs and readings came at moments of their own."""

    @property
    def read(self) -> np.ndarray:
        """(n,) bool, the rows at which the shaft was read."""
        return np.ones(len(self.stamps[0]), bool) if self.unread is None else ~self.unread

    def only(self, kept: np.ndarray) -> "Log":
        """The rows where `kept` (n,) is true; those left out are gaps."""
        gaps = np.cumsum(~kept if self.after_gap is None else ~kept | self.after_gap)[kept]
        return dataclasses.replace(self.at(kept), after_gap=np.diff(gaps, prepend=0) > 0)

    def at(self, rows: np.ndarray) -> "Log":
        """The `rows`, indices or true where they are."""
        return Log(
            (self.stamps[0][rows], self.stamps[1]),
            self.input.at(rows),
            {name: column[rows] for name, column in self.shaft.items()},
            _at(self.supply_V, rows),
            _at(self.after_gap, rows),
            None if self.unread is None or not self.unread[rows].any() else self.unread[rows],
            self.apart,
        )


def _at(column: np.ndarray | None, rows: np.ndarray) -> np.ndarray | None:
    return None if column is None else column[rows]
