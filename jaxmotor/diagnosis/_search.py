"""Model selection: effects are added as long as blocks of rows that were left out ask for them.

Every model that is fitted is kept with its evidence (`_visited`). From each of the best models of one size the
candidate effects that score best are added in turn, the scores taken anew at that model's gain and pole. The model of
the largest weight is chosen; each of its effects then has to stand against the best alternatives in its place.
"""

import dataclasses
import functools
import math
from collections.abc import Callable

import numpy as np

from jaxmotor.diagnosis._bends import with_bends
from jaxmotor.diagnosis._contact_sizes import smoothed
from jaxmotor.diagnosis._cycles import Repeats
from jaxmotor.diagnosis._found import COARSE, FINE, INEXACT, LEAST, NEARLY, STAYS, Explained, Found, Named
from jaxmotor.diagnosis._free import is_wide, turned_about, with_effect, without_effect
from jaxmotor.diagnosis._level import is_as_likely, ties_of
from jaxmotor.diagnosis._parallel import side_by_side
from jaxmotor.diagnosis._places import at_best_place
from jaxmotor.diagnosis._relations import Relations
from jaxmotor.diagnosis._rest import may_be
from jaxmotor.diagnosis._rounding import rounding_chi2
from jaxmotor.diagnosis._score_test import (
    Candidate,
    EffectColumns,
    apparent_delay,
    as_simulated,
    candidates,
    columns_at,
    columns_beside,
    effect_columns,
)
from jaxmotor.diagnosis._solve import Fitted, Solver
from jaxmotor.diagnosis._visited import EQUAL, FAR, Names, Visited
from jaxmotor.motor import Motor
from jaxmotor.motor.effects import (
    LEARNED,
    AbstractEffect,
    AbstractLearnedEffect,
    AbstractLoadEffect,
    Rig,
    SensorLag,
    VoltageOffset,
    parameters,
)

FIRST, LATER = 7, 5
"""Candidates that are fitted beside the linear motor, and beside others."""
RELATED = 2
"""Of these, most that are alike (`Relations.relatives`)."""
BEAM = 3
"""Models of one size that are extended."""
FEW, DEPTH = 2, 4
"""Effects in one motor: those after which laws that are sought last are tried, and at most."""
NEAR = 0.2
"""Change of log gain and log pole up to which scores are good for another motor."""
CYCLES = "cycles_per_rev"
"""The parameter of laws that repeat with the angle."""
GROWS, HOPELESS = 0.3, 0.02
"""Part of the best model's weight that the best of a size must have for larger ones to be sought, or an effect must
promise beside a motor that leaves but the known noise; and that each must have to be extended."""
SEEN = 1e-3
"""Part of the best model's weight that one must have had to be fitted anew in a recording that has changed a little."""
SHARE = 0.5
"""Part of the mean square beside the known noise that an effect must take up where that is so little that it may be
what laws are off by."""
LITTLE = 0.5
"""Part of chi2: where the first effect leaves more, it is tried from another start, too."""
IDLE = 1e-3
"""Part of chi2 by which a fit lowers it whose effect does something."""
SMALL = 0.1
"""Part of its size at which an effect is tried anew whose fit leaves more than there was without it."""
LIKELY = 0.4
"""Part of the best score's gain that a law of two inertias must promise where another effect explains everything."""
PROMISE = 0.02
"""Part of the mean square that a law's score must promise to take up beside others, where the noise is not known."""
CONTESTS = 3
"""Rounds in which the best model is contested."""
LEADERS = 2
"""Of the candidates, those that are fitted before the others."""
ALTERNATIVES = 4
"""In each effect's place, those that are fitted anew in a recording that has changed a little."""
NEARBY = 2
"""Of the starts of a wider law beside a contact, those that are fitted."""
AGAIN = 6
"""Steps of such a fit, which begins near its end."""


