"""What every figure must be, whatever it shows."""

import itertools

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import PolyCollection
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.lines import Line2D


def labels(figure: Figure) -> list[tuple[str, str]]:
    """(x, y) label of each axes."""
    return [(ax.get_xlabel().replace("\n", " "), ax.get_ylabel().replace("\n", " ")) for ax in figure.axes]


def line(ax: Axes, label: str) -> Line2D:
    """The one line of `ax` with this label."""
    (found,) = [line for line in ax.get_lines() if line.get_label() == label]
    return found


def bands(ax: Axes) -> list[np.ndarray]:
    """(lower, upper) end of each filled band, at its abscissae in order."""
    ends = []
    for collection in ax.collections:
        if isinstance(collection, PolyCollection) and collection.get_paths():
            points = collection.get_paths()[0].vertices
            x = np.unique(points[:, 0])
            ends.append(
                np.array([(points[points[:, 0] == at, 1].min(), points[points[:, 0] == at, 1].max()) for at in x])
            )
    return ends


def check(figure: Figure) -> None:
    """Drawn without a warning, 12 cm wide, nothing outside the page, lines that differ without colour."""
    assert figure.get_figwidth() == 12 / 2.54
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    renderer = canvas.get_renderer()
    page = figure.bbox.padded(2)
    for ax in figure.axes:
        box = ax.get_tightbbox(renderer)
        assert box.x0 >= page.x0 and box.x1 <= page.x1 and box.y0 >= page.y0 and box.y1 <= page.y1, box
        assert ax.get_window_extent().height > 40
        _differ_in_grey(ax)
        _legend_covers_no_data(ax)
    columns = {round(ax.get_position().x0, 2) for ax in figure.axes}
    widest = max(ax.get_position().width for ax in figure.axes)
    assert widest * len(columns) > 0.65, "a legend has squeezed the axes"


def _differ_in_grey(ax: Axes) -> None:
    named = [line for line in ax.get_lines() if not str(line.get_label()).startswith("_")]
    for one, other in itertools.combinations(named, 2):
        same_line = one.get_linestyle() == other.get_linestyle() and _dashes(one) == _dashes(other)
        same_mark = one.get_marker() == other.get_marker()
        apart = abs(_luminance(one) - _luminance(other))
        assert not (same_line and same_mark) or apart > 0.25, (one.get_label(), other.get_label())


def _dashes(line: Line2D):
    return line._unscaled_dash_pattern


def _luminance(line: Line2D) -> float:
    return float(np.dot(to_rgb(line.get_color()), (0.2126, 0.7152, 0.0722)))


def _legend_covers_no_data(ax: Axes) -> None:
    legend = ax.get_legend()
    if legend is None:
        return
    box = legend.get_window_extent()
    for line in ax.get_lines():
        if len(line.get_xdata()) > 2:
            points = line.get_transform().transform(np.column_stack([line.get_xdata(), line.get_ydata()]))
            points = points[np.isfinite(points).all(1)]
            assert box.count_contains(points) == 0, line.get_label()
