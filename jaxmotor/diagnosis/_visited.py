"""The models that a search has fitted, and how probable each of them is by what it predicts of blocks left out."""

import functools
import math
from collections.abc import Collection, Sequence

import numpy as np

from jaxmotor.diagnosis._evidence import (
    Evidence,
    Limits,
    beyond_noise,
    beyond_others,
    evidence,
    groups_of,
    means,
    weights,
)
from jaxmotor.diagnosis._found import COARSE, EXPLAINED, NONE
from jaxmotor.diagnosis._relations import Relations, price_of
from jaxmotor.diagnosis._rest import may_be
from jaxmotor.diagnosis._score_test import Candidate
from jaxmotor.diagnosis._solve import Fitted
from jaxmotor.motor.effects import LEARNED, AbstractLearnedEffect, Rig, penalty

FAR = 2.0
"""chi2 per sample, over the best one's, above which a law is no alternative."""
EQUAL = 0.1
"""Part of a model's weight from which another one is not told from it."""
Names = frozenset[str]


class Visited:
    """The best fit of each set of effects, that of the `linear` motor first.

    Up to `noise_chi2` per sample a motor leaves nothing but noise that is known; 0 where none is known.
    """

    def __init__(self, linear: Fitted, relations: Relations, rig: Rig, piece: np.ndarray, noise_chi2: float = 0.0):
        self.relations, self.rig, self.noise_chi2 = relations, rig, noise_chi2
        time_constant_s = 0.0 if noise_chi2 else 1 / float(linear.motor.linear.pole)
        self._group = groups_of(piece, time_constant_s / rig.period_s)
        self._piece = piece[np.flatnonzero(np.diff(self._group, prepend=-1))]
        self.own = frozenset(linear.names)
        """What is the log's: no candidate, and no cause."""
        self.fitted: dict[Names, Fitted] = {}
        self._evidence: dict[Names, Evidence] = {}
        self._penalties: dict[Names, dict[str, float]] = {}
        """Of the curves of each model."""
        self._weights: dict[Names, float] | None = None
        """While no model comes or goes."""
        self._add(linear)

    def keep(self, found: list[Fitted]) -> None:
        """Those of `found` that the rig can have, that are no others by a longer name, and that are better than what
        was known."""
        for one in found:
            known = self.fitted.get(frozenset(one.names))
            better = _is_finite(one) and (known is None or one.chi2 < (1 - COARSE) * known.chi2)
            is_simpler = any(map(self.relations.is_simpler, one.motor.effects))
            if better and not is_simpler and may_be(one.motor, self.rig):
                self._add(one)

    def _add(self, one: Fitted) -> None:
        names = frozenset(one.names)
        self._weights = None
        self.fitted[names] = one
        self._evidence[names] = self._judged(one.residual, one.jacobian, one.layout.spread)
        learned = [effect for effect in one.motor.effects if isinstance(effect, AbstractLearnedEffect)]
        self._penalties[names] = {effect.name: penalty(effect) for effect in learned}

    def _judged(self, residual: np.ndarray, jacobian: np.ndarray, spread: np.ndarray) -> Evidence:
        return evidence(means(residual, self._group), means(jacobian, self._group), spread, self._piece)

    def weights(self) -> dict[Names, float]:
        """Probability of each model."""
        if self._weights is None:
            names = list(self.fitted)
            prices = [self._price(one) for one in names]
            judged, limits = [self._evidence[one] for one in names], functools.partial(self._limits, names)
            found = weights(judged, prices, self._bounds(names), limits)
            self._weights = dict(zip(names, found.tolist(), strict=True))
        return self._weights

    def _bounds(self, names: Sequence[Names]) -> np.ndarray:
        """(model,) Where the linear motor leaves more than the log's noise, laws that only imitate what is there also
        predict better than none: blocks alone decide."""
        found, chi2 = [self._evidence[one] for one in names], [self.fitted[one].chi2 for one in names]
        if self.noise_chi2:
            return beyond_noise(found, [one < self.noise_chi2 for one in chi2], self.noise_chi2)
        return beyond_others(found, chi2) if self.fitted[self.own].chi2 <= EXPLAINED else np.zeros(len(names))

    def _limits(self, names: Sequence[Names], other: int) -> Limits:
        """By the likelihood: against a model with some effects more, the odds are at least the lesser of

            -n (chi2 - chi2*)/(2v)    and    -n log(S/S*)/2,

        chi2* and S* those of the model with more effects, v the variance of its residuals in blocks and S the mean
        square one row ahead, where they are white. Effects that take up no more than chance does may still predict each
        block better by much the same.
        """
        mine = names[other]
        least = [self._least(one, mine) if one < mine else -np.inf for one in names]
        most = [-self._least(mine, one) if mine < one else np.inf for one in names]
        return Limits(np.array(least), np.array(most))

    def _least(self, names: Names, more: Names) -> float:
        """Of a model against the one with `more` effects."""
        fit, judged = self.fitted[more], self._evidence[more]
        chi2 = len(fit.residual) * (self.fitted[names].chi2 - fit.chi2) / fit.variance
        ahead = judged.rows * math.log(self._evidence[names].mean[1] / judged.mean[1])
        return -0.5 * max(chi2, ahead, 0.0)

    def _price(self, names: Names) -> float:
        """Of a model, in logarithms of probability."""
        return sum(map(self.relations.price, names - self.own), self._curve_price(names))

    def _curve_price(self, names: Names) -> float:
        """What the curves of a model cost more than they would beside laws over the same coordinate, in logarithms of
        probability: by their prior, where such a law leaves less to a curve, that is the likelier. Of other laws blocks
        alone tell."""
        each = {name: self._penalties[names].get(name, 0.0) for name in names & LEARNED.keys()}
        return sum((max(own - self._least_penalty(name, names), 0.0) for name, own in each.items()), 0.0)

    def _least_penalty(self, curve: str, names: Names) -> float:
        """Of a `curve`, in models with no other effects than `names` and laws over its coordinate, where they explain
        about as much as the best one with it."""
        having = [one for one in self.fitted if curve in one]
        far = FAR * min(self.fitted[one].chi2 for one in having)
        possible = names | self.relations.over_same(curve)
        near = [one for one in having if self.fitted[one].chi2 <= far and one <= possible]
        return min((self._penalties[one][curve] for one in near), default=math.inf)

    def promised(self, start: Candidate) -> float:
        """Weight of the base of `start` with its effect, to first order, over that of the base alone."""
        base = start.base
        spread = np.concatenate([base.layout.spread, np.full(start.columns.shape[1], np.inf)])
        longer = self._judged(start.residual, np.column_stack([base.jacobian, start.columns]), spread)
        shorter = self._evidence[frozenset(base.names)]
        with_it, without = weights([longer, shorter], [self.relations.price(start.effect.name), 0.0])
        return float(with_it / without)

    def odds(self, one: Fitted, others: Sequence[Fitted]) -> float:
        """Weight of `one` over that of all `others`, none of which is kept."""
        fits = [one, *(fit for fit in others if _is_finite(fit))]
        if len(fits) == 1 or not _is_finite(one):
            return math.inf if _is_finite(one) else 0.0
        judged = [self._judged(fit.residual, fit.jacobian, fit.layout.spread) for fit in fits]
        effects = [[type(effect) for effect in fit.motor.effects if effect.name not in self.own] for fit in fits]
        prices = [sum(map(price_of, own), 0.0) for own in effects]
        weight = weights(judged, prices)
        return float(weight[0] / max(weight[1:].sum(), 1e-300))

    def best(self) -> Fitted:
        """The most probable one; laws with two names in the place of a curve if both together are."""
        weight = self.weights()
        best = max(weight, key=lambda names: weight[names])
        laws = [names for names in weight if not names & LEARNED.keys()]
        if best & LEARNED.keys() and laws:
            law = max(laws, key=lambda names: weight[names])
            one = self.relations.one_name(law)
            if sum(weight[names] for names in laws if self.relations.one_name(names) == one) > weight[best]:
                best = law
        return self.fitted[best]

    def without(self, effects: Collection[str]) -> list[Fitted]:
        """Those that have none of these `effects`, the most probable first."""
        weight = self.weights()
        others = [names for names in weight if not names.intersection(effects)]
        return [self.fitted[names] for names in sorted(others, key=lambda names: -weight[names])]

    def forget(self, effects: Collection[str]) -> None:
        """All that have one of these `effects`."""
        self._weights = None
        for names in [names for names in self.fitted if names.intersection(effects)]:
            del self.fitted[names], self._evidence[names], self._penalties[names]

    def probability(self, *effects: str) -> float:
        """Of any of these `effects`: the sum over the models that have one."""
        return sum((weight for names, weight in self.weights().items() if names.intersection(effects)), 0.0)

    def as_law(self, law: str, others: Collection[str]) -> float:
        """Probability that a curve has the shape of the usual `law` that it contains: of the models with such a curve
        and none of `others`, each as probable as it would be if it predicted no better than the one with the law in the
        curve's place. A rare law is no likelier than another shape."""
        if self.relations.is_rare(law):
            return 0.0
        weight, total = self.weights(), 0.0
        for names in weight:
            for curve in names & self.relations.curves(law) if not names.intersection((law, *others)) else ():
                with_law = names - {curve} | {law}
                if with_law in weight:
                    no_better = weight[with_law] * math.exp(self._price(with_law) - self._price(names))
                    total += min(weight[names], no_better)
        return total

    def probabilities(self) -> dict[str, float]:
        """Of each effect that was tried and of `none`, the largest first."""
        tried = {name for names in self.fitted for name in names - self.own}
        return falling({NONE: self.weights()[self.own]} | {name: self.probability(name) for name in tried})

    def families(self) -> dict[str, float]:
        """Of each family of effects, the largest first."""
        return falling({family: self.probability(*names) for family, names in self.relations.families().items()})

    def longer(self, base: Fitted) -> list[Fitted]:
        """Those with one effect more than `base`."""
        names = frozenset(base.names)
        return [one for own, one in self.fitted.items() if names < own and len(own) == len(names) + 1]


def _is_finite(one: Fitted) -> bool:
    return math.isfinite(one.chi2) and bool(np.isfinite(one.jacobian).all())


def falling(shares: dict[str, float]) -> dict[str, float]:
    """The largest first."""
    return dict(sorted(shares.items(), key=lambda item: -item[1]))
