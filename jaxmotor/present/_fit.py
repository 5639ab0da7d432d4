"""How well a fit describes its recording: simulated beside measured speed, and the residual."""

import textwrap
from collections.abc import Callable

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from jaxmotor.estimate import Fit, Trace, fit_percent
from jaxmotor.present._style import (
    BAND,
    BLACK,
    BLUE,
    EXACT,
    FAINT,
    GREY,
    LINE,
    OTHER,
    PAPER,
    SMALL_DOTS,
    OnAxes,
    Style,
    heading,
    legend_above,
    legend_below,
    panels,
    plain,
    styled,
)
from jaxmotor.recording import Recording
from jaxmotor.validation import OpenLoop

MOST_PANELS = 12
ALL_ROWS, FEWEST_ROWS = 1200, 200
"""Of all panels together, and of one."""
LEADING_ROWS, STARTED = 10, 0.1
"""Rows before the one in which the shaft reaches this part of its largest speed."""
MANY_POINTS, MOST_POINTS = 3_000, 60_000
NO_EDGE = Style(markeredgewidth=0)
COLUMNS = 3


@styled
def simulation(fit: Fit | OpenLoop, recording: Recording | None = None, *, axes: OnAxes = None) -> Figure:
    """Measured speed and the motor's in free simulation, one panel for each of at most 12 segments, or of
    as many as there are `axes`.

    Each panel shows the first 200 rows, or more where panels are few (of a shaft that rests long from about where it
    begins to move); its fit % is of the whole segment. With the `recording` panels are named
    after what was applied.
    """
    chosen = spread(fit.traces, MOST_PANELS if axes is None else np.size(axes))  # pyright: ignore[reportArgumentType]
    columns = min(COLUMNS, len(chosen)) if axes is None else len(chosen)
    rows = -(-len(chosen) // columns)
    figure, axes = panels(rows, 0.75 + max(1.05 * rows, 1.6), columns=columns, share_x=False, share_y=True, axes=axes)
    for ax, trace in zip(axes.flat, chosen, strict=False):
        _simulated(ax, trace, recording, columns, max(ALL_ROWS // len(chosen), FEWEST_ROWS))
    for ax in axes.flat[len(chosen) :]:
        ax.remove()
    for column in range(columns):
        axes[(len(chosen) - 1 - column) // columns, column].set_xlabel("Time (s)")
    for ax in axes[:, 0]:
        ax.set_ylabel("Speed\n(rad/s)")
    legend_below(axes, 2)
    some = f", {len(chosen)} shown" if len(chosen) < len(fit.traces) else ""
    number = "1 segment" if len(fit.traces) == 1 else f"{len(fit.traces)} segments"
    scored = "held out" if isinstance(fit, OpenLoop) else "fitted"
    were = "was" if len(fit.traces) == 1 else "were"
    score = f"fit {fit_percent(fit.traces):.2f} % in {number} that {were} {scored}"
    heading(axes, score + some)
    return figure


@styled
def residuals(fit: Fit, recording: Recording | None = None, *, axes: OnAxes = None) -> Figure:
    """The residual of a fit against time, and as a histogram.

    With the `recording` of an encoder residuals are in counts, beside what the encoder alone would give: a difference
    of two rounded positions, whose density is a triangle from -1 to 1. Otherwise they are in rad/s.
    """
    counts = recording is not None and recording.measured == "count"
    left = [in_counts(trace, recording) if recording and counts else trace.residual_rad_s for trace in fit.traces]
    unit, per = ("counts", "count") if counts else ("rad/s", "rad/s")
    everything = np.concatenate(left)
    figure, axes = panels(1, 2.6, columns=2, share_x=False, share_y=True, axes=axes)
    over_time, histogram = axes[0]
    _over_time(over_time, fit.traces, left)
    over_time.set(xlabel="Running time of the segments (s)", ylabel=f"Residual ({unit})")
    limit = max(1.1 * float(np.abs(everything).max()), 1.25 if counts else 1e-12)
    over_time.set_ylim(-limit, limit)
    _histogram(histogram, everything, limit, counts)
    histogram.set_xlabel(f"Density (per {per})")
    floor = "the encoder's" if fit.floor_known else "the estimated noise's"
    text = f"mean square {fit.chi2_per_sample:.3g} times {floor}, {fit.method} fit"
    heading(axes, text)
    return figure


def spread(traces: tuple[Trace, ...], most: int = MOST_PANELS) -> tuple[Trace, ...]:
    """At most `most` of `traces`, evenly over them."""
    if len(traces) <= most:
        return traces
    return tuple(traces[index] for index in np.linspace(0, len(traces) - 1, most).round().astype(int))


def in_counts(trace: Trace, recording: Recording) -> np.ndarray:
    """Measured minus simulated turn of each row [counts]."""
    time = recording.segments[trace.segment].time_s
    row = np.searchsorted(time, trace.time_s - 1e-9)
    return trace.residual_rad_s * (time[row + 1] - time[row]) / recording.count_rad


def segment_name(trace: Trace, recording: Recording | None) -> str:
    """What was applied in the trace's segment, as far as that is known."""
    if recording is None:
        return f"segment {trace.segment}"
    segment = recording.segments[trace.segment]
    numbers = {
        "sine": ("frequency_Hz", "{:.3g} Hz"),
        "step": ("amplitude_V", "{:.3g} V"),
        "closed_loop": ("reference_rad_s", "{:.3g} rad/s"),
    }
    key, form = numbers.get(segment.kind, ("", ""))
    value = segment.parameters.get(key)
    name = plain(segment.kind.replace("_", " "))
    sensible = isinstance(value, int | float) and abs(value) < 1e12
    return f"{name} {form.format(value)}" if sensible else f"{name} ({trace.segment})"


def _simulated(ax: Axes, trace: Trace, recording: Recording | None, columns: int, most: int) -> None:
    rows = shown_rows(trace, most)
    time, gap = with_gaps(trace.time_s[rows])
    ax.plot(trace.time_s[rows], trace.measured_rad_s[rows], label="measured", **SMALL_DOTS)
    ax.plot(time, gap(trace.simulated_rad_s[rows]), label="simulated", **{**EXACT, "linewidth": 1.0})
    percent = fit_percent((trace,))
    score = f"{percent:.1f} %" if np.isfinite(percent) else "no score"
    title = textwrap.fill(f"{segment_name(trace, recording)}: {score}", LINE // columns, break_long_words=False)
    ax.set_title(title, loc="left", fontsize=7.5, pad=3)


def shown_rows(trace: Trace, most: int) -> slice:
    """At most so many; where more than half of these would show a shaft at rest, from about where it begins to move."""
    size = np.abs(trace.measured_rad_s)
    moves = int(np.argmax(size > STARTED * size.max(initial=0.0))) if len(size) else 0
    begin = min(moves - LEADING_ROWS, len(size) - most) if moves > most // 2 else 0
    return slice(max(begin, 0), max(begin, 0) + most)


def with_gaps(time: np.ndarray) -> tuple[np.ndarray, Callable[[np.ndarray], np.ndarray]]:
    """`time` with a NaN where ticks were lost, and what puts NaNs at the same places of a row of values."""
    step = np.diff(time)
    lost = np.flatnonzero(step > 2.5 * np.median(step)) + 1 if len(step) else np.zeros(0, int)

    def gap(values: np.ndarray) -> np.ndarray:
        return np.insert(values.astype(float), lost, np.nan)

    return gap(time), gap


def _over_time(ax: Axes, traces: tuple[Trace, ...], left: list[np.ndarray]) -> None:
    total = sum(map(len, left))
    begin, every, size = 0.0, 1 + total // MOST_POINTS, 2.5 if total < MANY_POINTS else 1.0
    for number, (trace, values) in enumerate(zip(traces, left, strict=True)):
        end = begin + float(trace.time_s[-1]) if len(trace.time_s) else begin
        if number % 2:
            ax.axvspan(begin, end, facecolor=FAINT, edgecolor="none", zorder=0)
        color = BLUE if number % 2 else BLACK
        points = begin + trace.time_s[::every], values[::every]
        # As pixels also in an SVG: a drawn symbol for each would make a file of many megabytes.
        ax.plot(*points, linestyle="none", marker=".", markersize=size, color=color, rasterized=True, **NO_EDGE)
        begin = end
    ax.axhline(0, color=GREY, linewidth=0.6)
    ax.margins(x=0.01)


def _histogram(ax: Axes, values: np.ndarray, limit: float, counts: bool) -> None:
    edges = np.linspace(-limit, limit, 61)
    density, _ = np.histogram(values, edges, density=True)
    ax.stairs(density, edges, orientation="horizontal", fill=True, label="residual", **BAND)
    ax.stairs(density, edges, orientation="horizontal", color=GREY, linewidth=0.7)
    if counts:
        ax.plot([0, 1, 0], [-1, 0, 1], label="encoder alone", **PAPER)
    else:
        deviation = float(values.std()) or 1.0
        at = np.linspace(-limit, limit, 200)
        normal = np.exp(-0.5 * (at / deviation) ** 2) / np.sqrt(2 * np.pi) / deviation
        ax.plot(normal, at, label="normal, same spread", **OTHER)
    ax.set_xlim(left=0)
    legend_above(ax, columns=1)
