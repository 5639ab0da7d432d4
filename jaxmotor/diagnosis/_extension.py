"""What the usual effects do not explain: rare laws, curves learned over a coordinate, disturbances of this recording.

Where the effects that were found leave something, each law that is sought last is fitted beside them, beside each of
them left out, and beside none. They stand by the same evidence as all effects: where one of them does the work of
effects that only imitated it, those go.
"""

import itertools
from collections.abc import Callable, Iterable

from jaxmotor.diagnosis._found import COARSE, Found
from jaxmotor.diagnosis._free import with_effect
from jaxmotor.diagnosis._looks import Look
from jaxmotor.diagnosis._moments import finest_s, nearby, placed
from jaxmotor.diagnosis._parallel import side_by_side
from jaxmotor.diagnosis._score_test import best_beside
from jaxmotor.diagnosis._search import Search
from jaxmotor.diagnosis._solve import Fitted
from jaxmotor.motor import Motor
from jaxmotor.motor.effects import AbstractEffect, AbstractStepInTime, parameters

MORE = 3
"""Of such laws in one motor at most."""
FITTED = 2
"""Of a law's starts, the best by their scores."""
Seen = Callable[[Found], Iterable[Look]]


def extended(search: Search, found: Found, seen: Seen, is_explained: Callable[[Fitted], bool]) -> Found:
    """`found`, or what it becomes with such laws where it leaves something that is not explained.

    `seen` tells what the residual of a motor depends on.
    """
    for _ in range(MORE):
        if is_explained(found.fitted):
            break
        before = set(found.fitted.names)
        own = search.visited.get(frozenset(before), found.fitted)
        bases = {frozenset(base.names): base for base in (own, *search.without_each(own), search.linear)}
        _try(search, list(bases.values()), _starts(search, own, seen(found)))
        found = search.settled(search.best())
        if set(found.fitted.names) == before:
            break
    return found


def _starts(search: Search, own: Fitted, looks: Iterable[Look]) -> list[AbstractEffect]:
    """What may be tried beside `own`, whose residual `looks` are of."""
    last = [effect for effect in search.solver.request.asked() if effect.sought_last]
    plain = [start for effect in last for start in effect.starts(search.rig)]
    waves = [look.frequency_Hz for look in looks if look.frequency_Hz is not None and look.beyond_chance]
    starts: list[AbstractEffect] = []
    for start in plain:
        if isinstance(start, AbstractStepInTime):
            starts.append(placed(search.solver, own, start, search.rig))
        elif "frequency_Hz" in parameters(start):
            starts += [start.but(frequency_Hz=wave) for wave in waves[:1]]
        else:
            starts.append(start)
    return starts


def _try(search: Search, bases: list[Fitted], starts: list[AbstractEffect]) -> None:
    """Fit each of `bases` with each law that `starts` are of."""
    laws = [tuple(own) for _, own in itertools.groupby(starts, lambda start: start.name)]
    tasks = [
        (base, own)
        for base in bases
        for own in laws
        if own[0].name not in search.relations.barred(base.template.effects)
        and frozenset((*base.names, own[0].name)) not in search.visited
    ]

    def fits(task: tuple[Fitted, tuple[AbstractEffect, ...]]) -> list[Fitted]:
        base, own = task
        return [search.solver.fit(motor, base.speeds, COARSE) for motor in _begins(search, base, own)]

    for found in side_by_side(fits, tasks):
        search.keep(found)


def _begins(search: Search, base: Fitted, starts: tuple[AbstractEffect, ...]) -> list[Motor]:
    """`base` with the best of one law's `starts`."""
    if isinstance(starts[0], AbstractStepInTime):
        steps = [start for start in starts if isinstance(start, AbstractStepInTime)]
        starts = tuple(nearby(search.solver, base, start, finest_s(search.rig), search.rig) for start in steps)
    elif len(starts) > 1:
        return [start.motor for start in best_beside(search.solver, base, starts)[:FITTED]]
    return [with_effect(base.motor, start) for start in starts]
