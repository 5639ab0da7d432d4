"""A fleet's motors in the plane, with the ellipses that hold half and nearly all of their kind."""

import numpy as np

from jaxmotor.fleet import Population
from jaxmotor.present._population import HALF, LABELS, NEARLY_ALL, ellipse, sizes
from jaxmotor.present.report._html import Html
from jaxmotor.present.report._page import figure
from jaxmotor.present.report._plot import Mark, Panel, bars, dots, legend, line, plot
from jaxmotor.present.report._scale import Scale

MOST_DRAWN = 3_000
MOST_BARS = 300


def population_plot(population: Population) -> Html:
    """Gain against each other parameter; motors that do not belong are drawn in any case."""
    panels = [_pair(population, up) for up in range(1, len(population.names))]
    outside = len(population.outliers)
    alt = f"{len(population.motors)} motors, gain against the other parameters; {outside} do not belong."
    key = legend(
        [("dot blue", "motors, ± 95 %"), ("dot red square", "do not belong"), ("grey", "50 % and 99.9 % of the kind")]
    )
    return figure(plot(panels, alt=alt), "Each dot is a motor.", key)


def _pair(population: Population, up: int) -> Panel:
    points, chosen = sizes(population, population.estimates), [0, up]
    outside = population.distance > population.threshold
    drawn = np.flatnonzero(outside | (np.arange(len(points)) % (1 + len(points) // MOST_DRAWN) == 0))
    marks: list[Mark] = []
    values = [points[drawn][:, chosen]]
    for square in (HALF, NEARLY_ALL):
        curve = ellipse(population, 0, up, square)
        marks.append(line(curve[:, 0], curve[:, 1], "grey"))
        values.append(curve)
    if len(points) <= MOST_BARS:
        error = 1.96 * np.sqrt(population.errors[:, up, up]) * (points[:, up] if population.logarithmic[up] else 1.0)
        ends = _within(np.stack([points[:, up] - error, points[:, up] + error]), np.concatenate(values)[:, 1])
        marks.append(bars(points[:, 0], ends[0], ends[1], "grey"))
        values += [np.stack([points[:, 0], end], axis=1) for end in ends]
    for rows, look, name in (
        (drawn[~outside[drawn]], "dot blue", "motor"),
        (drawn[outside[drawn]], "dot red square", "does not belong:"),
    ):
        labels = [f"{points[k, 0]:.4g}, {population.motors[k][:60]}" for k in rows]
        marks.append(dots(points[rows, 0], points[rows, up], look, name, labels))
    across, upward = np.concatenate(values).T
    x, y = Scale.of(across, LABELS[population.names[0]]), Scale.of(upward, LABELS[population.names[up]])
    return Panel(x, y, marks, 320.0, nearest="point")


def _within(ends: np.ndarray, values: np.ndarray) -> np.ndarray:
    """`ends` of bars, none so long that it would dwarf the `values`."""
    low, high = float(np.nanmin(values)), float(np.nanmax(values))
    return np.clip(ends, low - (high - low) / 2, high + (high - low) / 2)
