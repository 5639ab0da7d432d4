"""One sine of a recording: its position with the drift, and its speed with the fitted sines (the paper's Fig. 6, 7)."""

from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure

from jaxmotor._errors import JaxmotorError
from jaxmotor.present._style import (
    BAND,
    BLACK,
    EXACT,
    GREY,
    MEASURED,
    PAPER,
    OnAxes,
    Style,
    heading,
    legend_above,
    panels,
    plain,
    styled,
)
from jaxmotor.recording import Recording, Segment, angle_of

PERIODS_SHOWN = 3
DOTS = Style(linestyle="none", marker="o", markersize=2.5)
SQUARES = Style(linestyle="none", marker="s", markersize=3, markerfacecolor="none", markeredgewidth=0.7)


class SineCurve(NamedTuple):
    """A sine segment, and the columns sin ωt, cos ωt, 1, t, exp(-a t) fitted to it."""

    frequency_Hz: float
    time_s: np.ndarray
    """Of the rows [s]."""
    measured: np.ndarray
    """Position since the first row [rad], or speed [rad/s]."""
    fitted: np.ndarray
    drift_rad_s: float
    """Slope of the position [rad/s]; 0 of a speed."""
    start_rad: float
    """Where the drift begins, at the segment's first row [rad]."""

    @property
    def drift(self) -> np.ndarray:
        """The straight line in the position [rad]."""
        return self.start_rad + self.drift_rad_s * self.time_s


@styled
def position_drift(
    recording: Recording, segment: int, *, pole_rad_s: float | None = None, axes: OnAxes = None
) -> Figure:
    """Position of the sine `segment` with the drift that was fitted along with it.

    With the pole of the motor [rad/s] the transient of the start is fitted, too.

    **Raises:** `JaxmotorError` where the segment is no sine, or speeds were logged.
    """
    if recording.measured == "speed":
        raise JaxmotorError(f"{recording.name}: logs speeds, so there is no position to show the drift of")
    curve = sine_curve(recording, segment, pole_rad_s)
    figure, axes = panels(1, 2.5, axes=axes)
    ax = axes[0, 0]
    ax.plot(curve.time_s, np.rad2deg(curve.measured), color=BLACK, linewidth=0.6, label="position")
    rate = f"drift, {np.rad2deg(curve.drift_rad_s):+.3g} degrees/s"
    ax.plot(curve.time_s, np.rad2deg(curve.drift), color=PAPER["color"], linestyle=(0, (5, 1.6)), lw=2, label=rate)
    ax.set(xlabel="Time (s)", ylabel="Position (degrees)")
    ax.margins(x=0.01)
    legend_above(ax)
    _title(axes, recording, curve)
    return figure


@styled
def sine_fit(recording: Recording, segment: int, *, pole_rad_s: float | None = None, axes: OnAxes = None) -> Figure:
    """Measured speed of the sine `segment` with two fitted sines, and their residuals.

    *Ours* is fitted to the position with offset, drift and, given the pole of the motor [rad/s], the transient; a
    count difference is drawn in the middle of its tick. *The paper's* is A sin(ωt + φ) alone, fitted to the
    difference to the previous count as if it were the speed at the tick's end (eq. 12-14).

    **Raises:** `JaxmotorError` where the segment is no sine.
    """
    curve = sine_curve(recording, segment, pole_rad_s)
    end, measured, ours = _speeds(recording, curve)
    paper = paper_sine(curve.frequency_Hz, end, measured)
    window = _window(recording)
    shown = end <= end[0] + PERIODS_SHOWN / curve.frequency_Hz
    figure, axes = panels(2, 3.7, heights=(3, 1.6), axes=axes)
    speed, left = axes[:, 0]
    middle = end - window / 2
    speed.plot(middle[shown], measured[shown], label="measured", **{**MEASURED, "markersize": 3})
    speed.plot(middle[shown], ours[shown], label="ours", **EXACT)
    speed.plot(end[shown], paper[shown], label="paper's, at the tick's end", **PAPER)
    speed.set_ylabel("Speed (rad/s)")
    legend_above(speed, columns=3)
    if recording.measured == "count" and window > 0:
        count = recording.count_rad / window
        left.axhspan(-count, count, label="± one count", **BAND)
    left.plot(middle[shown], (measured - ours)[shown], label="ours", **{**DOTS, "color": EXACT["color"]})
    left.plot(middle[shown], (measured - paper)[shown], label="paper's", **{**SQUARES, "color": PAPER["color"]})
    left.axhline(0, color=GREY, linewidth=0.6)
    left.set(xlabel="Time (s)", ylabel="Residual (rad/s)")
    legend_above(left, columns=3)
    _title(axes, recording, curve)
    return figure


