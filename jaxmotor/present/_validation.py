"""Predicted beside measured on data that were not fitted: open loop and closed loop (the paper's Fig. 10 and 12).

`step` and `closed_loop` take plain arrays, so that whoever predicts need not know how it is drawn; `step_trials` and
`controller` draw what `jaxmotor.validation` found.
"""

import dataclasses

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from jaxmotor._errors import JaxmotorError
from jaxmotor._kinds import of_kinds
from jaxmotor.present._style import (
    BAND,
    BLUE,
    EXACT,
    GREY,
    HATCHED,
    MEASURED,
    REFERENCE,
    OnAxes,
    Style,
    heading,
    legend_above,
    panels,
    plain,
    styled,
)
from jaxmotor.validation import Band, ClosedLoop, StepTrials

SYMBOLS = ((60, 3.0), (150, 1.8), (10**9, 1.2))
"""Size of the symbols [pt] for up to so many rows."""


@dataclasses.dataclass(frozen=True, eq=False)
class Compared:
    """One signal, measured and predicted at the same rows; all arrays have the length n >= 1 of `time_s`.

    NaN stands for what was not measured, or is not predicted.
    """

    time_s: np.ndarray
    """(n,) since the segment's first row [s]."""
    measured: np.ndarray
    """(n,) in the unit of the figure's axis: a speed [rad/s], a voltage [V]."""
    predicted: np.ndarray
    """(n,) in the same unit."""
    measured_band: tuple[np.ndarray, np.ndarray] | None = None
    """Lower and upper end (n,), for instance of the mean of the trials at 95 %."""
    predicted_band: tuple[np.ndarray, np.ndarray] | None = None
    """Lower and upper end (n,), of what the model expects to be measured."""
    held: bool = False
    """Each value holds until the next row, as a voltage does."""

    def __post_init__(self) -> None:
        bands = [*(self.measured_band or ()), *(self.predicted_band or ())]
        shapes = {np.shape(values) for values in (self.time_s, self.measured, self.predicted, *bands)}
        if len(shapes) != 1 or len(shapes.pop()) != 1 or len(self.time_s) == 0:
            raise JaxmotorError("a comparison needs arrays of one length, at least one row long")


@styled
def step(
    compared: Compared,
    *,
    title: str = "",
    measured_label: str = "measured",
    predicted_label: str = "predicted",
    band_label: str = "95 % of the mean",
    predicted_band_label: str = "95 % of the prediction",
    axes: OnAxes = None,
) -> Figure:
    """Speed after a step, the mean of the trials with its band beside the prediction, and their difference below."""
    labels = (measured_label, predicted_label, band_label, predicted_band_label)
    figure, axes = panels(2, 3.6, heights=(3, 1.5), axes=axes)
    speed, left = axes[:, 0]
    _draw(speed, compared, labels)
    speed.set_ylabel("Speed (rad/s)")
    _legend(axes, title)
    _draw_left(left, compared)
    left.set(xlabel="Time (s)", ylabel="Measured less\npredicted (rad/s)")
    return figure


@styled
def closed_loop(
    speed: Compared,
    effort: Compared,
    *,
    reference_rad_s: float | int | np.ndarray | None = None,
    limit_V: float | int | None = None,
    title: str = "",
    measured_label: str = "measured",
    predicted_label: str = "predicted",
    band_label: str = "95 % of the measured",
    predicted_band_label: str = "95 % of the prediction",
    axes: OnAxes = None,
) -> Figure:
    """Speed and control effort [V] of a closed loop, measured beside predicted.

    `reference_rad_s` is one speed or one for each row; `limit_V` is where the drive saturates.
    """
    labels = (measured_label, predicted_label, band_label, predicted_band_label)
    figure, axes = panels(2, 4.0, heights=(3, 2), axes=axes)
    upper, lower = axes[:, 0]
    _draw(upper, speed, labels)
    if reference_rad_s is not None:
        reference = np.broadcast_to(np.asarray(reference_rad_s, dtype=float), speed.time_s.shape)
        upper.plot(speed.time_s, reference, label="reference", drawstyle="steps-post", **REFERENCE)
    upper.set_ylabel("Speed (rad/s)")
    _legend(axes, title)
    _draw(lower, effort, labels)
    if limit_V is not None:
        for sign in _signs(effort):
            lower.axhline(sign * limit_V, color=GREY, linestyle=(0, (4, 2)), linewidth=0.8)
        end = (1.0, _signs(effort)[0] * limit_V)
        style = {"xycoords": ("axes fraction", "data"), "textcoords": "offset points", "ha": "right", "fontsize": 7}
        lower.annotate("the drive's limit", end, xytext=(0, 2), **style)
    lower.set(xlabel="Time (s)", ylabel="Control effort (V)")
    lower.margins(y=0.12)
    return figure


