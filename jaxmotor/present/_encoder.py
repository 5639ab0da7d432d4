"""What an encoder can tell: the paper's Table 1 as a figure."""

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from jaxmotor.bench import SpeedResolution, speed_resolution
from jaxmotor.present._style import (
    BLACK,
    BLUE,
    EXACT,
    GREEN,
    GREY,
    VERMILLION,
    OnAxes,
    heading,
    legend_above,
    panels,
    plain_numbers,
    styled,
)

STYLES = [(BLACK, "-"), (BLUE, (0, (6, 1.5))), (VERMILLION, (0, (4, 1.3, 1, 1.3))), (GREEN, (0, (2, 1.2)))]


@styled
def encoder(
    counts_per_rev: float | int,
    rows: Sequence[SpeedResolution],
    speeds_rad_s: Sequence[float] = (),
    *,
    axes: OnAxes = None,
) -> Figure:
    """Speed error of one count against the sampling period (eq. 2), and relative to the speed (eq. 3).

    `rows` are marked in the first panel, and up to four of them drawn in the second; `speeds_rad_s` are marked there.
    """
    figure, axes = panels(1, 2.6, columns=2, share_x=False, axes=axes)
    _against_period(axes[0, 0], counts_per_rev, rows)
    _against_speed(axes[0, 1], rows, speeds_rad_s)
    ticks = "one tick" if rows[0].ticks == 1 else f"{rows[0].ticks} ticks"
    heading(axes, f"{counts_per_rev:g} counts per turn, speed from the counts of {ticks}")
    return figure


def _against_period(ax, counts_per_rev: float | int, rows: Sequence[SpeedResolution]) -> None:
    periods = np.array([row.period_s for row in rows])
    span = np.geomspace(periods.min() / 1.5, periods.max() * 1.5, 60)
    curve = [speed_resolution(counts_per_rev, float(period), rows[0].ticks) for period in span]
    ax.plot(1e3 * span, [row.resolution_rpm for row in curve], label="one count", **EXACT)
    deviation = [row.standard_deviation_rad_s * 30 / np.pi for row in curve]
    ax.plot(1e3 * span, deviation, color=GREY, linestyle=(0, (5, 1.6)), label="standard deviation")
    values = [row.resolution_rpm for row in rows]
    ax.plot(1e3 * periods, values, linestyle="none", marker="o", color=BLUE, markerfacecolor="white")
    for period, value in zip(periods, values, strict=True):
        ax.annotate(f"{value:.3g}", (1e3 * period, value), xytext=(3, 3), textcoords="offset points", fontsize=7)
    ax.set(xscale="log", yscale="log", xlabel="Sampling period (ms)", ylabel="Speed error (rpm)")
    legend_above(ax, columns=1)
    plain_numbers(ax.xaxis, ax.yaxis)


def _against_speed(ax, rows: Sequence[SpeedResolution], speeds_rad_s: Sequence[float]) -> None:
    chosen = [rows[index] for index in sorted(set(np.linspace(0, len(rows) - 1, 4).round().astype(int).tolist()))]
    marked = np.abs(np.array([*speeds_rad_s], dtype=float)) * 30 / np.pi
    speeds = np.geomspace(min([10.0, *marked / 1.5]), max([1000.0, *marked * 1.5]), 60)
    for row, (color, dashes) in zip(chosen, STYLES, strict=False):
        error = 100 * row.resolution_rpm / speeds
        ax.plot(speeds, error, color=color, linestyle=dashes)
        end = (speeds[-1], error[-1])
        ax.annotate(
            f"{1e3 * row.period_s:g} ms", end, xytext=(3, 0), textcoords="offset points", va="center", fontsize=7
        )
        ax.plot(marked, 100 * row.resolution_rpm / marked, linestyle="none", marker="o", color=color, markersize=3)
    ax.set(xscale="log", yscale="log", xlabel="Speed (rpm)", ylabel="Error of one count (%)")
    ax.margins(x=0.08)
    plain_numbers(ax.xaxis, ax.yaxis)
