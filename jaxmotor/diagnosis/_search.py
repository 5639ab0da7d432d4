"""From a linear motor to the effects that explain what it gets wrong.

Leaders are ranked by their scores and fitted; several of them are extended further, because the best single effect of
two need not be one of them; every effect that is named is tried against each alternative in its place.
"""

import dataclasses
import functools
import math

import numpy as np

from jaxmotor.diagnosis._free import is_wide, with_effect, without_effect
from jaxmotor.diagnosis._parallel import side_by_side
from jaxmotor.diagnosis._polish import polished
from jaxmotor.diagnosis._score_test import Candidate, EffectColumns, candidates
from jaxmotor.diagnosis._solve import STEPS, Fitted, Solver, square_of
from jaxmotor.motor import Motor
from jaxmotor.motor.effects import EFFECTS, free_size, parameters
from jaxmotor.motor.effects._base import AbstractLoadEffect

LEADERS = 7
"""Effects that are fitted of those that the scores rank, and those that scores judge badly: a law that changes the
motor as a whole is not a small multiple of anything."""
ALWAYS = ("electrical_pole", "transport_delay", "coast_drive", "current_limit", "shaft_compliance", "backlash")
FIRST = 2
"""Leaders that are fitted with patience before it is known whether anything is left for the others to explain."""
LATER = 5
"""The same, beside an effect that was found."""
LIKELY = 0.4
"""Part of what the best score explains that a rough law's must, where another effect explains everything."""
DOUBT = 2.0
"""chi2 per sample above which that is done, and up to which scores are taken at their word: small effects are small
multiples of themselves."""
LITTLE = 0.5
"""Part of chi2 that the linear motor's first effect must not leave over, or it is tried from another start, too."""
HINT = 0.25
"""Part of `GAIN` that such a score must promise."""
BEAM = 3
FAR = (12.0, 3.0)
"""Leaders of one effect, and of two, are extended that leave at most this many times as much over as the best, and in
any case laws that the best contains: a law with more parameters may take up what another effect does."""
RICHER = 0.7
"""Part of what a law leaves over that a law which contains it must not exceed, to be extended in its place."""
DEPTH = 3
"""Effects in one motor at most."""
GAIN = 0.02
"""Of chi2 per sample, and `RELATIVE` of it, that an effect must bring: rounding is not quite white, and effects
that are not there bring up to 0.008."""
FEW = 50.0
"""Of chi2 in all, likewise: a short recording shows less."""
RELATIVE = 0.01
SHARE = 0.5
"""Of what is left over that every effect after the first must explain."""
ENOUGH = 1.03
"""chi2 per sample at which nothing is looked for any more."""
NEARLY = 1.06
"""The same for the effects beside it, which are then tried with less patience: true motors scatter up to here."""
EXPLAINED = 1.15
"""chi2 per sample up to which nothing is left over; two laws are not that exact themselves."""
ROUGH = {"missed_counts": 2.1, "backlash": 1.5}
"""The same where an effect is named whose law is not exact: lost counts are rounded twice, and where in its gap a load
hangs at the start of an experiment is not known."""
COARSE = 2e-4
"""Part of chi2 that a step of a fit must promise while effects are compared; `FINE` once they are chosen."""
FINE = 1e-6
HASTY = 6
"""Steps of a fit where another effect already explains everything: enough for one that would do as well."""
RIVALRY = 1.0
"""chi2 per sample above the best beyond which nobody asks how much worse a rival is, exactly."""
TIE = 0.003
"""Difference of costs, in parts of chi2, that decides nothing; and `FOG` of what is left over, while much is."""
FOG = 0.015
USUAL = ("coulomb_friction", "transport_delay", "electrical_pole", "dead_zone", "voltage_offset", "load_torque")
"""Of effects that explain a recording equally well, in this order; others come after them."""
KIN = (
    ("coulomb_friction", "dead_zone", "voltage_offset", "load_torque"),
    ("electrical_pole", "sensor_lag", "transport_delay"),
)
"""Effects of one size each that are one while the motor turns one way, or changes slowly: where one of them is found,
the others are near."""
SMALL = 1e-9
SAME = (
    {"voltage_offset", "load_torque"},
    {"coulomb_friction", "stiction"},
    {"shaft_compliance", "backlash"},
    {"electrical_pole", "coast_drive"},
)
"""Effects that say the same, or that cannot be together in one motor."""


