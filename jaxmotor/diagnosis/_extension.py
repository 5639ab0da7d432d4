"""What the usual effects do not explain: rare laws, curves learned over a coordinate, disturbances of this recording.

Where the effects that were found leave something, each law that is sought last is fitted beside them, beside each of
them left out, and beside none. They stand by the same evidence as all effects: where one of them does the work of
effects that only imitated it, those go.
"""

import itertools
import math
from collections.abc import Callable, Iterable, Sequence

from jaxmotor.diagnosis._bends import with_bends
from jaxmotor.diagnosis._found import COARSE, EXPLAINED, Found
from jaxmotor.diagnosis._free import impossible, with_effect, without_effect
from jaxmotor.diagnosis._moments import finest_s, nearby, placed
from jaxmotor.diagnosis._parallel import side_by_side
from jaxmotor.diagnosis._residual_dependence import Dependence
from jaxmotor.diagnosis._score_test import best_beside
from jaxmotor.diagnosis._search import GROWS, LEAST, PROMISE, Search
from jaxmotor.diagnosis._solve import Fitted
from jaxmotor.diagnosis._visited import FAR
from jaxmotor.motor import Motor
from jaxmotor.motor.effects import (
    LEARNED,
    OF_LOG,
    AbstractDisturbance,
    AbstractEffect,
    AbstractLearnedEffect,
    AbstractStepInTime,
    parameters,
)

MORE = 2
"""Of such laws in one motor at most."""
FITTED = 2
"""Of a law's starts, the best by their scores."""
BESIDE = 0.05
"""Share of what the linear motor leaves: beside effects that leave less a curve or a disturbance is sought, but not
at once in their place."""
Seen = Callable[[Fitted], Iterable[Dependence]]


def extended(search: Search, seen: Seen, is_explained: Callable[[Fitted], bool]) -> Found:
    """What `search` finds, with such laws where the others leave something that is not explained.

    `seen` tells what the residual of a motor depends on.
    """

    def last(own: Fitted) -> None:
        starts = _starts(search, own, seen(own))
        _try(search, [own], starts, search.least(own, LEAST))
        _in_place_of_laws(search, own, [start for start in starts if start.name in LEARNED])
        search.again([own])
        search.extend_least()
        if own is search.linear or search.explained.share_left(own, search.linear.chi2) < BESIDE:
            return
        _try(search, [search.linear], starts, own.chi2)
        helpful = [start for start in starts if _helps(search, own, start)]
        if helpful:
            _try(search, search.without_each(own), helpful, search.visited.best().chi2)

    found = search.run(last)
    if is_explained(found.fitted):
        return _beside_curves(search, _of_one_law(search, _of_known_laws(search, found)))
    for _ in range(MORE):
        before = set(found.fitted.names)
        own = search.visited.fitted.get(frozenset(before), found.fitted)
        search.extend_learned(own)
        last(own)
        found = search.as_found(search.visited.best())
        if is_explained(found.fitted):
            return _of_known_laws(search, found)
        if set(found.fitted.names) == before:
            break
    return found


def _of_known_laws(search: Search, found: Found) -> Found:
    """`found`, or two known laws of different families in the place of a curve over the coordinate that both depend on,
    such as Coulomb friction and drag: alone neither explains what the curve does."""
    own = search.visited.fitted.get(frozenset(found.fitted.names), found.fitted)
    for curve in (effect for effect in own.motor.effects if effect.name in LEARNED and effect.over):
        rest = search.solver.fit(without_effect(own.motor, curve.name), own, COARSE)
        laws = [law for law in search.solver.request.asked() if law.over == curve.over and law.name not in LEARNED]
        starts = [start for law in laws for start in law.starts(search.rig)]
        _try(search, [rest], starts, math.inf)
        for one in search.visited.longer(rest):
            [added] = [effect for effect in one.motor.effects if effect.name not in rest.names]
            if type(added) in laws:
                _try(search, [one], [start for start in starts if start.family != added.family], FAR * own.chi2)
    best = search.visited.best()
    return found if set(best.names) == set(own.names) else search.as_found(best)


def _of_one_law(search: Search, found: Found) -> Found:
    """`found`, or one law in the place of two, where both leave but noise: a learned one in the place of all, or one
    over the coordinate that two of them depend on. A disturbance is no law: beside it one alone imitates none."""
    own = search.visited.fitted.get(frozenset(found.fitted.names), found.fitted)
    laws = [effect for effect in own.template.effects if not isinstance(effect, (AbstractDisturbance, *OF_LOG))]
    if len(laws) < 2 or own.chi2 > EXPLAINED:
        return found
    last = [effect for effect in search.solver.request.asked() if effect.sought_last]
    learned = [effect for effect in last if effect.name in LEARNED]
    bar = FAR * own.chi2
    _try(search, [search.linear], [start for effect in learned for start in effect.starts(search.rig)], bar)
    over = [type(effect).over for effect in own.motor.effects]
    twice = {one for one in over if one and over.count(one) > 1}
    if twice:
        rest = own.motor
        for effect in own.motor.effects:
            rest = without_effect(rest, effect.name) if type(effect).over in twice else rest
        base = search.solver.fit(rest, own, COARSE)
        _try(search, [base], [start for one in last if one.over in twice for start in one.starts(search.rig)], bar)
    best = search.visited.best()
    return found if set(best.names) == set(own.names) else search.as_found(best)


