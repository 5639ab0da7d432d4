"""Learned laws of a fitted motor as curves, with their errors and the known shapes that they are like."""

import math

import numpy as np
from jaxtyping import Float

from jaxmotor.diagnosis._curve_columns import columns_of, visited
from jaxmotor.diagnosis._errors import covariance, slopes_of
from jaxmotor.diagnosis._found import Found
from jaxmotor.diagnosis._free import OWN
from jaxmotor.diagnosis._held_out import HeldOut
from jaxmotor.diagnosis._learned_law import LearnedLaw, resemblances
from jaxmotor.diagnosis._search import Search
from jaxmotor.diagnosis._solve import Fitted
from jaxmotor.diagnosis._trial import Trial
from jaxmotor.motor.effects import AbstractLearnedEffect, free_size, parameters

POINTS = 241
"""Of a law's curve."""
RARE = 0.05
"""Least weight of a place, of the mean one."""
LEAST = 0.1
"""Excess chi2 that a share is taken of at least: less may be the rounding's own."""
EDGE = 0.002
"""Part of the rows at either end that a curve is not drawn over."""


def learned_laws(
    search: Search, found: Found, held: HeldOut, spread: Float[np.ndarray, "p p"], block: np.ndarray, *, partial: bool
) -> dict[str, LearnedLaw]:
    """The learned effects of `found` as curves, by name; with `partial` also those that were tried beside it, the one
    that explains most of held-out data first. Rows belong to blocks `block` (n,)."""
    trial, fitted = search.solver.trial, found.fitted
    laws = {}
    for name in _learned(fitted):
        without = held.without(name)
        gain = without - held.after.drift
        laws[name] = law_of(fitted, name, spread, trial, _share(gain, without), gain)
    tried = []
    for names, other in search.visited.fitted.items() if partial else ():
        more = [name for name in _learned(other) if name not in fitted.names]
        if len(more) == 1 and names - {more[0]} == set(fitted.names):
            gain = held.after.drift - held.drift(other.motor, other, held.after.drift)
            own = covariance(other, block)
            tried.append((more[0], law_of(other, more[0], own, trial, _share(gain, held.after.drift), gain)))
    return laws | dict(sorted(tried, key=lambda one: -one[1].share))


def _learned(fitted: Fitted) -> list[str]:
    return [effect.name for effect in fitted.template.effects if isinstance(effect, AbstractLearnedEffect)]


def _share(gain: float, without: float) -> float:
    """Of the excess chi2 per sample of held-out data; none where that is no excess."""
    excess = max(without - 1, 0.0)
    return float(np.clip(min(gain, excess) / max(excess, LEAST), 0.0, 1.0))


def law_of(
    fitted: Fitted, name: str, spread: Float[np.ndarray, "p p"], trial: Trial, share: float, gain: float
) -> LearnedLaw:
    """The learned effect `name` of `fitted`, whose free numbers have the covariance `spread`, as a curve over what
    `trial` visits; `share` [1] and `gain` are those of `LearnedLaw`."""
    effect, begin = _found(fitted, name)
    places = visited(trial, effect)
    low, high = (0.0, 2 * np.pi) if effect.coordinate == "angle" else np.quantile(places, [EDGE, 1 - EDGE])
    at = np.linspace(low, high, POINTS)
    columns = columns_of(effect, at)
    slopes = slopes_of(effect, begin, len(spread))
    terms = [key for key, about in parameters(effect).items() if about["kind"] == "term"]
    free = np.stack([slopes[key] for key in terms])
    known = np.where(np.isfinite(spread), spread, 0.0)
    covariance = columns @ (free @ known @ free.T) @ columns.T
    values = columns @ np.array([float(getattr(effect, key)) for key in terms])
    weight = np.maximum(np.histogram(places, POINTS, (low, high))[0] / (len(places) / POINTS), RARE)
    most_V = float(np.abs(np.asarray(trial.problem.batch.volts)[trial.valid]).max(initial=0.0))
    most = most_V if effect.unit == "V" else math.inf
    like = resemblances(type(effect), at, values, weight, covariance, most)
    error = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    return LearnedLaw(effect.coordinate, at, values, error, share, gain, like, effect.unit)


def _found(fitted: Fitted, name: str) -> tuple[AbstractLearnedEffect, int]:
    """The effect, and where its free numbers begin."""
    begin = OWN
    for effect in fitted.motor.effects:
        if effect.name == name and isinstance(effect, AbstractLearnedEffect):
            return effect, begin
        begin += free_size(effect)
    raise ValueError(f"the motor has no learned {name}")