@dataclasses.dataclass(frozen=True, eq=False)
class Named:
    """One effect of the motor that was found, and what else could be in its place."""

    name: str
    rivals: tuple[Fitted, ...]
    """Motors with another effect in its place, the best first."""
    probability: float | None = None
    """Where the noise is not known: the sum of the weights of all models that have it."""
    with_equal: float | None = None
    """The same with effects that are not told from it."""
    equal: frozenset[str] | None = None
    """The same: effects of `rivals` that blocks left out do not tell from it."""


@dataclasses.dataclass(frozen=True, eq=False)
class Found:
    """Where the search ended."""

    linear: Fitted
    fitted: Fitted
    named: tuple[Named, ...]


def enough(names: tuple[str, ...], otherwise: float) -> float:
    """chi2 per sample at which a motor with these effects leaves nothing over."""
    return max([otherwise, *(ROUGH[name] for name in names if name in ROUGH)])


def cost(fitted: Fitted) -> float:
    """chi2 per sample, and a price for each parameter: in parts of what is left over, and at the floor a little.

    A parameter that is not there brings 1/n per sample; that of a short recording asks for log(n)/n (Schwarz).
    """
    number = sum(map(free_size, fitted.template.effects)) + sum(_thresholds(fitted))
    count = max(len(fitted.residual), 3)
    return fitted.chi2 + number * (0.01 * max(fitted.chi2 - 1, 0.0) + max(0.002, math.log(count) / count))


def ordered(fitted: list[Fitted]) -> list[Fitted]:
    """By cost; of those that do as well as the best, the one that motors more often have."""
    fitted = sorted(fitted, key=cost)
    if not fitted:
        return []
    chi2 = fitted[0].chi2
    limit = cost(fitted[0]) + TIE * max(chi2, 1.0) + FOG * max(chi2 - enough(fitted[0].names, EXPLAINED), 0.0)
    tied = [one for one in fitted if cost(one) <= limit]
    return sorted(tied, key=_rarity) + fitted[len(tied) :]


def _best_each(found: list[Fitted]) -> list[Fitted]:
    """The best fit of each set of effects, in order."""
    best: dict[tuple[str, ...], Fitted] = {}
    for fitted in found:
        if np.isfinite(fitted.chi2) and (fitted.names not in best or fitted.chi2 < best[fitted.names].chi2):
            best[fitted.names] = fitted
    return ordered(list(best.values()))


def _rarity(fitted: Fitted) -> tuple[int, ...]:
    return tuple(USUAL.index(name) if name in USUAL else len(USUAL) for name in fitted.names)


