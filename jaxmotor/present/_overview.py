"""A whole recording: what was applied, and how the motor turned."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from jaxmotor.present._style import BAND, BLUE, OnAxes, legend_above, panels, styled
from jaxmotor.recording import Recording, mean_speeds

BINS = 700
"""As many as a screen can show."""


@styled
def overview(recording: Recording, *, axes: OnAxes = None) -> Figure:
    """Voltage and speed over a recording: mean, least and largest value of each of at most 700 stretches of time.

    A stretch has two rows or more, where none were lost.
    """
    end = max(float(segment.start_s + segment.time_s[-1]) for segment in recording.segments) or 1.0
    steps = np.concatenate([np.diff(segment.time_s) for segment in recording.segments])
    bins = int(np.clip(end / (2 * np.median(steps)), 1, BINS)) if len(steps) else 1
    edges = np.linspace(0.0, end, bins + 1)
    parts = [
        (segment.start_s + segment.time_s[:-1], segment.volts[:-1], mean_speeds(recording, segment))
        for segment in recording.segments
        if len(segment) > 1
    ]
    time, volts, speed = (np.concatenate(column) for column in zip(*parts, strict=True)) if parts else np.zeros((3, 0))
    figure, axes = panels(2, 2.9, axes=axes)
    for ax, values, label in zip(axes[:, 0], (volts, speed), ("Voltage (V)", "Speed (rad/s)"), strict=True):
        _envelope(ax, time, values, edges)
        ax.set_ylabel(label)
    axes[-1, 0].set_xlabel("Time in the recording (s)")
    legend_above(axes[0, 0])
    return figure


def _envelope(ax: Axes, time: np.ndarray, values: np.ndarray, edges: np.ndarray) -> None:
    """Least, largest and mean of `values` in each bin; a gap where there are none."""
    size = len(edges) - 1
    bins = np.clip(np.searchsorted(edges, time, side="right") - 1, 0, size - 1)
    low, high, mean = np.full(size, np.inf), np.full(size, -np.inf), np.full(size, np.nan)
    np.minimum.at(low, bins, values)
    np.maximum.at(high, bins, values)
    number = np.bincount(bins, minlength=size)
    some = number > 0
    mean[some] = np.bincount(bins, values, size)[some] / number[some]
    at = (edges[1:] + edges[:-1]) / 2
    ax.fill_between(at, low, high, where=some.tolist(), label="from the least to the largest", **BAND)
    ax.plot(at, mean, color=BLUE, linewidth=1.0, label=f"mean of {edges[1]:.2g} s")
    ax.margins(x=0.01)