def sine_curve(recording: Recording, segment: int, pole_rad_s: float | None = None) -> SineCurve:
    """Least squares of sin ωt, cos ωt, 1, t and exp(-a t) on the position, or without t on the speed."""
    run, frequency = _sine_segment(recording, segment)
    time = run.time_s[run.read]
    values = (angle_of(recording, run) if run.speed_rad_s is None else run.speed_rad_s)[run.read]
    angle = 2 * np.pi * frequency * time
    columns = [np.sin(angle), np.cos(angle), np.ones_like(time)]
    if pole_rad_s is not None:
        columns.append(np.exp(-pole_rad_s * (time - time[0])))
    if recording.measured != "speed":
        columns.append(time)
    design = np.stack(columns, axis=-1)
    if len(time) < 2 * len(columns):
        raise JaxmotorError(f"{recording.name}: segment {segment} has {len(time)} rows, too few for a sine")
    weights, *_ = np.linalg.lstsq(design, values)
    drift = float(weights[-1]) if recording.measured != "speed" else 0.0
    return SineCurve(frequency, time, values, design @ weights, drift, float(weights[2]))


def paper_sine(frequency_Hz: float, time_s: np.ndarray, speed: np.ndarray) -> np.ndarray:
    """A sin(ωt + φ) that minimises the paper's eq. 14."""
    angle = 2 * np.pi * frequency_Hz * time_s
    design = np.stack([np.sin(angle), np.cos(angle)], axis=-1)
    return design @ np.linalg.lstsq(design, speed)[0]


def _speeds(recording: Recording, curve: SineCurve) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """End of each tick without a loss [s], its measured and its fitted mean speed [rad/s]."""
    if recording.measured == "speed":
        return curve.time_s, curve.measured, curve.fitted
    duration = np.diff(curve.time_s)
    whole = duration < 1.5 * (recording.period_s or np.median(duration))
    measured, fitted = np.diff(curve.measured) / duration, np.diff(curve.fitted) / duration
    return curve.time_s[1:][whole], measured[whole], fitted[whole]


def _window(recording: Recording) -> float:
    """Over which each speed is the mean [s]."""
    if recording.measured == "speed":
        return recording.speed_window_s or 0.0
    return recording.period_s or 0.0


def _sine_segment(recording: Recording, segment: int) -> tuple[Segment, float]:
    """The segment and its frequency [Hz]."""
    number = len(recording.segments)
    if not 0 <= segment < number:
        raise JaxmotorError(f"{recording.name}: there is no segment {segment}; they are 0 to {number - 1}")
    run = recording.segments[segment]
    frequency = run.sine_Hz
    if frequency is None:
        raise JaxmotorError(
            f"{recording.name}: segment {segment} is of kind {run.kind!r}, not a sine of a stated frequency; "
            "choose another segment"
        )
    return run, frequency


def _title(axes: np.ndarray, recording: Recording, curve: SineCurve) -> None:
    motor = recording.header.get("motor")
    text = f"sine of {curve.frequency_Hz:.4g} Hz"
    heading(axes, text if motor is None else f"{plain(motor, 150)}, {text}")