class Search:
    """For the effects, beside those of `linear`, that predict blocks of rows which were left out."""

    def __init__(self, solver: Solver, first: Motor, linear: Fitted, rig: Rig):
        self.solver, self.first, self.linear, self.rig = solver, first, linear, rig
        self.relations = Relations(solver.request.known, solver.request.effects)
        noise = max(NEARLY, rounding_chi2(solver, linear)) if solver.noise_known else 0.0
        self.visited = Visited(linear, self.relations, rig, solver.piece, noise)
        self.explained = Explained(linear.chi2, solver.noise_known, max(noise, NEARLY))
        self.own = self.visited.own
        """What is the log's: no candidate, and no cause."""
        self.tried: dict[Names, float] = {}
        """Models that were fitted from one with an effect less, and the least chi2 of those."""
        self.extended: dict[Names, float] = {}
        """chi2 of the models beside which further effects have been tried."""
        self.shared: set[Names] = set()
        """Models of which an effect's size has been shared with its relatives."""
        self.shortened: list[Fitted] = []
        """Those whose effects have been left out in turn."""
        self.challenged: list[Fitted] = []
        """Those in which effects that are alike have been tried in each other's place."""
        self.scores: list[tuple[Fitted, tuple[EffectColumns, ...]]] = []
        self.smooth: dict[Fitted, Fitted] = {}
        """What `_smoothed` made of them, which is smooth itself."""
        self.level: dict[Fitted, Fitted] = {}
        """What `_level` made of them."""
        self.repeats = Repeats(solver)

    def try_offset(self, offset_V: float) -> None:
        """Fit the first motor with the voltage offset that was fitted along with it: where that is large a linear motor
        without one is another motor, beside which nothing scores."""
        if offset_V and VoltageOffset.name in self.solver.request.effects:
            motor = with_effect(self.first, VoltageOffset.of(volts_V=offset_V))
            self.tried[_names(motor)] = self.linear.chi2
            self.visited.keep([self._fit(self.linear, motor)])

    def run(self, last: Callable[[Fitted], None]) -> Found:
        """The effects; none if nothing pays. Where two of the usual ones leave something, `last` fits others beside the
        best motor: better one of those than a third and a fourth that only imitate it."""
        beam = [self.linear]
        for size in range(1, DEPTH + 1):
            self._extend(beam, FIRST if size == 1 else LATER)
            weight = self.visited.weights()
            of_size = [names for names in weight if len(names - self.own) == size]
            larger = sorted(of_size, key=lambda names: -weight[names])
            most = max(weight.values())
            if not larger or weight[larger[0]] < GROWS * most:
                break
            if size == FEW and not self.explained.holds(self.visited.best()):
                last(self.visited.best())
                if self.explained.holds(self.visited.best()):
                    break
            least = [names for names in larger if not self._has_simpler(names, weight)]
            best = [names for names in least[:BEAM] if weight[names] > HOPELESS * most]
            beam = [self.visited.fitted[names] for names in dict.fromkeys([*best, *self._simpler(best[0])])]
        return self.as_found(self.visited.best())

    def as_found(self, fitted: Fitted) -> Found:
        """The best model near `fitted`, with the alternatives to each of its effects."""
        for _ in range(CONTESTS):
            self._challenge(fitted)
            better = self.visited.best()
            if better is fitted:
                break
            fitted = better
        if is_wide(fitted.template.effects):
            self.visited.keep([self._smoothed(fitted)])
            fitted = self.visited.fitted.get(frozenset(fitted.names), fitted)
        return self.found_at(self._known(self._likely(fitted)))

    def found_at(self, fitted: Fitted) -> Found:
        """`fitted`, with the alternatives to each of its effects."""
        named = tuple(self._leveled(self._named(fitted, name)) for name in self._causes(fitted))
        last = self._refined(fitted) if named else self.linear
        share = self.explained.share_left(last, self.linear.chi2)
        return Found(self.linear, last, named, self.visited.probabilities(), self.visited.families(), share)

    def resumed(self, before: "Search") -> Found:
        """Where the likely models of `before`, of the same recording with its speeds over another window, or with a
        timing offset, lead when they are fitted anew and contested by what was not tried before.

        So are the best in the place of each effect of the best of them, and curves that were tried beside that.
        """
        self.tried |= {names - before.own | self.own: 0.0 for names in before.tried}
        self.shared |= {names - before.own | self.own for names in before.shared}
        more = [effect for effect in self.first.effects if effect.name in self.own - before.own]

        def fit(known: Fitted) -> Fitted:
            motor = known.motor
            for name in before.own - self.own:
                motor = without_effect(motor, name)
            for effect in more:
                motor = with_effect(motor, effect)
            return self.solver.fit(motor, known, COARSE, AGAIN)

        self.visited.keep(side_by_side(fit, before.worth_keeping()))
        return self.as_found(self.visited.best())

    def goes_on(self, before: "Search") -> None:
        """Begin with all that `before` has fitted to the same rows, and try again nothing that it tried."""
        self.visited.keep(list(before.visited.fitted.values()))
        self.tried |= before.tried
        self.shared |= before.shared
        self.shortened, self.challenged = [*before.shortened], [*before.challenged]
        self.smooth, self.level = {**before.smooth}, {**before.level}

    def worth_keeping(self) -> list[Fitted]:
        """The likely models; beside the best one those with another effect in a place, or with a curve more."""
        weight, known = self.visited.weights(), self.visited.fitted
        best = frozenset(self.visited.best().names)
        kept = [names for names, own in weight.items() if own > SEEN * max(weight.values())]
        kept += [names for names in known if names > best and len(names) == len(best) + 1 and _is_learned(known[names])]
        for name in best - self.own:
            others = [names for names in known if len(names) == len(best) and best - {name} < names]
            kept += [best - {name}, *sorted(others, key=lambda names: known[names].chi2)[: ALTERNATIVES + 1]]
        return [known[names] for names in dict.fromkeys(kept) if names in known]

    def _simpler(self, names: Names) -> list[Names]:
        """Models with a law that one of `names` contains, in its place: with more parameters that may take up what
        another effect does."""
        others = [names - {name} | {simple} for name in names - self.own for simple in self.relations.simpler(name)]
        return [other for other in others if other in self.visited.fitted]

    def _has_simpler(self, names: Names, weight: dict[Names, float]) -> bool:
        """The recording does not ask for a law of `names` in the place of one that it contains. Where the noise is not
        known more may be left than that, and the motor with more freedom is extended, too."""
        return self.solver.noise_known and any(weight[one] > EQUAL * weight[names] for one in self._simpler(names))

    def _causes(self, fitted: Fitted) -> list[str]:
        return [name for name in fitted.names if name not in self.own]

    def _challenge(self, fitted: Fitted) -> None:
        """Fit the best candidates, and all that are alike, in the place of each effect of `fitted`; and further ones
        beside it if it is the best since the last contest."""
        bases = self.without_each(fitted)
        extended = [fitted, *bases] if self._is_new(fitted) else bases
        # A curve leaves little to imitate, and each further effect beside one takes long.
        self._extend([base for base in extended if not _is_learned(base)], LATER, FAR * fitted.chi2)
        if fitted in self.challenged:
            return
        self.challenged.append(fitted)
        swapped = [(fitted, motor) for motor in self._likewise(fitted, beside=False)]
        # Of two that are alike one may do the work of a third.
        for base in bases:
            new = (motor for motor in self._likewise(base, beside=False) if _names(motor) not in self.visited.fitted)
            swapped += [(base, motor) for motor in new]
        self.visited.keep(side_by_side(lambda task: self._fit(*task, FAR * fitted.chi2), swapped))
        self._widen(fitted)
        self._turn_about(fitted)

    def _turn_about(self, fitted: Fitted) -> None:
        """Fit the motor whose lag is the pole of `fitted`, and whose pole is its lag, with what is alike in the place
        of each effect. Of a linear motor it is the same; friction acts before the slower one or after it."""
        turned = turned_about(fitted.motor)
        if turned is None or SensorLag.name not in self.solver.request.effects:
            return
        other = self._fit(fitted, turned)
        alike = [motor for motor in self._likewise(other, beside=False) if SensorLag.name in _names(motor)]
        self.visited.keep([other, *side_by_side(lambda motor: self._fit(other, motor, FAR * fitted.chi2), alike)])

    def _likewise(self, fitted: Fitted, *, beside: bool) -> list[Motor]:
        """`fitted` with effects that are alike in each other's place, or `beside` each other with half the size."""
        motors = []
        for effect in fitted.motor.effects:
            relatives = self.relations.sharing(effect.name) if beside else self.relations.relatives(effect.name)
            size = (0.5 if beside else 1.0) * _size(effect)
            bare = without_effect(fitted.motor, effect.name)
            rest = with_effect(bare, effect.scaled(0.5)) if beside and relatives else bare
            names = self.solver.request.effects.difference(fitted.names, self.relations.barred(rest.effects))
            others = [self.relations.known[name] for name in relatives if name in names]
            motors += [with_effect(rest, _sized(other, size)) for other in others]
        return motors

    def _widen(self, fitted: Fitted) -> None:
        """Fit laws that contain one of the effects of `fitted` in its place: what they add may not show in scores,
        which hold beside the motor without it. Another effect may have imitated that: each is left out in turn."""
        tasks = [motors for effect in fitted.motor.effects for motors in self._wider(fitted, effect)]
        found = side_by_side(lambda motors: self._best_near(fitted, motors), tasks)
        self.visited.keep(found)
        wide = [self.visited.fitted.get(frozenset(one.names), fitted) for one in found]
        for one in wide:
            if one.chi2 < (1 - IDLE) * fitted.chi2 and one not in self.shortened:
                self.without_each(one)

    def _wider(self, fitted: Fitted, effect: AbstractEffect) -> list[list[Motor]]:
        """`fitted` with each usual law that contains `effect` in its place, begun at about its size."""
        rest = without_effect(fitted.motor, effect.name)
        laws = self.relations.containing(effect.name) & (
            self.solver.request.effects - self.relations.barred(rest.effects)
        )
        usual = [self.relations.known[name] for name in sorted(laws) if not self.relations.is_rare(name)]
        starts = [[alike for one in law.starts(self.rig) for alike in _as_large(one, effect)] for law in usual]
        return [[with_effect(rest, one) for one in its] for its in starts if its]

    def _best_near(self, fitted: Fitted, motors: list[Motor]) -> Fitted:
        """The best fit of those that begin at `motors`, beside `fitted`; where fits take long, of the best of those."""
        if is_wide(fitted.template.effects):
            motors = as_simulated(self.solver, fitted, motors)[:NEARBY]
        found = side_by_side(lambda motor: self.solver.fit(motor, fitted, COARSE, bar=FAR * fitted.chi2), motors)
        return self._placed(fitted, min(found, key=lambda one: one.chi2))

    def _fit(self, near: Fitted, motor: Motor, bar: float = math.inf) -> Fitted:
        return self._placed(near, self.solver.fit(motor, near, COARSE, bar=bar))

    def _placed(self, base: Fitted, fitted: Fitted) -> Fitted:
        placed = at_best_place(self.solver, fitted, self.rig, COARSE)
        # In a motor with these effects that is known, bends have been sought.
        is_known = frozenset(placed.names) in self.visited.fitted
        return placed if is_known else with_bends(self.solver, base, placed, COARSE)

    def _extend(self, bases: list[Fitted], most: int, bar: float = math.inf) -> None:
        """Fit each of `bases` with one of `most` candidates more; fits whose chi2 will not come below `bar`, or not as
        far below the base's as an effect must bring it, are given up."""
        tasks: dict[Names, tuple[Fitted, list[Candidate]]] = {}
        shared: list[tuple[Fitted, Motor]] = []
        self.extended |= {frozenset(base.names): base.chi2 for base in bases}
        for base in bases:
            ranked = candidates(base, self._effect_columns(base))
            quiet = self._is_quiet(base)
            always = self.relations.always if base is self.linear and not quiet else ()
            leaders = self._leaders(base, ranked, most, always)
            simpler = [simple for name in leaders for simple in self.relations.simpler(name)]
            for name in (*leaders, *simpler):
                names = frozenset((*base.names, name))
                if name in ranked and (names not in self.tried or self._is_stuck(names, base)):
                    tasks.setdefault(names, (base, ranked[name]))
            if not quiet and frozenset(base.names) not in self.shared:
                shared += [(base, motor) for motor in self._likewise(base, beside=True)]
        self.tried |= {names: base.chi2 for names, (base, _) in tasks.items()}
        self.shared.update(frozenset(base.names) for base, _ in shared)
        found = self._fitted(tasks, bar)
        self.visited.keep(found + side_by_side(lambda task: self._fit(*task, min(bar, self._bar(task[0]))), shared))
        self.visited.keep(side_by_side(self._completed, [one for one in found if _wanted(one)]))
        self.again(bases)

    def extend_least(self) -> None:
        """Fit further effects beside the motor of laws that leaves least, if it was not extended yet: half of what is
        there may predict blocks left out no better than nothing does, and the whole far better."""
        laws = [one for one in self.visited.fitted.values() if not _is_learned(one)]
        least = min(laws, key=lambda one: one.chi2)
        if self._is_new(least):
            self._extend([least], LATER)

    def extend_learned(self, fitted: Fitted) -> None:
        """Fit further effects beside a curve of `fitted`, if none was tried there: friction is in most motors, also in
        those whose voltage is not in proportion."""
        if _is_learned(fitted) and self._is_new(fitted):
            self._extend([fitted], LATER)

    def _is_new(self, fitted: Fitted) -> bool:
        """`fitted` has room for a further effect, and none was tried beside it since it left much more: what is tried
        beside a motor that is stuck in a local minimum tells little."""
        better = fitted.chi2 < (1 - PROMISE) * self.extended.get(frozenset(fitted.names), math.inf)
        return better and 0 < len(self._causes(fitted)) < DEPTH

    def _is_stuck(self, names: Names, base: Fitted) -> bool:
        """The fit of a model that has all of `base` and more leaves more than `base`, which is better than the motor
        that it began from."""
        known = self.visited.fitted.get(names)
        return known is not None and base.chi2 < min(known.chi2, (1 - IDLE) * self.tried[names])

    def again(self, bases: list[Fitted]) -> None:
        """Fit each of `bases` once more, from where the best of its extensions ended: a law that takes up little may
        still have led gain, pole and the other effects out of a local minimum."""
        best = {base: min(self.visited.longer(base), key=lambda one: one.chi2, default=base) for base in bases}
        led = [(base, one) for base, one in best.items() if one.chi2 < self.least(base, LEAST)]
        self.visited.keep(side_by_side(lambda pair: self._fit(pair[1], _common(*pair), pair[0].chi2), led))

    def _is_quiet(self, base: Fitted) -> bool:
        """`base` leaves but the known noise."""
        return self.solver.noise_known and base.chi2 < NEARLY

    def _promising(self, base: Fitted, ranked: dict[str, list[Candidate]]) -> set[str]:
        """Those of `ranked` that may matter beside `base`. Near the noise effects are small multiples of themselves,
        and what they do there is linear."""
        if self._is_quiet(base):
            promised = side_by_side(lambda name: self.visited.promised(ranked[name][0]), ranked)
            return {name for name, more in zip(ranked, promised, strict=True) if more > GROWS}
        if self.solver.noise_known or base is self.linear:
            return set(ranked)
        return {name for name, its in ranked.items() if its[0].chi2 < (1 - PROMISE) * base.chi2}

    def _leaders(self, base: Fitted, ranked: dict[str, list[Candidate]], most: int, also: tuple[str, ...]) -> list[str]:
        """`most` effects by their scores, few of them alike, and `also` these."""
        barred = self.relations.barred(base.template.effects)
        order = [name for name in sorted(ranked, key=lambda name: ranked[name][0].chi2) if name not in barred]
        promising = self._promising(base, ranked)
        chosen: list[str] = []
        for name in (name for name in order if name in promising):
            alike = set(self.relations.relatives(name)).intersection(chosen)
            if len(chosen) < most and len(alike) < RELATED and not self.relations.is_told(name, chosen):
                chosen.append(name)
        return chosen + [name for name in also if name in order and name not in chosen]

    def _fitted(self, tasks: dict[Names, tuple[Fitted, list[Candidate]]], bar: float) -> list[Fitted]:
        """The best fit of each of `tasks`, those that promise most first: others are fitted roughly where these explain
        far more. Laws of two inertias take long: where another effect leaves but the known noise, they are fitted only
        if their scores come near to the best one's, and left early."""
        least = min(one.chi2 for one in self.visited.fitted.values())

        def fit(chosen: list[Names], bar: float = bar) -> list[Fitted]:
            far = FAR * min([least, *(one.chi2 for one in found)])
            bars = {names: min(bar, self._bar(tasks[names][0])) for names in chosen}
            return side_by_side(lambda names: self._best_of(*tasks[names], bars[names], far), chosen)

        found: list[Fitted] = []
        two = [names for names, (_, starts) in tasks.items() if isinstance(starts[0].effect, AbstractLoadEffect)]
        order = sorted((names for names in tasks if names not in two), key=lambda names: tasks[names][1][0].chi2)
        for part in (order[:LEADERS], order[LEADERS:]):
            found += fit(part)
        if not (self.solver.noise_known and any(one.chi2 < NEARLY for one in found)):
            return found + fit(two)
        gain = {names: base.chi2 - starts[0].chi2 for names, (base, starts) in tasks.items()}
        return found + fit([names for names in two if gain[names] > LIKELY * max(gain.values())], min(bar, FAR))

    def _bar(self, base: Fitted) -> float:
        """chi2 above which an effect takes too little up of what `base` leaves; alone, any may be half of a pair."""
        return math.inf if base is self.linear else self.least(base, LEAST)

    def least(self, base: Fitted, share: float) -> float:
        """chi2 of a motor that takes up a `share` of what `base` leaves: beside the noise, where that is known."""
        noise = min(base.chi2, 1.0) if self.solver.noise_known else 0.0
        return base.chi2 - share * (base.chi2 - noise)

    def _best_of(self, base: Fitted, starts: list[Candidate], bar: float = math.inf, far: float = math.inf) -> Fitted:
        """`base` with the effect, fitted from its best starts of different shape; given up where chi2 will hardly come
        below `bar`, roughly where it is above `far`."""
        fit = functools.partial(self.solver.fit, near=base, tolerance=COARSE, bar=bar, far=far)
        first = starts[0]
        others = [start for start in starts[1:] if shape_of(start) != shape_of(first)][:1]
        found = side_by_side(fit, [start.motor for start in (first, *others)])
        if min(one.chi2 for one in found) > base.chi2:
            # What is linear reaches not that far, such as where a law acts from some speed on.
            found.append(fit(with_effect(base.motor, first.effect.scaled(SMALL))))
        rest = [start for start in starts[1:] if start.chi2 <= self.least(base, LEAST)]
        if rest and min(one.chi2 for one in found) >= (1 - IDLE) * base.chi2:
            # Beside the effects of `base` one may do nothing where it did alone, as a limit that is never reached.
            found.append(fit(as_simulated(self.solver, base, [one.motor for one in rest])[0]))
        if base is self.linear and min(one.chi2 for one in found) > LITTLE * base.chi2:
            # Without the effect, gain and pole may have gone where it does not show.
            found.append(fit(with_effect(self.first, first.effect)))
        best = min(found, key=lambda one: one.chi2)
        return best if best.chi2 > far else self._placed(base, best)

    def _completed(self, half: Fitted) -> Fitted:
        """`half`, which has a law that fits no motor alone, with what that wants beside it."""
        [name] = _wanted(half)
        own = [effect for effect in self.solver.request.asked() if effect.name == name]
        columns = columns_beside(self.solver, half, self.rig, own) or effect_columns(self.solver, half, self.rig, own)
        ranked = candidates(half, columns)
        return self._best_of(half, ranked[name]) if name in ranked else half

    def without_each(self, fitted: Fitted) -> list[Fitted]:
        """`fitted` without each of its effects in turn."""
        causes = self._causes(fitted)
        rest = [frozenset(fitted.names) - {name} for name in causes]
        if fitted not in self.shortened:
            # Also those that are known: from here a fit may end in a lower minimum than it did.
            self.shortened.append(fitted)
            self.visited.keep(side_by_side(lambda name: self._shorter(fitted, name), causes))
        return [self.visited.fitted[names] for names in rest if names in self.visited.fitted]

    def _shorter(self, fitted: Fitted, name: str) -> Fitted:
        known = self.visited.fitted.get(frozenset(fitted.names) - {name})
        bar = math.inf if known is None else known.chi2
        return self._fit(fitted, without_effect(fitted.motor, name), bar)

    def _known(self, fitted: Fitted) -> Fitted:
        """`fitted`, or one with a known law in the place of a learned one that contains it, where that explains all
        and is not much less likely."""
        for effect in fitted.template.effects:
            rest = frozenset(fitted.names) - {effect.name}
            simpler = self.relations.simpler(effect.name) if isinstance(effect, AbstractLearnedEffect) else ()
            weight = self.visited.weights()
            least = EQUAL * weight[frozenset(fitted.names)]
            known = [rest | {name} for name in simpler if weight.get(rest | {name}, 0.0) > least]
            known = [names for names in known if self.explained.holds(self.visited.fitted[names])]
            if known:
                return self.visited.fitted[max(known, key=lambda names: weight[names])]
        return fitted

    def _likely(self, fitted: Fitted) -> Fitted:
        """`fitted` without effects that are less likely than not, or take up too little where something is left. An
        effect stays without which the motor is hardly likely: then others only compete for its place."""
        weight = self.visited.weights()
        for name in self._causes(fitted):
            rest = frozenset(fitted.names) - {name}
            if rest not in weight:
                continue
            shorter = self.visited.fitted[rest]
            unlikely = self._named(fitted, name).with_equal < STAYS
            needed = weight[rest] < EQUAL * weight[frozenset(fitted.names)]
            if (unlikely and not needed) or self._imitates(shorter, fitted):
                return self._likely(shorter)
        return fitted

    def _imitates(self, shorter: Fitted, fitted: Fitted) -> bool:
        """The effect that `fitted` has more takes up too little of something else. Where next to nothing is left it
        would be as good as certain."""
        if not self.explained.holds(fitted):
            return fitted.chi2 > self.least(shorter, LEAST)
        if not self.solver.noise_known and shorter.chi2 < 1:
            inexact = INEXACT**2 * self.linear.chi2
            return shorter.chi2 < inexact or fitted.chi2 > self.least(shorter, LEAST)
        nearly = self.explained.enough(fitted, NEARLY)
        return self.solver.noise_known and fitted.chi2 > max(nearly, self.least(shorter, SHARE))

    def _named(self, fitted: Fitted, name: str) -> Named:
        """The effect `name` of `fitted`, and the models with another one in its place, the best first."""
        weight, rest = self.visited.weights(), frozenset(fitted.names) - {name}
        others = [names for names in weight if len(names) == len(fitted.names) and rest < names and name not in names]
        others.sort(key=lambda names: -weight[names])
        equal = [names for names in others if weight[names] > EQUAL * weight[frozenset(fitted.names)]]
        alike = frozenset(other for names in equal for other in names - rest)
        alternatives = tuple(self.visited.fitted[names] for names in others)
        laws = alike if self.solver.noise_known or name in LEARNED else alike - LEARNED.keys()
        laws |= self.relations.containing(name)
        probability, with_equal, with_law = (
            self.visited.probability(name, *also) + self.visited.as_law(name, also) for also in ((), alike, laws)
        )
        shorter = self.visited.fitted.get(rest)
        share = 0.0 if shorter is None else self.explained.share_left(fitted, shorter.chi2)
        return Named(name, alternatives, probability, with_equal, alike, share, with_law)

    def _effect_columns(self, base: Fitted) -> tuple[EffectColumns, ...]:
        """The candidates' columns beside `base`; of those whose programs would be new, at about its gain and pole.

        Beside the best one more of them are worth their programs: what a law does may not show at all without one that
        it acts through, or drown in what a larger one does.
        """
        bare = (*self._bare_columns(base), *self._wave_columns(base))
        if self._is_quiet(base) or not self._causes(base):
            return bare
        # An estimated noise may hold what laws left when it was estimated.
        closely = base is self.visited.best() and not (self.solver.noise_known and self.explained.holds(base))
        beside = columns_beside(self.solver, base, self.rig, self.solver.request.asked(), closely)
        known = {one.name for one in beside}
        return (*beside, *(one for one in bare if one.name not in known))

    def _wave_columns(self, base: Fitted) -> tuple[EffectColumns, ...]:
        """Of laws that repeat with the angle, at numbers of cycles at which the residual does."""
        numbers = () if self._is_quiet(base) or not self.rig.swing_rad else self.repeats.of(base)
        asked = [effect for effect in self.solver.request.asked() if CYCLES in parameters(effect)]
        return columns_at(self.solver, base, self.rig, asked, CYCLES, numbers) if numbers else ()

    def _bare_columns(self, base: Fitted) -> tuple[EffectColumns, ...]:
        for near, known in self.scores:
            later = abs(apparent_delay(near.motor) - apparent_delay(base.motor))
            if np.abs(near.free[:2] - base.free[:2]).max() < NEAR and later < 0.5 * self.rig.period_s:
                return known
        found = effect_columns(self.solver, base, self.rig, self.solver.request.asked())
        self.scores.append((base, found))
        return found

    def _refined(self, fitted: Fitted) -> Fitted:
        """`fitted` to the end, if that is a motor that the rig can have."""
        found = self._level(self._smoothed(fitted))
        return found if may_be(found.motor, self.rig) else fitted

    def _smoothed(self, fitted: Fitted) -> Fitted:
        """`fitted`; a law with contacts has the sizes that fit best on average over others near them."""
        if fitted not in self.smooth:
            wide = is_wide(fitted.template.effects)
            found = smoothed(self.solver, fitted, COARSE) if wide else fitted
            self.smooth |= {fitted: found, found: found}
        return self.smooth[fitted]

    def _level(self, fitted: Fitted) -> Fitted:
        """`fitted` to the end; its curve over the speed without what others do as well, where that is so."""
        if fitted not in self.level:
            free = self.solver.fit(fitted.motor, fitted, FINE)
            ties = ties_of(self.solver.trial, free)
            tied = free if ties is None else self.solver.fit(free.motor, free, FINE, ties=ties)
            self.level[fitted] = tied if is_as_likely(tied, free) else free
        return self.level[fitted]

    def _leveled(self, named: Named) -> Named:
        """`named`, of whose alternatives those that are not told from it are level, too."""

        def of(other: Fitted) -> Fitted:
            equal = named.equal.intersection(other.names)
            return self._level(other) if equal and ties_of(self.solver.trial, other) is not None else other

        return dataclasses.replace(named, alternatives=tuple(side_by_side(of, named.alternatives)))