class Search:
    """For the effects that the residual of `linear` asks for. What was fitted once is not fitted again."""

    def __init__(self, solver: Solver, first: Motor, linear: Fitted, effect_columns: tuple[EffectColumns, ...]):
        self.solver, self.linear, self.effect_columns = solver, linear, effect_columns
        self.first = first
        """As identified, with a voltage offset along: that takes up friction where the motor turns one way."""
        self.known: dict[frozenset[str], list[Fitted]] = {}
        """Extensions of motors by their effects' names: a stage is not fitted twice."""

    def run(self) -> Found:
        """The effects; none if nothing pays."""
        best, beam, halves = self.linear, [self.linear], []
        for depth in range(DEPTH):
            extended = [fitted for found in self.extended(beam) for fitted in found]
            extended += [fitted for half in halves for fitted in self.completions(half)]
            beam = _plain(_different(ordered(extended)))[:BEAM]
            halves = [fitted for fitted in extended if fitted not in beam and _beside(fitted)]
            if not beam or not _pays(best, beam[0], depth):
                break
            best = beam[0]
            if best.chi2 < enough(best.names, ENOUGH):
                break
            near = FAR[min(depth, 1)] * max(best.chi2 - 1, GAIN)
            beam = [fitted for fitted in beam if fitted.chi2 - 1 < near or _is_simpler(fitted, best)]
        return self.settled(self.pruned(best))

    def settled(self, fitted: Fitted) -> Found:
        """`fitted`, or what does better in its place, with the rivals of each effect."""
        best, named = self.contested(fitted)
        return Found(self.linear, self.refined(best) if named else self.linear, named)

    def extended(self, bases: list[Fitted], holder: Fitted | None = None) -> list[list[Fitted]]:
        """Each of `bases` with one effect more, fitted, the best first; against a `holder` only what scores well.

        All of them side by side: what is fitted after one of them explained everything, is fitted with less patience.
        """
        new = [base for base in bases if frozenset(base.names) not in self.known]
        ranked = side_by_side(lambda base: candidates(base, self.effect_columns), new)
        stages = [
            _Stage(base, its, _leaders(base, its, holder is not None)) for base, its in zip(new, ranked, strict=True)
        ]
        self.fit(stages, math.inf if holder is None else holder.chi2)
        for stage in stages:
            self.known[frozenset(stage.base.names)] = _best_each(stage.found)
        return [self.known[frozenset(base.names)] for base in bases]

    def fit(self, stages: list["_Stage"], least: float) -> None:
        """Each stage's leaders: the first ones, then the rest, then laws of two masses, which take long, and kin."""
        for turn in range(4):
            least = min([least, *(fitted.chi2 for stage in stages for fitted in stage.found)])
            tasks = [(stage, stage.ranked[name]) for stage in stages for name in stage.turn(turn, least)]
            best = functools.partial(self.best_of, least=least)
            fitted = side_by_side(lambda task, best=best: best(task[0].base, task[1]), tasks)
            for (stage, _), one in zip(tasks, fitted, strict=True):
                stage.found.append(one)
        for stage in stages:
            stage.found.extend(self.likewise(ordered(stage.found)[:1], stage.ranked))

    def likewise(self, best: list[Fitted], ranked: dict[str, list[Candidate]]) -> list[Fitted]:
        """Where the effect that was added last is one of `KIN`, the others in its place, from its own motor."""
        last = best[0].motor.effects[-1] if best else None
        kin = next((names for names in KIN if last is not None and last.name in names), ())
        if last is None or not kin:
            return []
        [size] = (abs(float(getattr(last, name))) for name in parameters(last))
        bare = without_effect(best[0].motor, last.name)
        barred = _barred(best[0].names[:-1]) | set(best[0].names)
        others = [name for name in kin if name in ranked and name not in barred]
        starts = [EFFECTS[name].of(**dict.fromkeys(parameters(EFFECTS[name]), max(size, SMALL))) for name in others]
        bar = best[0].chi2 + RIVALRY
        return side_by_side(
            lambda one: self.solver.fit(with_effect(bare, one), best[0].speeds, COARSE, bar=bar), starts
        )

    def completions(self, half: Fitted) -> list[Fitted]:
        """`half`, which alone fits no motor, with what it wants beside it."""
        ranked = candidates(half, self.effect_columns)
        return [self.best_of(half, ranked[name]) for name in _beside(half) if name in ranked]

    def best_of(self, base: Fitted, starts: list[Candidate], least: float = math.inf) -> Fitted:
        """`base` with the effect fitted from its best starts; with less patience where another explains all.

        `least` is the chi2 that another effect in its place leaves.
        """
        explained = least < NEARLY
        steps, bar = HASTY if explained else STEPS, self.bar(base, least)
        if starts[0].effect.beside:
            bar = math.inf
        # Of laws with a single shape all starts lead to one place.
        single = explained or len({shape_of(start) for start in starts}) == 1
        fit = functools.partial(self.solver.fit, speeds=base.speeds, tolerance=COARSE, steps=steps, bar=bar)
        fitted: list[Fitted] = []
        for start in starts[: 1 if single else 2]:
            fitted.append(fit(start.motor))
            if base.chi2 > DOUBT and not base.names and min(least, fitted[-1].chi2) > LITTLE * base.chi2:
                # Without the effect, gain and pole may have gone where it does not show.
                fitted.append(fit(with_effect(self.first, start.effect)))
            if min(one.chi2 for one in fitted) < ENOUGH:
                break
        return min(fitted, key=lambda one: one.chi2)

    def bar(self, base: Fitted, least: float) -> float:
        """chi2 that a further effect must reach to be worth its fit."""
        if least < NEARLY:
            return least + RIVALRY
        return min(base.chi2 - 0.5 * GAIN, 1 + FAR[min(len(base.names), 1)] * max(least - 1, GAIN))

    def refined(self, fitted: Fitted) -> Fitted:
        fitted = self.solver.fit(fitted.motor, fitted.speeds, FINE)
        return polished(self.solver, fitted, COARSE) if is_wide(fitted.template.effects) else fitted

    def pruned(self, fitted: Fitted) -> Fitted:
        """Without effects that it does not need: those that others took over."""
        while len(fitted.names) > 1:
            shorter = side_by_side(functools.partial(self.without, fitted), fitted.names)
            best = ordered(shorter)[0]
            if _pays(best, fitted, len(fitted.names) - 1):
                return fitted
            fitted = best
        return fitted

    def without(self, fitted: Fitted, name: str) -> Fitted:
        return self.solver.fit(without_effect(fitted.motor, name), fitted.speeds, COARSE)

    def contested(self, fitted: Fitted) -> tuple[Fitted, tuple[Named, ...]]:
        """`fitted` with each effect exchanged for any that does better in its place, and the rivals of each."""
        for _ in fitted.names:
            named = self.named(fitted)
            best = ordered([fitted, *(one.rivals[0] for one in named if one.rivals)])[0]
            if best is fitted:
                return fitted, named
            fitted = best
        return fitted, self.named(fitted)

    def named(self, fitted: Fitted) -> tuple[Named, ...]:
        """The effects of `fitted`, each with what else could be in its place."""
        alone = len(fitted.names) == 1
        bases = [self.linear] if alone else side_by_side(functools.partial(self.without, fitted), fitted.names)
        return tuple(
            Named(name, tuple(other for other in others if name not in other.names))
            for name, others in zip(fitted.names, self.extended(bases, fitted), strict=True)
        )


