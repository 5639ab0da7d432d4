"""Plots as inline SVG, small enough to send and plain enough to style: colours, light and dark, are the page's.

A curve is one path; thousands of dots are one path, too. Beside the drawing goes what its hover values are made of.
"""

import dataclasses
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from jaxmotor.present.report._html import Html, data_block, element
from jaxmotor.present.report._scale import Scale, tick_text

WIDTH, LEFT, RIGHT, TOP, BOTTOM, BETWEEN = 720.0, 66.0, 10.0, 8.0, 40.0, 14.0
DOT = "h.01"
"""A stroke that only its ends show: in print one of no length has no square ends."""


@dataclasses.dataclass(frozen=True)
class Place:
    """The rectangle of a panel in its drawing."""

    left: float
    top: float
    width: float
    height: float

    def points(self, x: Scale, y: Scale, at: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Where (`at`, `values`) stand."""
        bottom = self.top + self.height
        return x.place(at, self.left, self.left + self.width), y.place(values, bottom, self.top)


@dataclasses.dataclass(frozen=True, eq=False)
class Mark:
    """One thing drawn in a panel."""

    kind: str
    """`line`, `dots`, `band`, or `bars` from the low to the high end of each x."""
    look: str
    """Classes of the page's style."""
    x: np.ndarray
    y: np.ndarray
    """(n,); of a band or bars (2, n)."""
    name: str = ""
    """In hover values; none without it."""
    labels: Sequence[str] | None = None
    """(n,) what stands there, instead of the x."""


@dataclasses.dataclass(frozen=True, eq=False)
class Panel:
    """Marks on a pair of axes."""

    x: Scale
    y: Scale
    marks: Sequence[Mark]
    height: float = 170.0
    nearest: str = "x"
    """Hover shows all series at the nearest `x`, or with `point` the nearest of all points."""
    title: str = ""


def line(x: np.ndarray, y: np.ndarray, look: str, name: str = "") -> Mark:
    """A curve with gaps where a value is NaN."""
    return Mark("line", look, x, y, name)


def dots(x: np.ndarray, y: np.ndarray, look: str, name: str = "", labels: Sequence[str] | None = None) -> Mark:
    """A round dot at each point."""
    return Mark("dots", look, x, y, name, labels)


def band(x: np.ndarray, low: np.ndarray, high: np.ndarray, look: str = "band") -> Mark:
    """What lies between two curves."""
    return Mark("band", look, x, np.stack([low, high]))


def bars(x: np.ndarray, low: np.ndarray, high: np.ndarray, look: str) -> Mark:
    """A stroke from `low` to `high` at each `x`."""
    return Mark("bars", look, x, np.stack([low, high]))


def level(x: Scale, value: float, look: str = "zero") -> Mark:
    """A line across the panel."""
    return Mark("line", look, np.array([x.low, x.high]), np.array([value, value]))


def plot(panels: Sequence[Panel], *, alt: str, columns: int = 1, shared: bool = False) -> Html:
    """A drawing of `panels`, row by row; with `shared` only the lowest of each column has an x axis with numbers."""
    rows = [panels[k : k + columns] for k in range(0, len(panels), columns)]
    width = (WIDTH - columns * (LEFT + RIGHT)) / columns
    top, drawn, hovers = TOP, [], []
    for number, row in enumerate(rows):
        numbers = not shared or number == len(rows) - 1
        head = 16.0 if any(panel.title for panel in row) else 0.0
        for column, panel in enumerate(row):
            place = Place(LEFT + column * (width + LEFT + RIGHT), top + head, width, panel.height)
            drawn.append(_panel(panel, place, numbers))
            hovers.append(_hover(panel, place))
        top += head + max(panel.height for panel in row) + (BOTTOM if numbers else BETWEEN)
    box = f"0 0 {WIDTH:g} {top:g}"
    svg = element("svg", drawn, viewBox=box, role="img", aria_label=alt, tabindex="0", class_="plot")
    return Html(svg + data_block(hovers, class_="hover"))


def legend(entries: Iterable[tuple[str, str]]) -> Html:
    """What is what: (look, name) of lines and dots, outside the drawing, where it can wrap."""
    return element("ul", [element("li", _swatch(look), name) for look, name in entries], class_="legend")


def _swatch(look: str) -> Html:
    kind = look.partition(" ")[0]
    sample = {
        "dot": element("path", d=f"M14 6{DOT}", class_=look),
        "band": element("rect", x=2, y=2, width=24, height=8, class_=look),
        "bar": element("rect", x=2, y=2, width=24, height=8, class_=look),
    }.get(kind, element("path", d="M2 6h24", class_=look))
    return element("svg", sample, viewBox="0 0 28 12", class_="swatch", aria_hidden="true")


def bar(share: float, look: str) -> Html:
    """A bar of `share` [1] of its column's width."""
    rect = element("rect", width=f"{100 * min(max(share, 0.0), 1.0):.1f}", height=10, class_=f"bar {look}")
    return element("svg", rect, viewBox="0 0 100 10", preserveAspectRatio="none", class_="share", aria_hidden="true")


def _panel(panel: Panel, place: Place, numbers: bool) -> Html:
    parts = [*_axes(panel, place, numbers), *(_drawn(mark, panel, place) for mark in panel.marks)]
    if panel.title:
        parts.append(element("text", panel.title, x=place.left, y=place.top - 5, class_="title"))
    return element("g", parts)


def _axes(panel: Panel, place: Place, numbers: bool) -> list[Html]:
    right, bottom = place.left + place.width, place.top + place.height
    parts = []
    for k, tick in enumerate(panel.x.ticks()):
        x = panel.x.spot(tick, place.left, right)
        parts.append(element("path", d=f"M{x:.1f} {place.top:g}V{bottom:g}", class_="grid"))
        if numbers:
            number = {"x": f"{x:.1f}", "y": bottom + 16, "text_anchor": "middle", "class_": _odd(k)}
            parts.append(element("text", tick_text(tick), **number))
    # Where the panel is low, every second number is enough.
    heights = panel.y.ticks()[:: 1 if place.height >= 110 else 2]
    for k, tick in enumerate(heights):
        y = panel.y.spot(tick, bottom, place.top)
        parts.append(element("path", d=f"M{place.left:g} {y:.1f}H{right:g}", class_="grid"))
        number = {"x": place.left - 6, "y": f"{y + 4:.1f}", "text_anchor": "end"}
        number["class_"] = _odd(k) if place.height >= 110 else None
        parts.append(element("text", tick_text(tick), **number))
    parts.append(element("path", d=f"M{place.left:g} {place.top:g}V{bottom:g}H{right:g}", class_="axis"))
    middle, side = place.top + place.height / 2, place.left - LEFT + 13
    turned = f"rotate(-90 {side:g} {middle:g})"
    parts.append(
        element("text", panel.y.label, x=side, y=middle, transform=turned, text_anchor="middle", class_="label")
    )
    if numbers:
        x = place.left + place.width / 2
        parts.append(element("text", panel.x.label, x=f"{x:g}", y=bottom + 33, text_anchor="middle", class_="label"))
    return parts


def _odd(k: int) -> str | None:
    """Every second number is left out on narrow screens."""
    return "odd" if k % 2 else None


def _drawn(mark: Mark, panel: Panel, place: Place) -> Html:
    if mark.kind in ("band", "bars"):
        x, low = place.points(panel.x, panel.y, mark.x, mark.y[0])
        _, high = place.points(panel.x, panel.y, mark.x, mark.y[1])
        path = _between(x, low, high) if mark.kind == "band" else _strokes(x, low, high)
    else:
        x, y = place.points(panel.x, panel.y, mark.x, mark.y)
        path = _curve(x, y) if mark.kind == "line" else "".join(_moves(x, y, DOT))
    return element("path", d=path, class_=mark.look)


def _curve(x: np.ndarray, y: np.ndarray) -> str:
    """A path, begun anew after each point that is not finite."""
    known, parts, pen = np.isfinite(x) & np.isfinite(y), [], "M"
    for at, value, is_known in zip(x, y, known, strict=True):
        if is_known:
            parts.append(f"{pen}{at:.1f} {value:.1f}")
        pen = "L" if is_known else "M"
    return "".join(parts)


def _moves(x: np.ndarray, y: np.ndarray, stroke: str) -> list[str]:
    known = np.isfinite(x) & np.isfinite(y)
    return [f"M{at:.1f} {value:.1f}{stroke}" for at, value in zip(x[known], y[known], strict=True)]


def _between(x: np.ndarray, low: np.ndarray, high: np.ndarray) -> str:
    """An area for each stretch in which both ends are known."""
    known = np.isfinite(x) & np.isfinite(low) & np.isfinite(high)
    ends = np.flatnonzero(np.diff(np.concatenate([[False], known, [False]]).astype(int)))
    stretches = [slice(begin, end) for begin, end in ends.reshape(-1, 2)]
    return "".join(
        _curve(np.concatenate([x[one], x[one][::-1]]), np.concatenate([high[one], low[one][::-1]])) + "Z"
        for one in stretches
    )


def _strokes(x: np.ndarray, low: np.ndarray, high: np.ndarray) -> str:
    known = np.isfinite(x) & np.isfinite(low) & np.isfinite(high)
    return "".join(f"M{at:.1f} {a:.1f}V{b:.1f}" for at, a, b in zip(x[known], low[known], high[known], strict=True))


def _hover(panel: Panel, place: Place) -> dict[str, Any]:
    """What the page's script needs: places, and values as text."""
    series = []
    for mark in panel.marks:
        if not mark.name:
            continue
        x, y = place.points(panel.x, panel.y, mark.x, mark.y)
        known = np.flatnonzero(np.isfinite(x) & np.isfinite(y))
        at = mark.labels or [f"{value:.4g}" for value in mark.x]
        series.append(
            {
                "name": mark.name,
                "x": [round(float(x[k]), 1) for k in known],
                "y": [round(float(y[k]), 1) for k in known],
                "at": [at[int(k)] for k in known],
                "value": [f"{mark.y[k]:.4g}" for k in known],
            }
        )
    return {
        "box": [place.left, place.top, place.width, place.height],
        "x": panel.x.label,
        "y": panel.y.label,
        "nearest": panel.nearest,
        "series": series,
    }
