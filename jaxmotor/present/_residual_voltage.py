"""The residual voltage of the linear and the extended model, against speed, voltage, angle and time."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from jaxmotor.diagnosis import Dependence, Diagnosis, ResidualVoltage
from jaxmotor.present import _style
from jaxmotor.present._style import BLACK, BLUE, SILVER, SKY, VERMILLION, OnAxes, legend_below, panels, styled

BEFORE = (
    _style.Style(color=SILVER, linestyle="none", marker=".", markersize=2, markeredgewidth=0),
    _style.Style(color=BLACK, linestyle="-", marker="o", markersize=3.5, markerfacecolor="white"),
)
AFTER = (
    _style.Style(color=SKY, linestyle="none", marker=".", markersize=2, markeredgewidth=0),
    _style.Style(color=BLUE, linestyle="-", marker="s", markersize=2.6, linewidth=1.0),
)
"""How windows and means are drawn."""
BINS, MOST_DOTS = 24, 1_500
COORDINATES = {
    "speed": "Speed (rad/s)",
    "voltage": "Applied voltage (V)",
    "angle": "Shaft angle (rad, one turn)",
    "time": "Time in the recording (s)",
}


@styled
def residual_voltage(diagnosis: Diagnosis, *, axes: OnAxes = None) -> Figure:
    """Residual voltage against speed, voltage, shaft angle and time: a dot for each window of 60 ms (of more than 1500,
    for evenly chosen ones), means of 24 bins.

    Grey and black is that of the linear model, blue that of the extended one. The dashed lines are two standard
    deviations of what the encoder's rounding alone gives. A panel's title is the part of the variance that its
    coordinate explains, before and after; of the linear model's variance in both cases.
    """
    figure, axes = panels(2, 4.6, columns=2, share_x=False, share_y=True, axes=axes)
    for ax, (coordinate, label) in zip(axes.flat, COORDINATES.items(), strict=True):
        if not np.isfinite(diagnosis.residual_voltage.along(coordinate)).any():
            ax.set(xlabel=f"{label.partition(' (')[0]}: not known", xticks=[])
            continue
        ax.set_xlabel(label)
        _rounding(ax, diagnosis.residual_voltage.noise_V)
        extended = bool(diagnosis.named)
        _view(ax, diagnosis.residual_voltage, coordinate, BEFORE, "linear model")
        if extended:
            _view(ax, diagnosis.unexplained_voltage, coordinate, AFTER, "extended model")
        ax.set_title(_title(diagnosis, coordinate), loc="left")
    for ax in axes.flat:
        _span(ax, diagnosis)
    for ax in axes[:, 0]:
        ax.set_ylabel("Residual voltage (mV)")
    legend_below(axes, 3)
    return figure


def bin_means(at: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Means of `at` and of `values` in bins that hold about equally many windows."""
    edges = np.unique(np.quantile(at, np.linspace(0, 1, BINS + 1)))
    inside = np.clip(np.searchsorted(edges, at, side="right") - 1, 0, max(len(edges) - 2, 0))
    means = np.array([(at[inside == k].mean(), values[inside == k].mean()) for k in np.unique(inside)])
    return means[:, 0], means[:, 1]


def explained_percent(dependences: tuple[Dependence, ...], coordinate: str) -> float:
    """Of the variance, by what depends on it most; 0 where it is no more than chance."""
    shares = [one.share for one in dependences if one.coordinate == coordinate and one.beyond_chance]
    return 100 * max(shares, default=0.0)


def _rounding(ax: Axes, noise_V: float) -> None:
    if np.isfinite(noise_V):
        for sign in (-2, 2):
            name = "rounding, ± 2 sd" if sign > 0 else None
            line = (0, (4, 2))
            ax.axhline(sign * 1e3 * noise_V, color=VERMILLION, linestyle=line, linewidth=0.9, label=name, zorder=3)


def _span(ax: Axes, diagnosis: Diagnosis) -> None:
    """Without the few windows far out that would press all others flat."""
    size = 1e3 * np.abs(np.concatenate([diagnosis.residual_voltage.volts, diagnosis.unexplained_voltage.volts]))
    if size.any():
        most = max(
            size[size <= 1.3 * np.quantile(size, 0.995)].max(),
            np.nan_to_num(2.2e3 * diagnosis.residual_voltage.noise_V),
        )
        ax.set_ylim(-1.05 * most, 1.05 * most)


def _view(
    ax: Axes, volts: ResidualVoltage, coordinate: str, styles: tuple[_style.Style, _style.Style], name: str
) -> None:
    at = volts.along(coordinate)
    known = np.isfinite(at)
    if not known.any():
        return
    at, missing_mV = at[known], 1e3 * volts.volts[known]
    every = slice(None, None, 1 + len(at) // MOST_DOTS)
    ax.plot(at[every], missing_mV[every], zorder=2, **styles[0])
    ax.plot(*bin_means(at, missing_mV), label=name, zorder=4, **styles[1])


def _title(diagnosis: Diagnosis, coordinate: str) -> str:
    before = explained_percent(diagnosis.dependences, coordinate)
    if not diagnosis.named:
        return f"{before:.0f} % explained" if before else "no more than chance"
    ratio = (diagnosis.unexplained_voltage.rms_V / max(diagnosis.residual_voltage.rms_V, 1e-300)) ** 2
    after = ratio * explained_percent(diagnosis.unexplained_dependences, coordinate)
    return f"explains {before:.0f} % before, {after:.0f} % after" if before else "no more than chance"
