"""The input of a log that has no column of it: one step, whose voltage is known."""

import dataclasses
import itertools
import math
from typing import NamedTuple

import numpy as np

from jaxmotor._arguments import is_number
from jaxmotor._sentences import shown
from jaxmotor.recording._columns import FLOATS
from jaxmotor.recording._recording import RecordingError
from jaxmotor.recording._table import Table

MOST_V = FLOATS["volts"]
"""Volts at most."""
TINY_s = 1e-9
"""Part of a second by which stamps may be off."""


class KnownStep(NamedTuple):
    """In each segment 0 V, and from a moment on as many as were applied."""

    volts: float
    at_s: float
    """Since the segment's first row [s]."""

    @property
    def stated(self) -> dict[str, float]:
        """For a header."""
        return {"step_V": self.volts} | ({"step_at_s": self.at_s} if self.at_s else {})

    def as_column(self, table: Table, time_s: np.ndarray, bounds: np.ndarray) -> tuple[Table, str]:
        """`table`, whose rows were at `time_s` (n,) in segments between `bounds`, with a column of it, and that one.

        **Raises:** `RecordingError` where a segment ends before.
        """
        first = np.repeat(bounds[:-1], np.diff(bounds))
        driven = time_s - time_s[first] >= self.at_s - TINY_s
        for start, stop in itertools.pairwise(bounds.tolist()):
            if not driven[start:stop].any():
                lasts = time_s[stop - 1] - time_s[start]
                raise table.fault(
                    start, f"the segment that begins here lasts {lasts:g} s; --step-at {self.at_s:g} is after it"
                )
        name = "step"
        while name in table.cells:
            name += "_"
        cells = [repr(self.volts) if one else "0" for one in driven]
        return dataclasses.replace(table, cells={**table.cells, name: cells}), f"{name}:V"


def known_step(step_V: float | int | None, step_at_s: float | int | None, input: str | None) -> KnownStep | None:
    """What was stated of it; None where the `input` is a column.

    **Raises:** `RecordingError` for what cannot be, or is stated twice.
    """
    if step_V is None:
        if step_at_s is not None:
            raise RecordingError("--step-at is the moment of a step; state its voltage, too (--step)")
        return None
    if input is not None:
        raise RecordingError("--input and --step both say what was applied; state one of them")
    if not (is_number(step_V) and 0 < abs(step_V) <= MOST_V):
        raise RecordingError(f"--step is {shown(step_V)}; give the volts that were applied")
    at_s = 0.0 if step_at_s is None else step_at_s
    if not (is_number(at_s) and 0 <= at_s < math.inf):
        raise RecordingError(f"--step-at is {shown(step_at_s)}; give the seconds from the first row on")
    return KnownStep(float(step_V), float(at_s))
