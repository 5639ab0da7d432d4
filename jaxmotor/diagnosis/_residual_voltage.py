"""What the linear motor gets wrong, as the voltage that would put it right.

Let e be the measured less the simulated angle. A motor w' = a (K u - w) that simulates with a voltage v too little is
behind by e'' = a (K v - e'), so over a window of length W

    mean of v = ([e'(end) - e'(begin)]/(a W) + [e(end) - e(begin)]/W)/K

where e' is a difference of e over a few ticks. The model's mistakes so have a unit that is the same for all motors, and
a place: a time, a speed, a voltage, an angle.
"""

import dataclasses

import numpy as np

from jaxmotor.estimate import Trace
from jaxmotor.prediction import shaft_angles
from jaxmotor.recording import Recording

WINDOW_S = 0.06
"""Over which the residual voltage is a mean."""
SHORTEST = 6
"""Ticks of a window at least."""


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
    """Residual voltage of the motor that made `traces` of `recording`, where ticks are even and a window lost none.

    `gain` [rad/s/V] and `pole` [rad/s] are those of its linear part.
    """
    angles = shaft_angles(recording) or [None] * len(recording.segments)
    parts = [_windows(recording, trace, angles[trace.segment], gain, pole) for trace in traces]
    columns = [np.concatenate(column) for column in zip(*parts, strict=True)]
    return ResidualVoltage(*columns, noise_V=_noise(recording, gain, pole))


def _windows(
    recording: Recording, trace: Trace, angle: np.ndarray | None, gain: float, pole: float
) -> tuple[np.ndarray, ...]:
    period, segment = recording.period_s, recording.segments[trace.segment]
    if period is None:
        return tuple(np.zeros((6, 0)))
    size, edge = _sizes(period)
    error = np.concatenate([[0.0], np.cumsum(trace.residual_rad_s)]) * period
    row = np.rint(trace.time_s / period).astype(int)
    starts = np.arange(edge, len(error) - edge - size, size)
    # A window in which ticks are missing has no mean.
    starts = starts[[bool(np.all(np.diff(row[s - edge : s + size + edge - 1]) == 1)) for s in starts]]
    ends = starts + size
    slope = (error[edge:] - error[:-edge]) / (edge * period)
    rate = (slope[ends - edge // 2] - slope[starts - edge // 2]) / (pole * size * period)
    volts = (rate + (error[ends] - error[starts]) / (size * period)) / gain
    rows = np.searchsorted(segment.time_s, trace.time_s - 0.25 * period)
    applied = np.concatenate([[0.0], np.cumsum(segment.volts[rows])])
    speed = np.concatenate([[0.0], np.cumsum(trace.measured_rad_s)])
    return (
        volts,
        segment.start_s + trace.time_s[starts + size // 2],
        (speed[ends] - speed[starts]) / size,
        (applied[ends] - applied[starts]) / size,
        np.full(len(starts), np.nan) if angle is None else angle[rows[starts + size // 2]],
        np.full(len(starts), trace.segment),
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
