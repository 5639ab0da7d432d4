"""From a linear motor to the effects that explain what it gets wrong.

Leaders are ranked by their scores and fitted; several of them are extended further, because the best single effect of
two need not be one of them; every effect that is named is tried against each alternative in its place.
"""

import dataclasses

import numpy as np

from jaxmotor.diagnosis._free import with_effect, without_effect
from jaxmotor.diagnosis._solve import STEPS, Fitted, Solver, square_of
from jaxmotor.diagnosis._suspects import Secant, Suspect, suspects
from jaxmotor.motor.effects import free_size, parameters

LEADERS = 7
"""Effects that are fitted of those that the scores rank, and those that scores judge badly: a law that changes the
motor as a whole is not a small multiple of anything."""
ALWAYS = ("electrical_pole", "transport_delay", "coast_drive", "current_limit", "shaft_compliance", "backlash")
LATER = 5
"""The same, beside an effect that was found."""
DOUBT = 2.0
"""chi2 per sample above which that is done."""
BEAM = 3
FAR = 12.0
"""Leaders are extended that leave at most this many times as much over as the best of them."""
DEPTH = 3
"""Effects in one motor at most."""
GAIN = 0.02
"""Of chi2 per sample, and `RELATIVE` of it, that an effect must bring: rounding is not quite white, and effects
that are not there bring up to 0.008."""
RELATIVE = 0.01
SHARE = 0.5
"""Of what is left over that every effect after the first must explain."""
ENOUGH = 1.03
"""chi2 per sample at which nothing is looked for any more."""
ROUGH = {"missed_counts": 2.1, "backlash": 1.5}
"""The same where an effect is named whose law is not exact: lost counts are rounded twice, and where in its gap a load
hangs at the start of an experiment is not known."""
COARSE = 2e-4
"""Part of chi2 that a step of a fit must promise while effects are compared; `FINE` once they are chosen."""
FINE = 1e-6
HASTY = 6
"""Steps of a fit where another effect already explains everything: enough for one that would do as well."""
TIE = 0.003
"""Difference of costs, in parts of chi2, that decides nothing."""
USUAL = ("coulomb_friction", "transport_delay", "electrical_pole", "dead_zone", "voltage_offset", "load_torque")
"""Of effects that explain a recording equally well, in this order; others come after them."""
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
    """chi2 per sample, and a price for each parameter: in parts of what is left over, and at the floor a little."""
    number = sum(map(free_size, fitted.template.effects)) + sum(_thresholds(fitted))
    return fitted.chi2 + number * (0.01 * max(fitted.chi2 - 1, 0.0) + 0.002)


def ordered(fitted: list[Fitted]) -> list[Fitted]:
    """By cost; of those that do as well as the best, the one that motors more often have."""
    fitted = sorted(fitted, key=cost)
    if not fitted:
        return []
    limit = cost(fitted[0]) + TIE * max(fitted[0].chi2, 1.0)
    tied = [one for one in fitted if cost(one) <= limit]
    return sorted(tied, key=_rarity) + fitted[len(tied) :]


def _rarity(fitted: Fitted) -> tuple[int, ...]:
    return tuple(USUAL.index(name) if name in USUAL else len(USUAL) for name in fitted.names)


def search(solver: Solver, linear: Fitted, secants: tuple[Secant, ...]) -> Found:
    """The effects that the residual of `linear` asks for; none if nothing pays."""
    return _Search(solver, linear, secants).run()


