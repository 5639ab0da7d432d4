"""What the diagnoses of a fleet's motors say: their verdicts, and each effect in how many motors and how large."""

import json
import math
from collections import Counter
from collections.abc import Sequence, Sized
from typing import Any, NamedTuple

import numpy as np

from jaxmotor.motor.effects import parameters, vocabulary
from jaxmotor.present.report._html import Content, details, number, paragraph, table, unbroken
from jaxmotor.text import capital, named, parameter_title, percent, scaled, with_error

MOST_LISTED = 500
LEAST = 3
"""Motors, below which a spread between them is not told."""
Sizes = dict[str, dict[str, float]]


class Diagnosed(NamedTuple):
    """What the diagnosis of one motor said."""

    verdict: str
    effects: tuple[str, ...]
    """The largest held-out gain first."""
    sizes: Sizes
    """Parameters by effect [SI]."""
    errors: Sizes
    probabilities: dict[str, float]
    """Of the effects [1], those that are told as causes and those that are not."""
    looks_like: str | None
    left_open: str | None
    """Names of laws that the recording neither shows nor excludes."""

    @property
    def told(self) -> str:
        """Its effects with their sizes, or what the residual looks like; nothing where the motor is linear."""
        causes = [self._told(name) for name in self.effects]
        causes += [f"perhaps {self._told(name)}" for name in self.sizes if name not in self.effects]
        if self.looks_like is not None:
            causes.append(f"the residual looks like {self.looks_like}")
        if self.left_open is not None:
            causes.append(f"left open: {self.left_open}")
        return "; ".join(causes)

    def _told(self, name: str) -> str:
        values, errors = self.sizes.get(name, {}), self.errors.get(name, {})
        shown = [_amount(name, key, values[key], errors.get(key)) for key in _telling(name) if key in values]
        sure = f" ({percent(self.probabilities[name])})" if name in self.probabilities else ""
        return " ".join([named(name), ", ".join(shown)]).strip() + sure


def diagnosed(row: dict[str, Any]) -> Diagnosed | None:
    """What a row of the results says; None where there is no diagnosis."""
    if row.get("verdict") is None:
        return None
    sizes, errors = (_by_effect(row.get(key)) for key in ("effect_parameters", "effect_standard_errors"))
    sure = _numbers(_object(row.get("effect_probabilities")))
    told = (row.get("looks_like"), row.get("left_open"))
    return Diagnosed(row["verdict"], tuple(row.get("effects") or ()), sizes, errors, sure, *told)


def causes_section(rows: Sequence[dict[str, Any]]) -> Content:
    """How many motors have which verdict and which effects; nothing where none was diagnosed."""
    found = [one for one in map(diagnosed, rows) if one is not None]
    problems = [(row["motor"], row["diagnosis_problem"]) for row in rows if row.get("diagnosis_problem") is not None]
    if not found and not problems:
        return None
    verdicts = Counter((one.verdict, " + ".join(map(named, one.effects)) or "none") for one in found)
    counts = [(verdict, effects, str(count)) for (verdict, effects), count in verdicts.most_common()]
    left = [(row["motor"], one.looks_like) for row, one in zip(rows, map(diagnosed, rows), strict=True) if one]
    strange = [(motor, one) for motor, one in left if one is not None]
    text = f"{len(found)} motors were diagnosed one by one; each size stands in the table of all motors."
    return [
        paragraph(text),
        table("What came of it", ("verdict", "effects", "motors"), counts) if counts else None,
        _effects(found),
        _folded("What the unexplained residual looks like, motor by motor", ("motor", "looks like"), strange),
        _folded("Motors that could not be diagnosed", ("motor", "why"), problems),
    ]