@dataclasses.dataclass(frozen=True, eq=False)
class _Stage:
    """A motor that is given one effect more."""

    base: Fitted
    ranked: dict[str, list[Candidate]]
    leaders: list[str]
    found: list[Fitted] = dataclasses.field(default_factory=list)

    def turn(self, number: int, least: float) -> list[str]:
        """Leaders whose turn it is, 0 to 3; `least` is the chi2 of the best before."""
        loads = [name for name in self.leaders if isinstance(self.ranked[name][0].effect, AbstractLoadEffect)]
        others = [name for name in self.leaders if name not in loads]
        rough = [name for name in loads if is_wide((self.ranked[name][0].effect,))]
        if number == 3 and least < NEARLY:
            return _as_good(self.ranked, rough)
        return (others[:FIRST], others[FIRST:], [name for name in loads if name not in rough], rough)[number]


def _leaders(base: Fitted, ranked: dict[str, list[Candidate]], contest: bool) -> list[str]:
    """Effects worth a fit. Far from the floor scores may mislead; near it they are good to a few parts of the gain."""
    barred = _barred(base.names)
    ranked = {name: starts for name, starts in ranked.items() if name not in barred}
    beside = _beside(base)
    order = sorted(ranked, key=lambda name: (name not in beside, ranked[name][0].chi2))
    if not base.names:
        return _first_leaders(base, ranked, order)
    if contest:
        return order[:LATER]
    if base.chi2 > DOUBT:
        return order[:LATER] + [name for name in ALWAYS if name in order[LATER : 2 * LATER]]
    return [name for name in order if name in beside or base.chi2 - ranked[name][0].chi2 > 0.5 * GAIN][:LATER]