def _names(motor: Motor) -> Names:
    return frozenset(effect.name for effect in motor.effects)


def _size(effect: AbstractEffect) -> float:
    """Its first parameter."""
    return abs(float(getattr(effect, next(iter(parameters(effect)), ""), 0.0)))


def _as_large(start: AbstractEffect, effect: AbstractEffect) -> list[AbstractEffect]:
    """`start` as large as `effect`, and so large that it holds the motor at rest as firmly, if both do."""
    sizes = [(_size(start), _size(effect))]
    if start.holds_by and effect.holds_by:
        sizes.append((_held_V(start), _held_V(effect)))
    return [start.scaled(wanted / own) for own, wanted in dict.fromkeys(sizes) if own]


def _held_V(effect: AbstractEffect) -> float:
    """What it holds at rest [V]."""
    return abs(float(getattr(effect, effect.holds_by)))


def _common(base: Fitted, longer: Fitted) -> Motor:
    """The motor of `longer` without the effect that `base` has not."""
    [name] = set(longer.names) - set(base.names)
    return without_effect(longer.motor, name)


def _is_learned(fitted: Fitted) -> bool:
    return any(isinstance(effect, AbstractLearnedEffect) for effect in fitted.template.effects)


def _sized(effect: type[AbstractEffect], size: float) -> AbstractEffect:
    """With one parameter."""
    return effect.of(**dict.fromkeys(parameters(effect), size))


def _wanted(fitted: Fitted) -> list[str]:
    return [name for effect in fitted.template.effects for name in effect.beside if name not in fitted.names]


def shape_of(start: Candidate) -> tuple[float, ...]:
    """What `scaled` leaves as it is."""
    about = parameters(start.effect)
    return tuple(float(getattr(start.effect, name)) for name in about if about[name]["neutral"] != 0.0)
