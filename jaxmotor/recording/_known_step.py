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
    """In each segment as many volts as were applied between two moments, and 0 V before and after."""

    volts: float
    at_s: float
    """Since the segment's first row [s]."""
    until_s: float = math.inf
    """The same."""

    @property
    def stated(self) -> dict[str, float]:
        """For a header."""
        until = {"step_until_s": self.until_s} if math.isfinite(self.until_s) else {}
        return {"step_V": self.volts} | ({"step_at_s": self.at_s} if self.at_s else {}) | until

    def as_column(self, table: Table, time_s: np.ndarray, bounds: np.ndarray) -> tuple[Table, str]:
        """`table`, whose rows were at `time_s` (n,) in segments between `bounds`, with a column of it, and that one.

        **Raises:** `RecordingError` where no row of a segment has it.
        """
        first = np.repeat(bounds[:-1], np.diff(bounds))
        since = time_s - time_s[first] + TINY_s
        driven = (since >= self.at_s) & (since < self.until_s)
        for start, stop in itertools.pairwise(bounds.tolist()):
            if not driven[start:stop].any():
                lasts = time_s[stop - 1] - time_s[start]
                where = f"--step-at {self.at_s:g} is after it"
                if self.at_s <= lasts:
                    where = f"no row of it is between --step-at {self.at_s:g} and --step-until {self.until_s:g}"
                raise table.fault(start, f"the segment that begins here lasts {lasts:g} s; {where}")
        name = "step"
        while name in table.cells:
            name += "_"
        cells = [repr(self.volts) if one else "0" for one in driven]
        return dataclasses.replace(table, cells={**table.cells, name: cells}), f"{name}:V"


def known_step(
    step_V: float | int | None, step_at_s: float | int | None, step_until_s: float | int | None, input: str | None
) -> KnownStep | None:
    """What was stated of it; None where the `input` is a column.

    **Raises:** `RecordingError` for what cannot be, or is stated twice.
    """
    if step_V is None:
        for option, moment in (("--step-at", step_at_s), ("--step-until", step_until_s)):
            if moment is not None:
                raise RecordingError(f"{option} is the moment of a step; state its voltage, too (--step)")
        return None
    if input is not None:
        raise RecordingError("--input and --step both say what was applied; state one of them")
    if not (is_number(step_V) and 0 < abs(step_V) <= MOST_V):
        raise RecordingError(f"--step is {shown(step_V)}; give the volts that were applied")
    at_s = 0.0 if step_at_s is None else step_at_s
    if not (is_number(at_s) and 0 <= at_s < math.inf):
        raise RecordingError(f"--step-at is {shown(step_at_s)}; give the seconds from the first row on")
    until_s = math.inf if step_until_s is None else step_until_s
    if not (is_number(until_s) and at_s < until_s):
        raise RecordingError(
            f"--step-until is {shown(step_until_s)}; give seconds from the first row on that are after --step-at"
        )
    return KnownStep(float(step_V), float(at_s), float(until_s))
