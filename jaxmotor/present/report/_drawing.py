"""A figure in the page: its drawing, and the values that pointing at it shows and that can be saved."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.container import ErrorbarContainer
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from jaxmotor.present.report._html import Html, data_block, element
from jaxmotor.present.report._svg import DPI, Renderer

MOST = 800
"""Values of a series that are shown when pointed at."""


def drawing(
    figure: Figure, name: str, *, alt: str, nearest: str = "x", points: Mapping[str, Sequence[str]] | None = None
) -> Html:
    """`figure` as inline SVG, under a `name` that no other drawing of the page has, and what pointing at it shows.

    That is all series at the nearest `x`, or with `point` the nearest of all points; `points` has text for those of a
    series, by its label, instead of their x. `alt` is for who cannot see it.
    """
    figure.set_dpi(DPI)
    for patch in (figure.patch, *(ax.patch for ax in figure.axes)):
        patch.set_visible(False)
    width, height = figure.bbox.width, figure.bbox.height
    renderer = Renderer(width, height, name)
    figure.draw(renderer)
    box = f"0 0 {width:.0f} {height:.0f}"
    svg = element("svg", renderer.parts, viewBox=box, role="img", aria_label=alt, tabindex="0", class_="plot")
    hovers = [_hover(ax, height, nearest, points or {}) for ax in figure.axes]
    return Html(svg + data_block(hovers, class_="hover"))


def _hover(ax: Axes, height: float, nearest: str, points: Mapping[str, Sequence[str]]) -> dict[str, Any]:
    """What the page's script needs of a panel: places, and values as text."""
    box = ax.bbox
    return {
        "box": [round(value, 1) for value in (box.x0, height - box.y1, box.width, box.height)],
        "x": _plainly(next(filter(None, (one.get_xlabel() for one in ax.get_shared_x_axes().get_siblings(ax))), "")),
        "y": _plainly(next(filter(None, (one.get_ylabel() for one in ax.get_shared_y_axes().get_siblings(ax))), "")),
        "nearest": nearest,
        "series": [_series(name, line, height, points.get(name)) for name, line in _labelled(ax, points)],
    }


def _labelled(ax: Axes, points: Mapping[str, Sequence[str]]) -> list[tuple[str, Line2D]]:
    """Curves and dots with a name, those with error bars first; only those of `points` where there are any."""
    bars = [(str(one.get_label()), one.lines[0]) for one in ax.containers if isinstance(one, ErrorbarContainer)]
    found = [*bars, *((str(line.get_label()), line) for line in ax.get_lines())]
    return [
        (_plainly(name), line)
        for name, line in found
        if line is not None and not name.startswith("_") and line.get_transform() == ax.transData
        if not points or name in points
    ]


def _series(name: str, line: Line2D, height: float, points: Sequence[str] | None) -> dict[str, Any]:
    values = np.asarray(line.get_xydata(), dtype=float)
    places = line.get_transform().transform(values)
    known = np.flatnonzero(np.isfinite(places).all(axis=1)).tolist()
    known = known[:: 1 + len(known) // MOST] if points is None else known
    return {
        "name": name,
        "x": [round(float(places[k, 0]), 1) for k in known],
        "y": [round(height - float(places[k, 1]), 1) for k in known],
        "at": [points[k] if points is not None else f"{values[k, 0]:.5g}" for k in known],
        "value": [f"{values[k, 1]:.5g}" for k in known],
    }


def _plainly(text: str) -> str:
    """A label as one line, without what keeps matplotlib from reading mathematics."""
    return text.replace("\n", " ").replace(r"\$", "$")