def _beside_curves(search: Search, found: Found) -> Found:
    """`found`; of a log whose noise is not known, with a curve beside its laws or in the place of one, if that predicts
    blocks left out better: a law that imitates another one may leave less than the noise was taken for."""
    if search.solver.noise_known or not found.named:
        return found
    own = search.visited.fitted.get(frozenset(found.fitted.names), found.fitted)
    starts = [
        start for law in LEARNED.values() if law in search.solver.request.asked() for start in law.starts(search.rig)
    ]
    _try(search, [own], starts, search.least(own, LEAST))
    _in_place_of_laws(search, own, starts)
    if any(_helps(search, own, start) for start in starts):
        _try(search, search.without_each(own), starts, FAR * search.visited.best().chi2)
    best = search.visited.best()
    now = search.as_found(best)
    return now if set(best.names) == set(own.names) else _of_known_laws(search, now)


def _in_place_of_laws(search: Search, own: Fitted, curves: list[AbstractEffect]) -> None:
    """Fit each of `curves` in the place of the laws of `own` that it contains: what else over their coordinate would do
    as well. Also from one that is such a law: over the angle a fit from none ends in a local minimum, where the shaft
    stops at another place."""
    for curve in curves:
        inside = set(search.relations.simpler(curve.name)).intersection(own.names)
        if inside:
            rest, alike = own.motor, curve
            for effect in (effect for effect in own.motor.effects if effect.name in inside):
                rest = without_effect(rest, effect.name)
                alike = alike.like(effect) if isinstance(alike, AbstractLearnedEffect) else alike
            if alike is not curve:
                search.visited.keep([search.solver.fit(with_effect(rest, alike), own, COARSE)])
            known = search.visited.fitted.get(frozenset(own.names) - inside)
            base = search.solver.fit(rest, own, COARSE) if known is None else known
            _try(search, [base], [curve], FAR * search.visited.best().chi2)


def _starts(search: Search, own: Fitted, dependences: Iterable[Dependence]) -> list[AbstractEffect]:
    """What may be tried beside `own`, whose residual `dependences` are of."""
    last = [effect for effect in search.solver.request.asked() if effect.sought_last]
    plain = [start for effect in last for start in effect.starts(search.rig)]
    waves = [one.frequency_Hz for one in dependences if one.frequency_Hz is not None and one.beyond_chance]
    starts: list[AbstractEffect] = []
    for start in plain:
        if isinstance(start, AbstractStepInTime):
            starts.append(placed(search.solver, own, start, search.rig))
        elif "frequency_Hz" in parameters(start):
            starts += [start.but(frequency_Hz=wave) for wave in waves[:1]]
        else:
            starts.append(start)
    return starts


def _helps(search: Search, own: Fitted, start: AbstractEffect) -> bool:
    """A motor with it, beside the effects of `own` or alone, is about as likely as the best one."""
    weight = search.visited.weights()
    having = [weight.get(names | {start.name}, 0.0) for names in (frozenset(own.names), search.own)]
    return max(having) > GROWS * max(weight.values())


def _try(search: Search, bases: list[Fitted], starts: list[AbstractEffect], bar: float) -> None:
    """Fit each of `bases` with each law that `starts` are of: first those that are linear in what is fitted, whose fits
    are short, given up where chi2 will not come below `bar`; then the others, given up where they will not come near
    to the best motor, either."""
    short = (*LEARNED.values(), AbstractStepInTime)
    _fit_each(search, bases, [start for start in starts if isinstance(start, short)], bar)
    others = [start for start in starts if not isinstance(start, short)]
    _fit_each(search, bases, others, min(bar, FAR * search.visited.best().chi2))


def _fit_each(search: Search, bases: list[Fitted], starts: Sequence[AbstractEffect], bar: float) -> None:
    """Of the fits, those whose chi2 will not come below `bar` are given up."""
    laws = [tuple(own) for _, own in itertools.groupby(starts, lambda start: start.name)]
    tasks = [
        (base, own)
        for base in bases
        for own in laws
        if own[0].name not in search.relations.barred(base.template.effects)
        and frozenset((*base.names, own[0].name)) not in search.visited.fitted
    ]

    def fits(task: tuple[Fitted, tuple[AbstractEffect, ...]]) -> list[Fitted]:
        base, own = task
        begun = [search.solver.fit(motor, base, COARSE, bar=bar) for motor in _begins(search, base, own)]
        bent = [with_bends(search.solver, base, one, COARSE, bar) for one in begun]
        return [_without_gone(search, base, one) for one in bent]

    for found in side_by_side(fits, tasks):
        search.visited.keep(found)


def _without_gone(search: Search, base: Fitted, fitted: Fitted) -> Fitted:
    """`fitted` without effects of `base` that only imitated its new law: beside that they have no size that the rig can
    have."""
    gone, rest = impossible(fitted.motor, search.rig), fitted.motor
    if not gone or not set(gone) <= set(base.names):
        return fitted
    for name in gone:
        rest = without_effect(rest, name)
    return search.solver.fit(rest, fitted, COARSE)


def _begins(search: Search, base: Fitted, starts: tuple[AbstractEffect, ...]) -> list[Motor]:
    """`base` with the best of one law's `starts`."""
    if isinstance(starts[0], AbstractStepInTime):
        steps = [start for start in starts if isinstance(start, AbstractStepInTime)]
        starts = tuple(nearby(search.solver, base, start, finest_s(search.rig), search.rig) for start in steps)
    elif not isinstance(starts[0], (*LEARNED.values(), AbstractDisturbance)):
        scored = best_beside(search.solver, base, starts)[:FITTED]
        return [start.motor for start in scored if base.chi2 - start.chi2 > PROMISE * base.chi2]
    return [with_effect(base.motor, start) for start in starts]