class _Search:
    def __init__(self, solver: Solver, linear: Fitted, secants: tuple[Secant, ...]):
        self.solver, self.linear, self.secants = solver, linear, secants
        self.known: dict[frozenset[str], list[Fitted]] = {}
        """Extensions of motors by their effects' names: a stage is not fitted twice."""

    def run(self) -> Found:
        best, beam = self.linear, [self.linear]
        for depth in range(DEPTH):
            extended = [fitted for base in beam for fitted in self.extensions(base)]
            beam = _different(ordered(extended))[:BEAM]
            if not beam or not _pays(best, beam[0], depth):
                break
            best = beam[0]
            if best.chi2 < enough(best.names, ENOUGH):
                break
            beam = [fitted for fitted in beam if fitted.chi2 - 1 < FAR * max(best.chi2 - 1, GAIN)]
        best = self.pruned(best)
        best, named = self.contested(best)
        return Found(self.linear, self.refined(best), named)

    def extensions(self, base: Fitted, contest: bool = False) -> list[Fitted]:
        """`base` with one effect more, fitted, the best first; in a contest only what scores well."""
        key = frozenset(base.names)
        if key not in self.known:
            ranked = suspects(base, self.secants)
            leaders = _leaders(base, ranked, contest)
            found: list[Fitted] = []
            for name in leaders:
                explained = any(fitted.chi2 < ENOUGH for fitted in found)
                found.append(self.best_of(base, ranked[name], explained))
            self.known[key] = ordered([fitted for fitted in found if np.isfinite(fitted.chi2)])
        return self.known[key]

    def best_of(self, base: Fitted, starts: list[Suspect], explained: bool) -> Fitted:
        """`base` with the effect fitted from its best starts; with less patience where another has `explained` all."""
        best: Fitted | None = None
        # Of laws with a single shape all starts lead to one place.
        single = explained or len({_shape(start) for start in starts}) == 1
        for start in starts[: 1 if single else 2]:
            motor = with_effect(base.motor, start.effect)
            fitted = self.solver.fit(motor, base.speeds, COARSE, HASTY if explained else STEPS)
            if best is None or fitted.chi2 < best.chi2:
                best = fitted
            if best.chi2 < ENOUGH:
                break
        assert best is not None
        return best

    def refined(self, fitted: Fitted) -> Fitted:
        return self.solver.fit(fitted.motor, fitted.speeds, FINE)

    def pruned(self, fitted: Fitted) -> Fitted:
        """Without effects that it does not need: those that others took over."""
        while len(fitted.names) > 1:
            shorter = [self.without(fitted, name) for name in fitted.names]
            best = ordered(shorter)[0]
            if _pays(best, fitted, len(fitted.names) - 1):
                return fitted
            fitted = best
        return fitted

    def without(self, fitted: Fitted, name: str) -> Fitted:
        return self.solver.fit(without_effect(fitted.motor, name), fitted.speeds, COARSE)

    def contested(self, fitted: Fitted) -> tuple[Fitted, tuple[Named, ...]]:
        """`fitted` with each effect exchanged for any that does better in its place, and the rivals of each."""
        named: list[Named] = []
        for _ in range(len(fitted.names) + 1):
            named = []
            for name in fitted.names:
                base = self.linear if len(fitted.names) == 1 else self.without(fitted, name)
                others = [other for other in self.extensions(base, contest=True) if name not in other.names]
                if others and ordered([fitted, others[0]])[0] is others[0]:
                    fitted = others[0]
                    break
                named.append(Named(name, tuple(others)))
            else:
                return fitted, tuple(named)
        return fitted, tuple(named)


def _leaders(base: Fitted, ranked: dict[str, list[Suspect]], contest: bool) -> list[str]:
    """Effects worth a fit. Far from the floor scores may mislead; near it they are good to a few parts of the gain."""
    barred = {name for same in SAME for own in base.names if own in same for name in same}
    ranked = {name: starts for name, starts in ranked.items() if name not in barred}
    order = sorted(ranked, key=lambda name: ranked[name][0].chi2)
    if not base.names:
        return order[:LEADERS] + [name for name in ALWAYS if name in order[LEADERS:]]
    if contest:
        return order[:LATER]
    if base.chi2 > DOUBT:
        return order[:LATER] + [name for name in ALWAYS if name in order[LATER : 2 * LATER]]
    return [name for name in order if base.chi2 - ranked[name][0].chi2 > 0.5 * GAIN][:LATER]


def _pays(before: Fitted, after: Fitted, number: int) -> bool:
    """`after` is worth one effect more than `before`, which has `number` of them."""
    gain = before.chi2 - after.chi2
    if gain < GAIN or gain < RELATIVE * before.chi2 or cost(after) > cost(before):
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


def _shape(start: Suspect) -> tuple[float, ...]:
    """What `scaled` leaves as it is."""
    about = parameters(start.effect)
    return tuple(float(getattr(start.effect, name)) for name in about if about[name]["neutral"] != 0.0)


def _thresholds(fitted: Fitted) -> list[int]:
    """Parameters that are tried out, not fitted."""
    return [
        sum(about["kind"] == "fixed" for about in parameters(effect).values()) for effect in fitted.template.effects
    ]
