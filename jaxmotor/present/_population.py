"""The motors of a fleet, their spread, and those that do not belong."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from jaxmotor.fleet import Population
from jaxmotor.present._style import (
    BLUE,
    GREY,
    REFERENCE,
    VERMILLION,
    OnAxes,
    Style,
    legend_above,
    panels,
    plain,
    styled,
)

LABELS = {
    "gain_rad_s_V": "Gain (rad/s/V)",
    "pole_rad_s": "Pole (rad/s)",
    "coulomb_friction_V": "Coulomb friction (V)",
    "dead_zone_V": "Dead zone (V)",
}
HALF, NEARLY_ALL = 1.386, 13.816
"""Squared distances of two normal numbers within which 50 % and 99.9 % of them lie."""
MOST_NAMED = 8
"""Motors that do not belong, of which the names are written."""
MOST_BARS, MOST_DRAWN = 300, 3_000
"""Motors beyond which their error bars are left out, and beyond which only every second, third, ... is drawn; those
that do not belong are drawn in any case."""
MOTORS, OUTSIDE = "motors", "do not belong"


@styled
def population_figure(population: Population, *, axes: OnAxes = None) -> Figure:
    """Each pair of parameters with the ellipses that hold 50 % and 99.9 % of the motors, or one parameter sorted.

    The ellipses are of the motors themselves, without their estimates' errors; the bars are 95 % of these.
    """
    size = len(population.names)
    pairs = [(0, k) for k in range(1, size)] or [(0, 0)]
    figure, axes = panels(len(pairs), 2.9 * len(pairs), share_x=False, axes=axes)
    for ax, (across, up) in zip(axes[:, 0], pairs, strict=True):
        if across == up:
            _sorted(ax, population)
        else:
            _pair(ax, population, across, up)
    legend_above(axes[0, 0], 3)
    return figure


def drawn_motors(population: Population) -> dict[str, np.ndarray]:
    """Motors that are drawn, by the label of their marks."""
    outside = population.distance > population.threshold
    inside = np.flatnonzero(~outside)
    drawn = {MOTORS: inside[:: 1 + len(inside) // MOST_DRAWN], OUTSIDE: np.flatnonzero(outside)}
    return {label: rows for label, rows in drawn.items() if len(rows)}


def _pair(ax: Axes, population: Population, across: int, up: int) -> None:
    styles = {MOTORS: Style(color=BLUE, marker="o"), OUTSIDE: Style(color=VERMILLION, marker="x")}
    for label, rows in drawn_motors(population).items():
        _points(ax, population, [across, up], rows, styles[label] | {"label": label})
    for square, style in ((HALF, "-"), (NEARLY_ALL, (0, (5, 1.6)))):
        label = "50 % and 99.9 % of them" if square == HALF else None
        ax.plot(*ellipse(population, across, up, square).T, color=GREY, linestyle=style, linewidth=1.0, label=label)
    index = {motor: k for k, motor in enumerate(population.motors)}
    points = population.sizes(population.estimates)[:, [across, up]]
    for outlier in population.outliers[:MOST_NAMED]:
        place = points[index[outlier.motor]]
        ax.annotate(plain(outlier.motor, 20), place, xytext=(4, 3), textcoords="offset points", fontsize=7)
    _span(ax, np.concatenate([points, ellipse(population, across, up, NEARLY_ALL)]))
    ax.set(xlabel=LABELS[population.names[across]], ylabel=LABELS[population.names[up]])


def _points(ax: Axes, population: Population, chosen: list[int], rows: np.ndarray, style: Style) -> None:
    points = population.sizes(population.estimates[rows])
    style = style | {"linestyle": "none", "markersize": 3, "markerfacecolor": "none", "markeredgewidth": 0.7}
    if len(population.motors) > MOST_BARS:
        ax.plot(*points[:, chosen].T, **style)
        return
    errors = 1.96 * np.sqrt(np.einsum("mii->mi", population.errors[rows]))
    errors = errors * np.where(np.array(population.logarithmic), points, 1.0)
    ax.errorbar(*points[:, chosen].T, *errors[:, chosen[::-1]].T, elinewidth=0.6, **style)


def _span(ax: Axes, points: np.ndarray) -> None:
    """Bars may reach half as far again as `points` do: a long one shall not dwarf the others."""
    for ends, low, high, change in zip(
        (ax.get_xlim(), ax.get_ylim()), points.min(0), points.max(0), (ax.set_xlim, ax.set_ylim), strict=True
    ):
        if low < high:
            change(max(ends[0], 1.5 * low - 0.5 * high), min(ends[1], 1.5 * high - 0.5 * low))


def _sorted(ax: Axes, population: Population) -> None:
    points = np.sort(population.sizes(population.estimates)[:, 0])
    share = (np.arange(len(points)) + 0.5) / len(points)
    ax.plot(points, 100 * share, color=BLUE, linestyle="none", marker="o", markersize=3, label="motors")
    ax.axvline(population.sizes(population.mean)[0], **REFERENCE, label="mean")
    ax.set(xlabel=LABELS[population.names[0]], ylabel="Motors below (%)")


def ellipse(population: Population, across: int, up: int, square: float) -> np.ndarray:
    """(181, 2) points in the parameters' units, at this squared distance from the mean."""
    chosen = [across, up]
    values, vectors = np.linalg.eigh(population.covariance[np.ix_(chosen, chosen)])
    angle = np.linspace(0, 2 * np.pi, 181)
    circle = np.stack([np.cos(angle), np.sin(angle)])
    curve = np.tile(population.mean, (181, 1))
    curve[:, chosen] += (vectors * np.sqrt(square * np.maximum(values, 0.0)) @ circle).T
    return population.sizes(curve)[:, chosen]
