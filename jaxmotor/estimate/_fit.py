"""What an identification gives: the motor, how sure, how well it fits, and what the user should know."""

import dataclasses
import math
from pathlib import Path
from typing import Literal

import numpy as np

from jaxmotor._shown import Row, Shown
from jaxmotor.estimate._assess import Assessment
from jaxmotor.estimate._frequency_response import FrequencyResponse
from jaxmotor.estimate._model import UNKNOWN_RIG, Model, ModelRig
from jaxmotor.estimate._open_hypotheses import allowing
from jaxmotor.estimate._rows import LINEAR, linear_rows
from jaxmotor.prediction import Noise


@dataclasses.dataclass(frozen=True, eq=False)
class Trace:
    """Measured speed of one segment, and the motor's in free simulation, at the rows where a speed is known."""

    segment: int
    """Index in the recording."""
    time_s: np.ndarray
    """Since the segment's first row [s]; of a mean speed over a tick, the tick's begin."""
    measured_rad_s: np.ndarray
    simulated_rad_s: np.ndarray

    @property
    def residual_rad_s(self) -> np.ndarray:
        """Measured minus simulated."""
        return self.measured_rad_s - self.simulated_rad_s


@dataclasses.dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class Fit(Shown, Assessment):
    """A linear motor identified from one recording."""

    method: Literal["exact", "paper"]
    source: str
    """The recording's file."""
    period_s: float | None
    chi2_per_sample: float
    """Mean squared residual over that of the noise alone; 1 is the floor."""
    floor_known: bool
    """The floor follows from the encoder; otherwise it was estimated from the data."""
    noise: Noise
    """Of one reading."""
    fit_percent: float
    """100 (1 - |y - ŷ|/|y - mean y|) of a free simulation of the speed of the fitted segments."""
    fitted: tuple[int, ...]
    """Segments that were fitted, and that `fit_percent` and `chi2_per_sample` are of."""
    held_out: tuple[int, ...]
    """Segments that were not."""
    fingerprints: tuple[str, ...]
    """Of the fitted segments' data, by which they are known again."""
    traces: tuple[Trace, ...]
    """Of the fitted segments."""
    frequency_response: FrequencyResponse | None
    """Where there are sines of two frequencies or more."""
    rig: ModelRig = UNKNOWN_RIG
    """What the recording states of its encoder and supply."""

    @property
    def has_offset(self) -> bool:
        """A voltage offset was fitted along."""
        return self.method == "exact" and self.offset_standard_error_V > 0

    @property
    def model(self) -> Model:
        """The motor as its model file would hold it."""
        return Model(
            self.motor,
            self.covariance,
            self.offset_V,
            self.period_s,
            self.source,
            frozenset(self.fingerprints),
            self.source,
            response=self.frequency_response,
            rig=self.rig,
            offset_error_V=self.offset_standard_error_V,
            average=self.average,
        )

    def _title(self) -> str:
        return f"Fit of {Path(self.source).name} ({self.method}, {len(self.fitted)} segments, ± is 95 %)"

    def _rows(self) -> tuple[Row, ...]:
        errors = [getattr(self.standard_error, name, math.nan) for name, _ in LINEAR]
        offset = Row("voltage_offset", self.offset_V, self.offset_standard_error_V, "V")
        return (*linear_rows(self.motor, errors), *([offset] if self.has_offset else []))

    def _remarks(self) -> tuple[str, ...]:
        left_open = allowing(self)
        score = f"fit {self.fit_percent:.1f} % of the speed, chi2 {self.chi2_per_sample:.3g} per sample (1 = noise)"
        return (score, *([left_open] if left_open else []), *(f"note: {note}" for note in self.notes))
