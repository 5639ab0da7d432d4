"""What an identification gives: the motor, how sure, how well it fits, and what the user should know."""

import dataclasses
from typing import Literal

import numpy as np

from jaxmotor.estimate._frequency_response import FrequencyResponse
from jaxmotor.estimate._model import Model
from jaxmotor.estimate._open_hypotheses import Allowed, OpenHypothesis
from jaxmotor.estimate._speed_average import SpeedAverage
from jaxmotor.estimate._timing import Timing
from jaxmotor.motor import AbstractLinearMotor
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


@dataclasses.dataclass(frozen=True, eq=False)
class Fit:
    """A linear motor identified from one recording."""

    motor: AbstractLinearMotor
    standard_error: AbstractLinearMotor
    """One for each parameter, in its unit; 1.96 of them each way hold the truth 95 times of 100."""
    covariance: np.ndarray
    """(p, p) of (gain [rad/s/V], pole [rad/s], electrical time constant [s] if there is one)."""
    offset_V: float
    """Constant voltage error that was fitted along [V]; 0 where the method has none."""
    offset_standard_error_V: float
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
    notes: tuple[str, ...]
    """Sentences that a user should read."""
    open_hypotheses: tuple[OpenHypothesis, ...] = ()
    """Laws that the recording can neither show nor exclude."""
    allowed: Allowed | None = None
    """Intervals of gain and pole that allow for hidden laws; None where the method does not know."""
    timing: Timing | None = None
    """The log's own, where the header does not state it and the data show one."""
    average: SpeedAverage | None = None
    """The same of its speeds."""

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
        )

    def __repr__(self) -> str:
        gain, pole = float(self.motor.gain), float(self.motor.pole)
        gain_error, pole_error = float(self.standard_error.gain), float(self.standard_error.pole)
        return (
            f"Fit(gain {gain:.6g} ± {1.96 * gain_error:.2g} rad/s/V, pole {pole:.6g} ± {1.96 * pole_error:.2g} rad/s, "
            f"fit {self.fit_percent:.1f} %, chi2 {self.chi2_per_sample:.3g}, {self.method})"
        )
