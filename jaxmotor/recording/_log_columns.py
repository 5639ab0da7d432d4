"""A foreign log's columns."""

import dataclasses

import numpy as np


@dataclasses.dataclass(frozen=True)
class Log:
    """Columns in SI, not yet cut into segments."""

    stamps: tuple[np.ndarray, float]
    """(n,) time [s] and the step of its last printed digit [s]."""
    input: tuple[np.ndarray, np.ndarray | None, float | None]
    """(n,) volts, (n,) duty, and the duty that means the whole supply."""
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
        """The rows where `kept` (n,) is true."""
        volts, duty, full = self.input
        gaps = np.cumsum(~kept if self.after_gap is None else ~kept | self.after_gap)[kept]
        return self.at(kept, (volts[kept], None if duty is None else duty[kept], full), np.diff(gaps, prepend=0) > 0)

    def at(
        self,
        kept: np.ndarray,
        inputs: tuple[np.ndarray, np.ndarray | None, float | None],
        after_gap: np.ndarray | None,
    ) -> "Log":
        """The rows `kept`, indices or true where they are, with these inputs instead of their own."""
        return Log(
            (self.stamps[0][kept], self.stamps[1]),
            inputs,
            {name: column[kept] for name, column in self.shaft.items()},
            None if self.supply_V is None else self.supply_V[kept],
            after_gap,
            None if self.unread is None or not self.unread[kept].any() else self.unread[kept],
            self.apart,
        )
