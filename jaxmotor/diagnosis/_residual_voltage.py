"""What the linear motor gets wrong, as the voltage that would put it right.

Let e be the measured less the simulated angle. A motor w' = a (K u - w) that simulates with a voltage v too little is
behind by e'' = a (K v - e'), so over a window of length W

    mean of v = ([e'(end) - e'(begin)]/(a W) + [e(end) - e(begin)]/W)/K

where e' is a difference of e over a few ticks. The model's mistakes so have a unit that is the same for all motors, and
a place: a time, a speed, a voltage, an angle.
"""

import dataclasses
import itertools

import numpy as np

from jaxmotor.estimate import Trace
from jaxmotor.prediction import shaft_angles
from jaxmotor.recording import Recording

WINDOW_S = 0.06
"""Over which the residual voltage is a mean."""
SHORTEST = 6
"""Ticks of a window at least."""
LONGEST = 0.5
"""Part of a window that one of uneven rows may be long."""


@dataclasses.dataclass(frozen=True, eq=False)
class ResidualVoltage:
    """One element per window, over all fitted segments."""

    volts: np.ndarray
    """Residual voltage [V]."""
    time_s: np.ndarray
    """Middle of the window since the recording began [s]."""
    speed_rad_s: np.ndarray
    """Measured mean speed."""
    input_V: np.ndarray
    """Mean applied voltage."""
    angle_rad: np.ndarray
    """Measured shaft angle in the middle of the window; all NaN where it is not known throughout."""
    segment: np.ndarray
    """Index in the recording."""
    noise_V: float
    """Standard deviation that the encoder's rounding alone gives each element [V]; NaN where that is not known."""

    @property
    def rms_V(self) -> float:
        """Root mean square about the mean [V]; NaN where there is no window."""
        return float(self.volts.std()) if len(self.volts) else float("nan")

    def along(self, coordinate: str) -> np.ndarray:
        """(n,) `speed`, `voltage`, `angle` within a turn or `time` of each window; NaN where it is not known."""
        return {
            "speed": self.speed_rad_s,
            "voltage": self.input_V,
            "angle": np.mod(self.angle_rad, 2 * np.pi),
            "time": self.time_s,
        }[coordinate]


def residual_voltage(recording: Recording, traces: tuple[Trace, ...], gain: float, pole: float) -> ResidualVoltage:
    """Residual voltage of the motor that made `traces` of `recording`, where a window lost no row. Of uneven rows it is
    computed at ticks as long as rows are on average, between which the angles are interpolated.

    `gain` [rad/s/V] and `pole` [rad/s] are those of its linear part.
    """
    angles = shaft_angles(recording) or [None] * len(recording.segments)
    tick_s = recording.period_s or _mean_row(traces)
    longest_s = 1.5 * tick_s if recording.period_s else _longest(tick_s)
    parts = [
        _windows(recording, run, angles[run.segment], tick_s, gain, pole)
        for trace in traces
        for run in _runs(trace, longest_s)
    ]
    columns = [np.concatenate(column) for column in zip(*parts, strict=True)]
    return ResidualVoltage(*columns, noise_V=_noise(recording, gain, pole))


def _mean_row(traces: tuple[Trace, ...]) -> float:
    """Length of the rows but for gaps [s]; infinite where there is none."""
    lengths = np.concatenate([np.diff(trace.time_s) for trace in traces])
    return float(lengths[lengths <= _longest(float(np.median(lengths)))].mean()) if len(lengths) else np.inf


def _longest(tick_s: float) -> float:
    """Of uneven rows within a window [s]."""
    return LONGEST * _sizes(tick_s)[0] * tick_s if np.isfinite(tick_s) else np.inf


def _runs(trace: Trace, longest_s: float) -> list[Trace]:
    """`trace` between gaps: a window in which ticks are missing has no mean."""
    cuts = [0, *(np.flatnonzero(np.diff(trace.time_s) > longest_s) + 1).tolist(), len(trace.time_s)]
    fields = trace.time_s, trace.measured_rad_s, trace.simulated_rad_s
    return [Trace(trace.segment, *(field[a:b] for field in fields)) for a, b in itertools.pairwise(cuts)]


def _windows(
    recording: Recording, run: Trace, angle: np.ndarray | None, tick_s: float, gain: float, pole: float
) -> tuple[np.ndarray, ...]:
    if not np.isfinite(tick_s):
        return tuple(np.zeros((6, 0)))
    segment, time = recording.segments[run.segment], run.time_s
    size, edge = _sizes(tick_s)
    row_ends = np.append(time, time[-1] + tick_s)
    ticks = time[0] + tick_s * np.arange(int((row_ends[-1] - time[0]) / tick_s + 0.25) + 1)
    rows = np.searchsorted(segment.time_s, time - 1e-3 * tick_s)

    def until(values: np.ndarray) -> np.ndarray:
        """Integral over time since the first row, at each tick."""
        return np.interp(ticks, row_ends, np.append(0.0, np.cumsum(values * np.diff(row_ends))))

    error, angle_turned, applied = map(until, (run.residual_rad_s, run.measured_rad_s, segment.volts[rows]))
    starts = np.arange(edge, len(ticks) - edge - size, size)
    ends, window_s = starts + size, size * tick_s
    slope = (error[edge:] - error[:-edge]) / (edge * tick_s)
    rate = (slope[ends - edge // 2] - slope[starts - edge // 2]) / (pole * window_s)
    middle = ticks[starts + size // 2]
    return (
        (rate + (error[ends] - error[starts]) / window_s) / gain,
        segment.start_s + middle,
        (angle_turned[ends] - angle_turned[starts]) / window_s,
        (applied[ends] - applied[starts]) / window_s,
        np.full(len(starts), np.nan) if angle is None else angle[rows[np.searchsorted(time, middle - 0.25 * tick_s)]],
        np.full(len(starts), run.segment),
    )


def _sizes(period: float) -> tuple[int, int]:
    """Ticks of a window, and of the difference that a slope is taken over (even)."""
    size = max(SHORTEST, round(WINDOW_S / period))
    return size, 2 * max(1, size // 4)


def _noise(recording: Recording, gain: float, pole: float) -> float:
    """From four independent rounding errors of variance 1/12 count² in the slopes, and two in the ends."""
    if recording.period_s is None or recording.measured != "count":
        return float("nan")
    size, edge = _sizes(recording.period_s)
    count = recording.count_rad / np.sqrt(12)
    length = size * recording.period_s
    slope = 2 / (edge * recording.period_s * pole * length)
    return float(count * np.hypot(slope, np.sqrt(2) / length) / abs(gain))