def _first_leaders(base: Fitted, ranked: dict[str, list[Candidate]], order: list[str]) -> list[str]:
    """Of the linear motor."""
    if base.chi2 > DOUBT:
        return order[:LEADERS] + [name for name in ALWAYS if name in order[LEADERS:]]
    promising = [name for name in order if base.chi2 - ranked[name][0].chi2 > HINT * GAIN]
    always = [name for name in ALWAYS if name in ranked and not is_wide((ranked[name][0].effect,))]
    return list(dict.fromkeys(promising[:LEADERS] + (always if base.chi2 > ENOUGH else [])))


def _as_good(ranked: dict[str, list[Candidate]], rough: list[str]) -> list[str]:
    """Of `rough` laws, those that by their score may do as well as an effect that leaves nothing over."""
    scores = [starts[0].chi2 for starts in ranked.values()]
    least, none = min(scores), max(scores)
    return [name for name in rough if none - ranked[name][0].chi2 > LIKELY * (none - least)]


def _barred(names: tuple[str, ...]) -> set[str]:
    """Effects that cannot be in a motor with `names`."""
    return {name for same in SAME for own in names if own in same for name in same}


def _beside(fitted: Fitted) -> list[str]:
    """What its effects want beside them, and it has not."""
    return [name for effect in fitted.template.effects for name in effect.beside if name not in fitted.names]


def _pays(before: Fitted, after: Fitted, number: int) -> bool:
    """`after` is worth one effect more than `before`, which has `number` of them."""
    gain = before.chi2 - after.chi2
    if (
        gain < max(GAIN, FEW / max(len(after.residual), 1))
        or gain < RELATIVE * before.chi2
        or cost(after) > cost(before)
    ):
        return False
    return number == 0 or gain > SHARE * (before.chi2 - 1)


def _different(fitted: list[Fitted]) -> list[Fitted]:
    """Without those that say what one before them says: other names, the same residuals."""
    kept: list[Fitted] = []
    for one in fitted:
        near = TIE * max(one.chi2, 1.0) * len(one.residual)
        if not any(square_of(one.residual - other.residual) < near for other in kept):
            kept.append(one)
    return kept


def _plain(fitted: list[Fitted]) -> list[Fitted]:
    """Without those whose law contains that of another and leaves nearly as much: an exchange comes to them later."""

    def in_vain(one: Fitted, other: Fitted) -> bool:
        return _is_simpler(other, one) and one.chi2 - 1 > RICHER * (other.chi2 - 1)

    return [one for one in fitted if not any(in_vain(one, other) for other in fitted)]


def _is_simpler(one: Fitted, other: Fitted) -> bool:
    """`one` has in the place of one law of `other` a law that this contains."""
    own, others = set(one.names) - set(other.names), set(other.names) - set(one.names)
    return len(own) == len(others) == 1 and own.pop() in EFFECTS[others.pop()].contains


def shape_of(start: Candidate) -> tuple[float, ...]:
    """What `scaled` leaves as it is."""
    about = parameters(start.effect)
    return tuple(float(getattr(start.effect, name)) for name in about if about[name]["neutral"] != 0.0)


def _thresholds(fitted: Fitted) -> list[int]:
    """Parameters that are tried out, not fitted."""
    return [
        sum(about["kind"] == "fixed" for about in parameters(effect).values()) for effect in fitted.template.effects
    ]
