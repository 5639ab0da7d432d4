"""What a validation gives: scores, bands, and which segments they are of."""

import dataclasses
import math
from typing import Any, NamedTuple

import numpy as np

from jaxmotor._numbers import with_bracket
from jaxmotor._shown import Row, Shown, data_frame
from jaxmotor.estimate import Model, Trace
from jaxmotor.recording import ranges

MOST = 6
"""Results that are named one by one."""
LIMITS = 0.025, 0.975
"""Quantiles between which 95 % lie."""


def limits(draws: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Limits (along axis 0) between which one more draw lies with 95 %, however few the draws are."""
    low, high = np.quantile(draws, LIMITS, axis=0, method="weibull")
    return np.asarray(low), np.asarray(high)


class Interval(NamedTuple):
    """A value and its 95 % interval; NaN where there is none."""

    value: float
    low: float
    high: float

    @classmethod
    def of(cls, draws: np.ndarray) -> "Interval":
        """Mean and limits of the finite ones among `draws`; NaN where one in ten is not."""
        finite = draws[np.isfinite(draws)]
        if len(finite) < 0.9 * len(draws):
            return cls(float("nan"), float("nan"), float("nan"))
        low, high = limits(finite)
        return cls(float(finite.mean()), float(low), float(high))

    @classmethod
    def alone(cls, value: float) -> "Interval":
        """A value without an interval."""
        return cls(float(value), float("nan"), float("nan"))


@dataclasses.dataclass(frozen=True)
class Comparison:
    """One quantity, measured on the motor and predicted by the model."""

    measured: Interval
    """With the interval that the trials themselves give; NaN limits where there is one trial only."""
    predicted: Interval
    """Mean over the simulations, and where 95 of 100 of them lie."""

    @classmethod
    def of(cls, measured: float, draws: np.ndarray) -> "Comparison":
        """Of one measured value and simulated ones; the limits belong to the interval, to rounding."""
        predicted = Interval.of(draws)
        slack = 1e-9 * abs(predicted.value)
        widened = Interval(predicted.value, predicted.low - slack, predicted.high + slack)
        return cls(Interval.alone(measured), widened)

    @property
    def inside(self) -> bool | None:
        """The measured value lies in the predicted interval; None where either is not known."""
        known = np.isfinite([self.measured.value, self.predicted.low, self.predicted.high]).all()
        return bool(self.predicted.low <= self.measured.value <= self.predicted.high) if known else None


@dataclasses.dataclass(frozen=True)
class Score:
    """How well a free simulation follows the measured speed."""

    samples: int
    fit_percent: float
    """100 (1 - |y - ŷ|/|y - mean y|); NaN where the speed never changed."""
    rmse_rad_s: float
    rmse_counts: float
    """Of the counts turned in a tick; NaN where no counts were logged."""
    chi2_per_sample: float
    """Mean squared residual over that of the encoder alone; 1 is the floor."""


@dataclasses.dataclass(frozen=True, eq=False)
class OpenLoop:
    """Free simulation under the voltage that was logged."""

    pooled: Score
    segments: dict[int, Score]
    """By index in the recording."""
    initial_speed_estimated: tuple[int, ...]
    """Segments whose initial speed was fitted, because they began in motion or lost ticks."""
    floor_known: bool
    """The floor of chi2 follows from the encoder; otherwise it was estimated from the data."""
    traces: tuple[Trace, ...]
    """What was measured and simulated, for figures."""


@dataclasses.dataclass(frozen=True)
class Band:
    """A curve and its 95 % band, one value per row of the figure."""

    mean: np.ndarray
    low: np.ndarray
    high: np.ndarray

    @classmethod
    def of(cls, runs: np.ndarray) -> "Band":
        """Of `runs` (run, n)."""
        return cls(runs.mean(axis=0), *limits(runs))


@dataclasses.dataclass(frozen=True, eq=False)
class StepTrials:
    """Trials of one step, their mean against the model (the paper's Fig. 10)."""

    segments: tuple[int, ...]
    amplitude_V: float
    """The voltage of the step's plateau [V]."""
    time_s: np.ndarray
    """(n,) since the segment's first tick [s]; of a mean speed over a tick, the tick's begin."""
    measured: Band
    """Mean over the trials [rad/s], and Student's t times its standard error, at least the encoder's own."""
    predicted: Band
    """The model's speed without an encoder [rad/s], and where the mean over as many trials lies, encoder included."""
    inside_percent: float
    """Share of rows where the model's speed lies in the measured band [%]."""
    rise_time_s: Comparison
    """From 10 to 90 % of the change of speed."""
    final_speed_rad_s: Comparison
    """Mean over the last quarter of the plateau."""

    @property
    def trials(self) -> int:
        """Number of segments that were averaged."""
        return len(self.segments)


@dataclasses.dataclass(frozen=True, eq=False, kw_only=True)
class LoopRun:
    """A speed controller simulated with a batch of motors, against the motor's own run."""

    segment: int
    kind: str
    """`P` or `PI`."""
    reference_rad_s: float
    time_s: np.ndarray
    """(n,) of the ticks [s]."""
    measured_speed_rad_s: np.ndarray
    """(n,) as the controller saw it at each tick: the mean over the tick before. NaN where the tick was lost."""
    speed: Band
    """Predicted [rad/s], encoder included."""
    rise_time_s: Comparison
    overshoot_percent: Comparison
    """Of the change of speed, above the steady state."""
    steady_speed_rad_s: Comparison
    """Mean over the last quarter."""
    steady_error_rad_s: Comparison
    """Reference minus steady speed."""
    rmse_rad_s: Interval
    """Of a run's speed from the measured one."""


@dataclasses.dataclass(frozen=True, eq=False, kw_only=True)
class ClosedLoop(LoopRun):
    """A closed loop of the model (the paper's Fig. 11 and 12)."""

    gain_V_s_rad: float
    integral_gain_V_rad: float
    duty_step_V: float
    """What one duty is at the winding [V]; NaN where volts were logged, which are not quantised."""
    limit_V: float
    """Where the command saturates [V]; NaN where that is not known."""
    measured_volts_V: np.ndarray
    """(n,) applied from each tick on. NaN where the tick was lost."""
    volts: Band
    """Predicted [V], duty quantisation included."""
    speed_inside_percent: float
    """Share of ticks at which the measured speed lies in the predicted band [%]."""
    volts_inside_percent: float
    controller_off_percent: float
    """Share of ticks whose voltage is more than one duty off what the header's controller makes of the counts [%]."""
    theory_error_rad_s: Interval
    """R/(1 + k G(0)), eq. 21, for P; 0 for PI; with the uncertainty of the model's gain."""
    theory_error_with_offset_rad_s: float
    """The same with the model's voltage offset u0: (R - G(0) u0)/(1 + k G(0))."""
    saturated_percent: Comparison
    """Share of ticks at the limit."""
    notes: tuple[str, ...]

    @property
    def gains(self) -> str:
        """Its controller, for people."""
        integral = f" + {self.integral_gain_V_rad:.3g} V/rad" if self.kind == "PI" else ""
        return f"{self.kind} {self.gain_V_s_rad:.3g} V s/rad{integral}"


@dataclasses.dataclass(frozen=True)
class Skipped:
    """A segment that could not be scored."""

    segment: int
    kind: str
    reason: str


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Validation(Shown):
    """A model held against segments that it was not fitted to."""

    model: Model
    recording: str
    """Name of the recording."""
    fitted: tuple[int, ...]
    """Segments that the model was fitted to. Not scored."""
    scored: tuple[int, ...]
    skipped: tuple[Skipped, ...]
    open_loop: OpenLoop | None
    steps: tuple[StepTrials, ...]
    closed_loop: tuple[ClosedLoop, ...]
    seed: int
    simulations: int
    """Draws of parameters and encoder offsets behind each band."""
    notes: tuple[str, ...]
    """Sentences that a user should read."""

    def _title(self) -> str:
        return f"Validation on {self.recording}: {len(self.scored)} held-out segments (brackets: 95 %)"

    def _rows(self) -> tuple[Row, ...]:
        if self.open_loop is None:
            return ()
        score = self.open_loop.pooled
        return Row("fit", score.fit_percent, math.nan, "%"), Row("RMSE", score.rmse_rad_s, math.nan, "rad/s")

    def to_dataframe(self) -> Any:
        """What was compared, a row for each quantity, as pandas' data frame.

        Of each step and closed loop: measured and predicted with their 95 % intervals. Of each segment in free
        simulation: fit [%] and RMSE [rad/s] as `score`.

        **Raises:** `JaxmotorError` where pandas is not installed.
        """
        names = ("segments", "quantity", "score")
        names += tuple(f"{side}{end}" for side in ("measured", "predicted") for end in ("", "_low", "_high"))
        rows = [row for one in (*self.steps, *self.closed_loop) for row in _compared_rows(one)]
        for number, score in {} if self.open_loop is None else self.open_loop.segments.items():
            rows += [
                (str(number), name, getattr(score, name), *[math.nan] * 6) for name in ("fit_percent", "rmse_rad_s")
            ]
        columns = zip(*rows, strict=True) if rows else [()] * len(names)
        return data_frame(dict(zip(names, columns, strict=True)))

    def _remarks(self) -> tuple[str, ...]:
        lines = []
        for steps in self.steps:
            lines.append(f"step to {steps.amplitude_V:.3g} V: rise time {_compared(steps.rise_time_s)} s")
        for loop in self.closed_loop:
            steady = _compared(loop.steady_speed_rad_s)
            lines.append(f"{loop.kind} loop of segment {loop.segment}: steady speed {steady} rad/s")
        more = [f"and {len(lines) - MOST} more"] if len(lines) > MOST else []
        return (*lines[:MOST], *more)


def _compared_rows(one: StepTrials | ClosedLoop) -> list[tuple[Any, ...]]:
    segments = ranges(one.segments if isinstance(one, StepTrials) else (one.segment,))
    compared = [(name, value) for name, value in vars(one).items() if isinstance(value, Comparison)]
    return [(segments, name, math.nan, *value.measured, *value.predicted) for name, value in compared]


def _compared(one: Comparison) -> str:
    return f"measured {with_bracket(one.measured)}, predicted {with_bracket(one.predicted)}"
