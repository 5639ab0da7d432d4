"""Autocorrelation of a residual: whether what a model leaves is white."""

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.figure import Figure

from jaxmotor.estimate import Trace
from jaxmotor.present._style import BAND, EXACT, GREY, PAPER, OnAxes, Style, legend_above, panels, styled

LAGS = 25
STYLES = (PAPER | Style(marker="s", markersize=3), EXACT | Style(marker="o", markersize=3))


@styled
def autocorrelation(residuals: Mapping[str, Sequence[Trace]], *, axes: OnAxes = None) -> Figure:
    """Autocorrelation of the residual (measured minus simulated) of each model in free simulation, at lags of up to 25
    rows, and the band that holds 95 % of those of white noise. At most two models, by name, of the same rows."""
    figure, axes = panels(1, 2.2, axes=axes)
    ax, lags = axes[0, 0], np.arange(LAGS + 1)
    number = sum(len(trace.time_s) for trace in next(iter(residuals.values())))
    half = 1.96 / np.sqrt(max(number, 1))
    ax.fill_between([0.0, LAGS], -half, half, label="95 % of white noise", **BAND)
    for (name, traces), style in zip(residuals.items(), STYLES[-len(residuals) :], strict=True):
        ax.plot(lags, autocorrelations(traces), label=name, **(style | {"linewidth": 0.8}))
    ax.axhline(0, color=GREY, linewidth=0.6)
    ax.set(xlabel="Lag (rows)", ylabel="Autocorrelation", xlim=(-0.4, LAGS + 0.4))
    legend_above(ax, columns=3)
    return figure


def autocorrelations(traces: Sequence[Trace]) -> np.ndarray:
    """(26,) of the residuals of `traces` together, of lag 0, which is 1, and more; products across segments are left
    out (Box, Jenkins and Reinsel, Time Series Analysis, sec. 2.1.6)."""
    total = np.zeros(LAGS + 1)
    residuals = [trace.residual_rad_s for trace in traces]
    mean = np.concatenate(residuals).mean() if residuals else 0.0
    for residual in residuals:
        for lag in range(min(LAGS + 1, len(residual))):
            total[lag] += np.dot(residual[lag:] - mean, residual[: len(residual) - lag] - mean)
    return total / total[0] if total[0] > 0 else total
