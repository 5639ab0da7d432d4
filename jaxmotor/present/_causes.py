"""What was named, held against what else it could have been, on data that were not fitted."""

import numpy as np
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from jaxmotor.diagnosis import Diagnosis
from jaxmotor.present._style import BLACK, OnAxes, heading, panels, styled

LINEAR, NAMED, RIVAL = (
    {"facecolor": "#BDBDBD", "edgecolor": "#6E6E6E"},
    {"facecolor": "#0072B2", "edgecolor": "#0072B2"},
    {"facecolor": "white", "edgecolor": "#D55E00", "hatch": "////"},
)


@styled
def causes(diagnosis: Diagnosis, *, axes: OnAxes = None) -> Figure:
    """Drift chi2 per sample on held-out segments, of the linear motor, of the extended one, and with a rival in an
    effect's place: bars from the floor, 1, on a logarithmic axis. A star is a rival that cannot be told apart."""
    rows = _rows(diagnosis)
    figure, axes = panels(1, 1.0 + (0.33 if len(diagnosis.effects) > 1 else 0.24) * len(rows), axes=axes)
    layout = figure.get_layout_engine()
    assert isinstance(layout, ConstrainedLayoutEngine)
    layout.set(w_pad=0.12)  # names are wider in print than at the resolution of the layout
    ax = axes[0, 0]
    values = np.array([value for _, value, _ in rows])
    for place, (_, value, look) in enumerate(rows):
        ax.barh(place, value - 1, left=1.0, height=0.62, linewidth=0.7, **look)
        ax.plot(value, place, marker="d", markersize=4, color=look["edgecolor"], zorder=5)
        text = f"{value:.3g}" if value < 1000 else f"{value:.0f}"
        ax.annotate(text, (max(value, 1.0), place), (5, 0), textcoords="offset points", va="center", fontsize=7)
    ax.axvline(1.0, color=BLACK, linewidth=0.9)
    ax.set_xscale("log")
    ax.set_xlim(0.9 * min(values.min(), 1.0), 2.0 * max(values.max(), 1.5))
    few = values.max() < 50
    ax.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if few else (1.0,)))
    ax.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    ax.xaxis.set_minor_formatter(NullFormatter())
    ax.set_yticks(range(len(rows)), [name for name, _, _ in rows], fontsize=7, linespacing=1.05)
    ax.invert_yaxis()
    ax.grid(False, axis="y")
    ax.set_xlabel("Drift, held out (chi2 per sample)")
    floor = "the encoder's rounding" if diagnosis.fit.floor_known else "the noise"
    same = "; * not told apart" if any("*" in name for name, _, _ in rows) else ""
    heading(axes, f"1 = {floor} alone{same}")
    return figure


def _rows(diagnosis: Diagnosis) -> list[tuple[str, float, dict[str, str]]]:
    """Name, value and look of each bar, from above."""
    worth = diagnosis.held_out
    rows = [("linear model", worth.drift_before, LINEAR)]
    if diagnosis.effects:
        rows.append(("\n+ ".join(found.name for found in diagnosis.effects), worth.drift_after, NAMED))
    several = len(diagnosis.effects) > 1
    for found in diagnosis.effects:
        for rival in found.rivals:
            star = " *" if rival.inseparable else ""
            name = f"{rival.name}{star}\nfor {found.name}" if several else f"{rival.name}{star}"
            rows.append((name, worth.drift_after + rival.chi2_excess, RIVAL))
    return rows
