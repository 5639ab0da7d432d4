"""The effects that were named, and their alternatives: chi2 of held-out data, and probabilities."""

import textwrap

import numpy as np
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from jaxmotor.diagnosis import Diagnosis
from jaxmotor.present._style import BLACK, OnAxes, heading, panels, styled
from jaxmotor.words import named, odds, percent

LINEAR, NAMED, ALTERNATIVE = (
    {"facecolor": "#BDBDBD", "edgecolor": "#6E6E6E"},
    {"facecolor": "#0072B2", "edgecolor": "#0072B2"},
    {"facecolor": "white", "edgecolor": "#D55E00", "hatch": "////"},
)


NAME_WIDTH = 34
"""Characters of a bar's name in one line."""


@styled
def causes(diagnosis: Diagnosis, *, axes: OnAxes = None) -> Figure:
    """Drift chi2 per sample on held-out segments, of the linear motor, of the extended one, and with an alternative
    in an effect's place: bars from the noise, 1, on a logarithmic axis. A star: it cannot be distinguished."""
    rows = _rows(diagnosis)
    figure, axes = _bars([name for name, _, _ in rows], axes)
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
    ax.set_xlabel("Drift chi2 per sample of held-out data")
    floor = "the encoder's rounding" if diagnosis.fit.floor_known else "the noise"
    same = "; * indistinguishable" if any("*" in name for name, _, _ in rows) else ""
    heading(axes, f"1 = {floor} alone{same}")
    return figure


@styled
def probabilities(diagnosis: Diagnosis, *, axes: OnAxes = None) -> Figure:
    """Probability of each named effect, of the alternatives that fit as well, and of none of these."""
    rows = [(name, share, k) for found in diagnosis.effects for k, (name, share) in enumerate(odds(found))]
    figure, axes = _bars([textwrap.fill(name, NAME_WIDTH) for name, _, _ in rows], axes)
    ax = axes[0, 0]
    for place, (_, share, k) in enumerate(rows):
        ax.barh(place, 100 * share, height=0.62, linewidth=0.7, **(ALTERNATIVE if k else NAMED))
        ax.annotate(percent(share), (100 * share, place), (5, 0), textcoords="offset points", va="center", fontsize=7)
        if place and not k:
            ax.axhline(place - 0.5, color=BLACK, linewidth=0.6)
    ax.set_xlim(0, 115)
    ax.set_xticks(range(0, 101, 20))
    ax.set_xlabel("Probability (%)")
    return figure


def _bars(names: list[str], axes: OnAxes) -> tuple[Figure, np.ndarray]:
    """Axes with a row for the bar of each name, the first above."""
    lines = sum(1 + 0.4 * name.count("\n") for name in names)
    figure, axes = panels(1, 1.0 + 0.24 * lines, axes=axes)
    layout = figure.get_layout_engine()
    if isinstance(layout, ConstrainedLayoutEngine):
        layout.set(w_pad=0.12)  # names are wider in print than at the resolution of the layout
    ax = axes[0, 0]
    ax.set_yticks(range(len(names)), names, fontsize=7, linespacing=1.05)
    ax.set_ylim(len(names) - 0.4, -0.6)
    ax.grid(False, axis="y")
    return figure, axes


def _rows(diagnosis: Diagnosis) -> list[tuple[str, float, dict[str, str]]]:
    """Name, value and look of each bar, from above."""
    worth = diagnosis.held_out
    rows = [("linear model", worth.drift_before, LINEAR)]
    if diagnosis.effects:
        rows.append(("\n+ ".join(named(found.name) for found in diagnosis.effects), worth.drift_after, NAMED))
    several = len(diagnosis.effects) > 1
    for found in diagnosis.effects:
        for rival in found.rivals:
            star = " *" if rival.inseparable else ""
            place = f"\nfor {named(found.name)}" if several else ""
            name = f"{named(rival.name)}{star}{place}"
            rows.append((name, worth.drift_after + rival.chi2_excess, ALTERNATIVE))
    return rows
