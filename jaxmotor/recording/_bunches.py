"""Rows that were stamped as a computer received them, several at a time, and not as they were measured."""

import numpy as np

from jaxmotor.recording._recording import Recording

SHORT = 0.2
"""Of the mean time between rows: less is next to none."""
MANY = 0.5
"""Share of such times, from which rows come in bunches."""
TOGETHER = 20
"""Rows, over which bunches even out."""
EVEN = 0.25
"""Relative deviation of the time that so many rows take, up to which a board logged evenly; a log of events follows the
speed of the shaft."""


def warn_bunches(recording: Recording) -> list[str]:
    """Time stamps by which most rows come at once with the one before, though some rows take an even time."""
    steps = [np.diff(one.time_s) for one in recording.segments if one.tick is None and len(one) > 2 * TOGETHER]
    if not steps:
        return []
    usual_s = float(np.concatenate(steps).mean())
    short = np.concatenate(steps) < SHORT * usual_s
    sums = np.concatenate([one[: len(one) // TOGETHER * TOGETHER].reshape(-1, TOGETHER).sum(axis=1) for one in steps])
    if short.mean() < MANY or sums.std() > EVEN * sums.mean():
        return []
    return [
        f"{short.sum()} of {len(short)} rows come at once with the one before: their times are those at which a "
        "computer received them, several at a time, and speeds by these times are wrong; where the board logged "
        f"evenly, import the log with --period {usual_s:.2g} instead of its time stamps"
    ]
