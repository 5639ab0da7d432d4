"""Experiments that begin while the voltage before them may still act."""

import dataclasses

import numpy as np

from jaxmotor.estimate._lanes import Packed
from jaxmotor.recording import Recording

LATE = 4
"""Ticks for which a voltage may still act: more than a hobby rig's delay, and three times the current's lag."""


def without_beginnings(recording: Recording, packed: Packed) -> Packed:
    """`packed` without what was observed in the first rows of pieces before which other voltages had been applied.

    A piece that does not begin at rest begins at a speed that is fitted. A delay, or the current's lag, carries older
    voltages into it, which the piece does not hold; once they have passed, that speed makes up for them.
    """
    valid = packed.lanes.valid.copy()
    for lane, first in zip(*np.nonzero(packed.lanes.free), strict=True):
        segment, row = int(packed.segment_of[lane, first]), int(packed.row_of[lane, first])
        if row == 0 and not _driven_before(recording, segment):
            continue
        rows = np.flatnonzero(valid[lane] & (packed.lanes.piece[lane] == packed.lanes.piece[lane, first]))
        valid[lane, rows[: min(LATE, len(rows) // 3)]] = False
    return dataclasses.replace(packed, lanes=packed.lanes._replace(valid=valid))


def _driven_before(recording: Recording, index: int) -> bool:
    """A voltage was applied within `LATE` ticks before the segment `index`."""
    if index == 0:
        return False
    before, segment = recording.segments[index - 1], recording.segments[index]
    tick = recording.period_s or float(np.median(np.diff(segment.time_s)))
    ago = segment.start_s - (before.start_s + before.time_s)
    return bool((before.volts[(ago > 0) & (ago < (LATE + 0.5) * tick)] != 0).any())