@of_kinds
def step_trials(trials: StepTrials, *, axes: OnAxes = None) -> Figure:
    """The mean of the trials of one step with its band, beside the model (Fig. 10)."""
    number = trials.trials
    several = number > 1
    measured, predicted = trials.measured, trials.predicted
    return step(
        Compared(trials.time_s, measured.mean, predicted.mean, _band(measured), _band(predicted)),
        title=f"step of {trials.amplitude_V:.3g} V, held out",
        measured_label=f"mean of {number} trials" if several else "measured, one trial",
        band_label="95 % of the mean" if several else "95 %, encoder alone",
        axes=axes,
    )


@of_kinds
def controller(loop: ClosedLoop, *, axes: OnAxes = None) -> Figure:
    """Speed and control effort of a closed loop, beside the model's (Fig. 12)."""
    gain = f"k = {loop.gain_V_s_rad:.3g} V s/rad"
    if loop.integral_gain_V_rad:
        gain += f", {loop.integral_gain_V_rad:.3g} V/rad"
    return closed_loop(
        Compared(loop.time_s, loop.measured_speed_rad_s, loop.speed.mean, None, _band(loop.speed)),
        Compared(loop.time_s, loop.measured_volts_V, loop.volts.mean, None, _band(loop.volts), held=True),
        reference_rad_s=loop.reference_rad_s,
        limit_V=loop.limit_V if np.isfinite(loop.limit_V) else None,
        title=f"{loop.kind} control, {gain}, segment {loop.segment}, held out",
        axes=axes,
    )


def _draw(ax: Axes, compared: Compared, labels: tuple[str, str, str, str]) -> None:
    measured, predicted, band, predicted_band = map(plain, labels)
    time = compared.time_s
    step = "post" if compared.held else None
    draw = "steps-post" if compared.held else "default"
    if compared.measured_band is not None:
        ax.fill_between(time, *compared.measured_band, step=step, label=band, **BAND)
    if compared.predicted_band is not None:
        ax.fill_between(time, *compared.predicted_band, step=step, label=predicted_band, **HATCHED)
    ax.plot(time, compared.predicted, drawstyle=draw, label=predicted, **{**EXACT, "linewidth": 1.8})
    # Over the prediction, and thinner: both stay visible where they agree.
    style = {**_dots(compared), "linestyle": "-", "linewidth": 0.5}
    ax.plot(time, compared.measured, drawstyle=draw, label=measured, **style)
    ax.margins(x=0.01)


def _draw_left(ax: Axes, compared: Compared) -> None:
    """Measured minus predicted, with both bands around zero as far as they are known."""
    if compared.measured_band is not None:
        low, high = (end - compared.measured for end in compared.measured_band)
        ax.fill_between(compared.time_s, low, high, **BAND)
    if compared.predicted_band is not None:
        low, high = (end - compared.predicted for end in compared.predicted_band)
        ax.fill_between(compared.time_s, low, high, **HATCHED)
    ax.axhline(0, color=BLUE, linewidth=0.8)
    ax.plot(compared.time_s, compared.measured - compared.predicted, **_dots(compared))


def _dots(compared: Compared) -> Style:
    return MEASURED | {"markersize": next(size for rows, size in SYMBOLS if len(compared.time_s) <= rows)}


def _legend(axes: np.ndarray, title: str) -> None:
    ax = axes[0, 0]
    labels = ax.get_legend_handles_labels()[1]
    legend_above(ax, columns=2 if len(labels) == 4 else 3)
    if title:
        heading(axes, plain(title, 150))


def _signs(effort: Compared) -> tuple[float, ...]:
    """Of the limits that the effort comes near."""
    largest = max(np.nanmax(effort.measured, initial=0.0), np.nanmax(effort.predicted, initial=0.0))
    smallest = min(np.nanmin(effort.measured, initial=0.0), np.nanmin(effort.predicted, initial=0.0))
    signs = [1.0] if largest >= -smallest else [-1.0]
    return tuple(signs if min(largest, -smallest) < 0.5 * max(largest, -smallest) else [1.0, -1.0])


def _band(band: Band) -> tuple[np.ndarray, np.ndarray] | None:
    return (band.low, band.high) if np.isfinite(band.low).any() and np.isfinite(band.high).any() else None
