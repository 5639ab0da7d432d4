"""What was learned beyond the named effects: the residual voltage as a curve over each coordinate."""

import math
import textwrap

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from jaxmotor._errors import JaxmotorError
from jaxmotor.diagnosis import LearnedLaw
from jaxmotor.present._residual_voltage import COORDINATES
from jaxmotor.present._style import BAND, BLACK, BLUE, OnAxes, Style, legend_below, panels, plain, styled

BEST = Style(color=BLUE, linestyle="-", linewidth=1.8)
OTHER = Style(color=BLACK, linestyle="-", linewidth=0.9)
VALUES = {"V": "Residual voltage (mV)", "rad": "Error of the reading (mrad)"}
TITLE = 54
"""Characters of a bold title across a figure."""


@styled
def learned(laws: tuple[LearnedLaw, ...], *, axes: OnAxes = None) -> Figure:
    """The curves of `laws`, a panel each, with a band of two standard errors; the best law comes first and is marked.

    A panel's title is the part of the residual that its curve explains on held-out data.

    **Raises:** `JaxmotorError` where there are none.
    """
    if not laws:
        raise JaxmotorError("No curve was learned: the recording is too short for it. Record a longer one.")
    columns = min(len(laws), 2) if axes is None else len(laws)
    rows = math.ceil(len(laws) / columns)
    one_unit = len({law.unit for law in laws}) == 1
    figure, axes = panels(rows, 0.6 + 2.0 * rows, columns=columns, share_x=False, share_y=one_unit, axes=axes)
    for ax, law in zip(axes.flat, laws, strict=False):
        _curve(ax, law, TITLE // columns if law is laws[0] and law.share > 0 else 0)
    for ax in axes.flat[len(laws) :]:
        ax.set_axis_off()
    for ax, law in zip(axes.flat, laws, strict=False):
        if not one_unit or ax in axes[:, 0]:
            ax.set_ylabel(VALUES[law.unit])
    legend_below(axes, 2)
    return figure


def _curve(ax: Axes, law: LearnedLaw, width: int) -> None:
    """With a `width` [characters] as the best one, and what it is like."""
    values, error = 1e3 * law.values, 2e3 * law.standard_error
    ax.fill_between(law.at, values - error, values + error, label="± 2 standard errors", **BAND)
    ax.plot(law.at, values, label="learned", **(BEST if width else OTHER))
    ax.set_xlabel(COORDINATES[law.coordinate])
    title = f"{100 * law.share:.0f} % explained"
    if width:
        title = "\n".join([f"Best: {title}", *textwrap.wrap(plain(law.resemblance, 150), width)])
    ax.set_title(title, loc="left", fontweight="bold" if width else "normal")
