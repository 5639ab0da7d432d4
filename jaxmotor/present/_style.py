"""How all figures look: 12 cm wide, readable without colour. Nothing outside a figure is changed.

Each curve has its own line style or marker besides its colour, and colours are ones that the colour-blind can tell
apart (Okabe and Ito). Uncertainty is a light fill or a hatched one.
"""

import functools
import textwrap
from collections.abc import Callable, Sequence
from typing import Any, ParamSpec

import matplotlib.style
import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.backend_bases import FigureCanvasBase
from matplotlib.backends.backend_agg import RendererAgg
from matplotlib.figure import Figure
from matplotlib.font_manager import findfont, get_font
from matplotlib.ticker import FixedLocator, FuncFormatter, LogLocator, NullFormatter

from jaxmotor._errors import JaxmotorError
from jaxmotor._kinds import of_kinds

P = ParamSpec("P")

WIDTH_IN = 12 / 2.54
LINE = 76
"""Characters across a figure."""
BLACK, BLUE, VERMILLION, GREEN = "#000000", "#0072B2", "#D55E00", "#009E73"
PURPLE, GREY = "#AA4499", "#8A8A8A"
SILVER, SKY, FAINT = "#B0B0B0", "#7FB8D9", "#E4E4E4"
"""Of many small dots, and of what lies behind the data."""

STYLE: dict[str, Any] = {
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans"],
    "font.size": 8,
    "axes.labelsize": 8,
    "axes.titlesize": 8,
    "xtick.labelsize": 7.5,
    "ytick.labelsize": 7.5,
    "legend.fontsize": 7.5,
    "legend.frameon": False,
    "legend.handlelength": 2.4,
    "legend.borderaxespad": 0.3,
    "legend.columnspacing": 1.2,
    "axes.linewidth": 0.6,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.unicode_minus": True,
    "axes.formatter.useoffset": False,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "xtick.minor.width": 0.4,
    "ytick.minor.width": 0.4,
    "lines.linewidth": 1.2,
    "lines.markersize": 4,
    "hatch.linewidth": 0.4,
    "figure.dpi": 100,
    "savefig.facecolor": "white",
    "svg.hashsalt": "jaxmotor",
    "svg.fonttype": "path",
    "text.usetex": False,
    "text.parse_math": True,
}


Style = dict[str, Any]
"""Of a line, as matplotlib's keywords."""

MEASURED = Style(color=BLACK, linestyle="none", marker="o", markersize=4, markerfacecolor="white")
SMALL_DOTS = MEASURED | Style(markersize=2, markeredgewidth=0, markerfacecolor=GREY, color=GREY)
EXACT = Style(color=BLUE, linestyle="-")
PAPER = Style(color=VERMILLION, linestyle=(0, (5, 1.6)))
OTHER = Style(color=GREEN, linestyle=(0, (5, 1.4, 1, 1.4)))
SECOND = Style(color=PURPLE, linestyle=(0, (5, 1.2, 1, 1.2, 1, 1.2)))
REFERENCE = Style(color=BLACK, linestyle=(0, (1, 1.6)), linewidth=0.9)

BAND: Style = {"facecolor": "#D4D4D4", "edgecolor": "none", "linewidth": 0, "zorder": 0.5}
HATCHED: Style = {"facecolor": "none", "edgecolor": BLUE, "hatch": "//////", "linewidth": 0.5, "zorder": 0.6}


OnAxes = Axes | Sequence[Axes] | np.ndarray | None
"""Where a figure's panels are drawn, row by row; None: in a figure of their own."""


class Ruler(FigureCanvasBase):
    """Measures texts for the layout: one for all figures, as they have many texts in common."""

    def get_renderer(self) -> RendererAgg:
        return _measuring(self.figure.dpi)


class OwnFigure(Figure):
    """A figure that only we draw on."""

    def __init__(self, **about: Any):
        super().__init__(**about)
        Ruler(self)


@functools.lru_cache(2)
def _measuring(dpi: float) -> RendererAgg:
    return RendererAgg(1, 1, dpi)


def styled(function: Callable[P, Figure]) -> Callable[P, Figure]:
    """Run `function` with `STYLE` over matplotlib's own defaults; the program's settings are as before after it.

    **Raises:** `JaxmotorError` for arguments that are not of the kinds that it states.
    """

    checked = of_kinds(function)

    @functools.wraps(function)
    def wrapped(*args: P.args, **kwargs: P.kwargs) -> Figure:
        with matplotlib.style.context(STYLE, after_reset=True):
            figure = checked(*args, **kwargs)
            if isinstance(figure, OwnFigure):
                _settle(figure)
            return figure

    return wrapped


