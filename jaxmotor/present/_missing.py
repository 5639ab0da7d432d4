"""The voltage that the linear model lacks, against everything it may depend on."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from jaxmotor.diagnosis import Diagnosis, MissingVolts
from jaxmotor.present._style import BLACK, BLUE, GREY, Look, panels, styled

POINTS = Look(color=GREY, linestyle="none", marker=".", markersize=2, markeredgewidth=0)
MEANS = Look(color=BLACK, linestyle="-", marker="o", markersize=3.5, markerfacecolor="white")
BINS = 24


@styled
def missing(diagnosis: Diagnosis) -> Figure:
    """Missing volts against speed, voltage, shaft angle and time: a dot for each window, and means of 24 bins.

    The dashed lines are two standard deviations of what the encoder's rounding alone gives. A panel's title is the
    part of the variance that its coordinate explains.
    """
    volts = diagnosis.missing
    turns = np.mod(volts.angle_rad, 2 * np.pi)
    views = [
        ("speed", volts.speed_rad_s, "Speed (rad/s)"),
        ("voltage", volts.input_V, "Applied voltage (V)"),
        ("angle", turns, "Shaft angle (rad, one turn)"),
        ("time", volts.time_s, "Time in the recording (s)"),
    ]
    figure, axes = panels(2, 4.6, columns=2, share_x=False, share_y=True)
    for ax, (coordinate, at, label) in zip(axes.flat, views, strict=True):
        _view(ax, volts, at, label)
        ax.set_title(_title(diagnosis, coordinate), loc="left")
    for ax in axes[:, 0]:
        ax.set_ylabel("Missing voltage (mV)")
    handles, labels = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower left", ncols=3)
    return figure


def _view(ax: Axes, volts: MissingVolts, at: np.ndarray, label: str) -> None:
    known = np.isfinite(at)
    ax.set_xlabel(label if known.all() else f"{label}: not known")
    if np.isfinite(volts.noise_V):
        for sign in (-2, 2):
            name = "± 2 sd of the encoder's rounding" if sign > 0 else None
            ax.axhline(sign * 1e3 * volts.noise_V, color=BLUE, linestyle=(0, (4, 2)), linewidth=0.9, label=name)
    if not known.any():
        return
    at, missing_mV = at[known], 1e3 * volts.volts[known]
    ax.plot(at, missing_mV, label="a window of 60 ms", **POINTS)
    edges = np.unique(np.quantile(at, np.linspace(0, 1, BINS + 1)))
    inside = np.clip(np.searchsorted(edges, at, side="right") - 1, 0, max(len(edges) - 2, 0))
    used = np.unique(inside)
    means = [(at[inside == k].mean(), missing_mV[inside == k].mean()) for k in used]
    ax.plot(*np.array(means).T, label="mean", **MEANS)


def _title(diagnosis: Diagnosis, coordinate: str) -> str:
    shares = [look.share for look in diagnosis.looks if look.coordinate == coordinate and look.beyond_chance]
    return f"{100 * max(shares):.0f} % explained" if shares else "no more than chance"
