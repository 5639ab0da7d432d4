"""The effects that were named, and their alternatives: chi2 of held-out data, and probabilities."""

import textwrap
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.ticker import LogLocator

from jaxmotor.diagnosis import Diagnosis
from jaxmotor.present._style import (
    BLACK,
    BLUE,
    GREY,
    SILVER,
    VERMILLION,
    OnAxes,
    heading,
    panels,
    plain_numbers,
    styled,
)
from jaxmotor.text import named, odds, percent, plainly

LINEAR, NAMED, ALTERNATIVE = (
    {"facecolor": SILVER, "edgecolor": GREY},
    {"facecolor": BLUE, "edgecolor": BLUE},
    {"facecolor": "white", "edgecolor": VERMILLION, "hatch": "////"},
)
NAME_WIDTH = 34
"""Characters of a bar's name in one line."""


class _Bar(NamedTuple):
    name: str
    value: float
    style: dict[str, str]
    text: str


@styled
def causes(diagnosis: Diagnosis, *, axes: OnAxes = None) -> Figure:
    """Drift chi2 per sample on held-out segments, of the linear motor, of the extended one, and with an alternative
    in an effect's place: bars from the noise, 1, on a logarithmic axis. A star: it cannot be distinguished."""
    bars = _models(diagnosis)
    figure, ax = _drawn(bars, 1.0, axes)
    values = [one.value for one in bars]
    ax.axvline(1.0, color=BLACK, linewidth=0.9)
    ax.set_xscale("log")
    ax.set_xlim(0.9 * min(*values, 1.0), 2.0 * max(*values, 1.5))
    ax.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if max(values) < 50 else (1.0,)))
    plain_numbers(ax.xaxis)
    ax.set_xlabel("Drift chi2 per sample of held-out data")
    floor = "the encoder's rounding" if diagnosis.fit.floor_known else "the noise"
    same = "; * indistinguishable" if any("*" in one.name for one in bars) else ""
    heading(np.array([ax]), f"1 = {floor} alone{same}")
    return figure


@styled
def probabilities(diagnosis: Diagnosis, *, axes: OnAxes = None) -> Figure:
    """Probability of each named effect, of the alternatives that fit as well, and of none of these."""
    bars = [
        _Bar(textwrap.fill(name, NAME_WIDTH), 100 * share, ALTERNATIVE if k else NAMED, percent(share))
        for found in diagnosis.named
        for k, (name, share) in enumerate(odds(found))
    ]
    figure, ax = _drawn(bars, 0.0, axes)
    for place in [k for k, one in enumerate(bars) if k and one.style is NAMED]:
        ax.axhline(place - 0.5, color=BLACK, linewidth=0.6)
    ax.set(xlim=(0, 115), xticks=range(0, 101, 20), xlabel="Probability (%)")
    return figure


def _models(diagnosis: Diagnosis) -> list[_Bar]:
    """From above."""
    scores, several = diagnosis.held_out, len(diagnosis.named) > 1
    extended = "\n+ ".join(named(found.name) for found in diagnosis.named)
    models = [("linear model", scores.drift_before, LINEAR), (extended, scores.drift_after, NAMED)]
    for found in diagnosis.named:
        place = f"\nfor {named(found.name)}" if several else ""
        models += [
            (
                f"{named(one.name)}{' *' if one.inseparable else ''}{place}",
                scores.drift_after + one.chi2_excess,
                ALTERNATIVE,
            )
            for one in found.alternatives
        ]
    return [_Bar(*model, plainly(model[1])) for model in (models if extended else models[:1])]


def _drawn(bars: list[_Bar], begin: float, axes: OnAxes) -> tuple[Figure, Axes]:
    """A row for each bar from `begin`, the first above."""
    lines = sum(1 + 0.4 * one.name.count("\n") for one in bars)
    figure, drawn = panels(1, 1.0 + 0.24 * lines, axes=axes)
    layout = figure.get_layout_engine()
    if isinstance(layout, ConstrainedLayoutEngine):
        layout.set(w_pad=0.12)  # names are wider in print than at the resolution of the layout
    ax = drawn[0, 0]
    for place, one in enumerate(bars):
        ax.barh(place, one.value - begin, left=begin, height=0.62, linewidth=0.7, **one.style)
        end = (max(one.value, begin), place)
        ax.annotate(one.text, end, (5, 0), textcoords="offset points", va="center", fontsize=7)
    ax.set_yticks(range(len(bars)), [one.name for one in bars], fontsize=7, linespacing=1.05)
    ax.set_ylim(len(bars) - 0.4, -0.6)
    ax.grid(False, axis="y")
    return figure, ax