def _settle(figure: Figure) -> None:
    """Find the places of the axes and make the ticks now, not when the figure is drawn under others' settings.

    Ticks depend on the size of their axes, whose size depends on the width of the ticks' labels: this can go to and
    fro for ever. So ticks are kept as the first round has them; where they are not those that it made room for, a
    second one makes room for just these.
    """
    layout = figure.get_layout_engine()
    assert layout is not None
    layout.execute(figure)
    if _keep_ticks(figure):
        layout.execute(figure)
    figure.set_layout_engine("none")


def _keep_ticks(figure: Figure) -> bool:
    """Fix the ticks of `figure` where they are; True where they were elsewhere when their labels were measured."""
    moved = False
    for axis in (axis for ax in figure.axes for axis in (ax.xaxis, ax.yaxis)):
        places = axis.get_majorticklocs().tolist()
        moved |= [tick.get_loc() for tick in axis.majorTicks[: len(places)]] != places
        axis.set_major_locator(FixedLocator(places))
    return moved


def panels(
    rows: int,
    height_in: float,
    *,
    columns: int = 1,
    heights: Sequence[float | int] | None = None,
    share_x: bool = True,
    share_y: bool = False,
    axes: OnAxes = None,
) -> tuple[Figure, np.ndarray]:
    """An empty figure of the house width, and its axes (`rows`, `columns`); or the figure of these `axes`, and they.

    **Raises:** `JaxmotorError` where they are not as many.
    """
    if axes is not None:
        given = np.asarray(axes, dtype=object).reshape(-1)
        if len(given) != rows * columns or not all(isinstance(ax, Axes) for ax in given):
            raise JaxmotorError(f"this figure has {rows * columns} panels; give as many of matplotlib's Axes")
        return given[0].figure, given.reshape(rows, columns)
    figure = OwnFigure(figsize=(WIDTH_IN, height_in), layout="constrained")
    axes = figure.subplots(rows, columns, squeeze=False, sharex=share_x, sharey=share_y, height_ratios=heights)
    for ax in axes.flat:
        grid(ax)
    return figure, axes


def heading(axes: np.ndarray, text: str) -> None:
    """`text` above all panels; above the first where the figure is somebody else's and that has no title."""
    text = textwrap.fill(text, LINE, break_long_words=False, break_on_hyphens=False)
    if isinstance(axes.flat[0].figure, OwnFigure):
        axes.flat[0].figure.suptitle(text, fontsize=8, x=0.02, ha="left")
    elif not axes.flat[0].get_title(loc="left"):
        axes.flat[0].set_title(text, loc="left")


def legend_below(axes: np.ndarray, columns: int) -> None:
    """The first panel's legend below all panels; in that panel where the figure is somebody else's."""
    handles, labels = axes.flat[0].get_legend_handles_labels()
    if isinstance(axes.flat[0].figure, OwnFigure):
        axes.flat[0].figure.legend(handles, labels, loc="outside lower left", ncols=columns)
    else:
        axes.flat[0].legend()


def grid(ax: Axes) -> None:
    """Faint lines to read values by."""
    ax.grid(True, color=FAINT, linewidth=0.5)
    ax.set_axisbelow(True)


def legend_above(ax: Axes, columns: int = 2) -> None:
    """The legend of `ax` above it, where it covers no data."""
    ax.legend(loc="lower left", bbox_to_anchor=(0, 1.0), ncols=columns)


def plain_numbers(*axes: Axis) -> None:
    """Numbers without powers of ten at the large ticks of `axes`, none at the small ones."""
    for axis in axes:
        axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        axis.set_minor_formatter(NullFormatter())


def frequency_axis(ax: Axes) -> None:
    """Logarithmic in Hz, with plain numbers at 1, 2 and 5."""
    ax.set_xscale("log")
    ax.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    ax.xaxis.set_minor_locator(LogLocator(subs=(3.0, 4.0, 6.0, 7.0, 8.0, 9.0)))
    plain_numbers(ax.xaxis)


def plain(text: object, length: int = 60) -> str:
    """`text` as it stands, cut to `length` characters, where matplotlib would read mathematics between dollar signs.

    What matplotlib's own font cannot show becomes a question mark, instead of a warning and an empty box.
    """
    text = str(text)
    text = text if len(text) <= length else text[: length - 1] + "…"
    known = _glyphs()
    shown = "".join(char if ord(char) in known else " " if char.isspace() else "?" for char in text)
    return shown.replace("$", r"\$")


@functools.cache
def _glyphs() -> frozenset[int]:
    return frozenset(get_font(findfont("DejaVu Sans")).get_charmap())
