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