def _effects(found: Sequence[Diagnosed]) -> Content:
    names = Counter(name for one in found for name in one.effects)
    if not names:
        return paragraph("No effect was named in any of them.")
    rows = [row for name, count in names.most_common() for row in _spread(name, count, found)]
    head = ("effect", "motors", "of it", "median", "from", "to", "standard deviation between motors")
    note = "What the errors of the estimates add to a standard deviation is taken out of it."
    return [table("Effects, and how they differ between the motors that have them", head, rows), paragraph(note)]


def _spread(name: str, count: int, found: Sequence[Diagnosed]) -> list[list[Content]]:
    """A row for each parameter of an effect that `count` motors have."""
    share = unbroken(f"{count} ({100 * count / len(found):.0f} %)")
    rows: list[list[Content]] = []
    for key in _telling(name):
        having = [one for one in found if name in one.effects and key in one.sizes.get(name, {})]
        known = [(one.sizes[name][key], one.errors.get(name, {}).get(key, math.nan)) for one in having]
        if known:
            rows.append([capital(named(name)), share, *_summary(name, key, *np.array(known, float).T)])
    return rows or [[capital(named(name)), share, "", "", "", "", ""]]


def _summary(name: str, key: str, values: np.ndarray, errors: np.ndarray) -> list[Content]:
    middle = float(np.median(values))
    factor, unit = scaled(parameters(vocabulary()[name])[key], middle)
    spread, least, largest = spread_between(values, errors), float(values.min()), float(values.max())
    told = [
        number(value, f"effects.{name}.{key}.{what}", f"{factor * value:.4g} {unit}".rstrip())
        for what, value in (("median", middle), ("least", least), ("largest", largest))
    ]
    shown = f"{factor * spread:.3g} {unit}".rstrip() if math.isfinite(spread) else "too few motors"
    last = number(spread, f"effects.{name}.{key}.spread", shown)
    return [parameter_title(key), *told, last]


def spread_between(values: np.ndarray, errors: np.ndarray) -> float:
    """Standard deviation of what `values` with standard `errors` (n,) are estimates of; NaN where they are too few.

    The moments' estimate: the variance of the values less the mean of the errors', at least zero.
    """
    if len(values) < LEAST:
        return math.nan
    noise = np.mean(np.nan_to_num(errors) ** 2)
    return math.sqrt(max(float(values.var(ddof=1) - noise), 0.0))


def _telling(name: str) -> list[str]:
    """Parameters whose value says something by itself: not a phase, whose zero is the counter's."""
    about = parameters(known[name]) if name in (known := vocabulary()) else {}
    return [key for key in about if about[key]["kind"] != "phase"]


def _amount(name: str, key: str, value: float, error: float | None) -> str:
    about = parameters(vocabulary()[name])[key]
    factor, unit = scaled(about, value)
    if about["kind"] == "fixed":
        return f"{factor * value:g} {unit or 'per turn'}"
    return with_error(factor * value, factor * (math.nan if error is None else error), unit)


def _by_effect(text: Any) -> Sizes:
    """The numbers of a text column; without what is no number."""
    return {name: _numbers(of) for name, of in _object(text).items() if isinstance(of, dict)}


def _object(text: Any) -> dict[str, Any]:
    """The JSON object of a text column; nothing where it is none."""
    try:
        content = json.loads(text) if isinstance(text, str) else {}
    except ValueError:
        return {}
    return content if isinstance(content, dict) else {}


def _numbers(of: dict[str, Any]) -> dict[str, float]:
    return {key: float(value) for key, value in of.items() if isinstance(value, int | float)}


def _folded(title: str, head: tuple[str, str], rows: Sequence[tuple[str, str]]) -> Content:
    if not rows:
        return None
    return details(f"{title} ({len(rows)})", table(title, head, rows[:MOST_LISTED]), more(rows))


def more(rows: Sized, most: int = MOST_LISTED) -> Content:
    """Of `rows`, of which `most` are listed: how many are not."""
    left = len(rows) - most
    return paragraph(f"and {left} more, which the file of results has") if left > 0 else None
