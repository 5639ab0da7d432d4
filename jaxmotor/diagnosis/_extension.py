"""What no known effect explains: learned as a law of the motor, or found to be a disturbance of this recording.

Where the effects that were found leave something, a curve over the speed, the shaft's angle or the commanded voltage
(`motor/effects/_learned`) and what may have happened from outside (`motor/effects/_disturbance`) are fitted beside
them, beside each of them left out, and beside none. They stand by the same evidence as effects do: where one of them
does the work of effects that only imitated it, those go.
"""

from collections.abc import Callable, Iterable

import numpy as np

from jaxmotor.diagnosis._found import COARSE, Found
from jaxmotor.diagnosis._free import with_each, with_effect
from jaxmotor.diagnosis._looks import Look
from jaxmotor.diagnosis._parallel import side_by_side
from jaxmotor.diagnosis._search import Search
from jaxmotor.diagnosis._solve import Fitted, Solver, square_of
from jaxmotor.motor.effects import DISTURBANCES, LEARNED, AbstractEffect, AbstractStepInTime, parameters

MORE = 3
"""Learned laws and disturbances in one motor at most."""
MOMENTS = 49
"""Moments at which a step is tried at once."""


def extended(
    search: Search, found: Found, seen: Callable[[Found], Iterable[Look]], is_explained: Callable[[Fitted], bool]
) -> Found:
    """`found`, or what it becomes with such laws where it leaves something that is not explained.

    `seen` tells what the residual of a motor depends on.
    """
    for _ in range(MORE):
        if is_explained(found.fitted):
            break
        before = set(found.fitted.names)
        own = search.visited.get(frozenset(before), found.fitted)
        bases = {frozenset(base.names): base for base in (own, *search.without_each(own), search.linear)}
        _try(search, list(bases.values()), _starts(search, own, [look for look in seen(found) if look.beyond_chance]))
        found = search.settled(search.best())
        if set(found.fitted.names) == before:
            break
    return found


def _starts(search: Search, own: Fitted, looks: list[Look]) -> list[AbstractEffect]:
    """Laws that the recording may show, of no size as yet, and disturbances; `looks` are those of `own`'s residual."""
    starts = [start for effect in LEARNED.values() for start in effect.starts(search.rig)]
    for effect in DISTURBANCES.values():
        for start in effect.starts(search.rig):
            if isinstance(start, AbstractStepInTime):
                starts.append(_placed(search, own, start, 0.5 * search.rig.duration_s))
            elif "frequency_Hz" in parameters(effect):
                each = [look.frequency_Hz for look in looks if look.frequency_Hz is not None][:1]
                starts += [_with(start, frequency_Hz=frequency) for frequency in each]
            elif any(look.outside for look in looks):
                starts.append(start)
    asked = search.solver.request.effects
    return [start for start in starts if start.name in asked]


def _with(effect: AbstractEffect, **values: float) -> AbstractEffect:
    return type(effect).of(**({name: float(getattr(effect, name)) for name in parameters(effect)} | values))


def _try(search: Search, bases: list[Fitted], starts: list[AbstractEffect]) -> None:
    """Fit each of `bases` with each of `starts`."""
    tasks = [
        (base, start)
        for base in bases
        for start in starts
        if start.name not in base.names and frozenset((*base.names, start.name)) not in search.visited
    ]

    def fit(task: tuple[Fitted, AbstractEffect]) -> Fitted:
        base, start = task
        if isinstance(start, AbstractStepInTime):
            start = _placed(search, base, start, MOMENTS // 2 * search.rig.period_s)
        return search.solver.fit(with_effect(base.motor, start), base.speeds, COARSE)

    search.keep(side_by_side(fit, tasks))


def _placed(search: Search, base: Fitted, start: AbstractStepInTime, reach_s: float) -> AbstractStepInTime:
    """`start` at the moment that explains most beside `base`, to a row, among those up to `reach_s` from its own; of the
    whole recording, which is as long as twice that, if it has none."""
    near = float(start.moment_s) or reach_s
    finest = MOMENTS // 2 * search.rig.period_s
    while True:
        moments = near + np.linspace(-reach_s, reach_s, MOMENTS)
        near = float(moments[int(np.argmin(profile(search.solver, base, start, moments)))])
        if reach_s <= finest:
            return moved(start, near)
        reach_s = max(4 * reach_s / (MOMENTS - 1), finest)


def moved(start: AbstractStepInTime, moment_s: float) -> AbstractStepInTime:
    """`start` at another moment."""
    placed = _with(start, moment_s=moment_s)
    assert isinstance(placed, AbstractStepInTime)
    return placed


def profile(solver: Solver, base: Fitted, start: AbstractStepInTime, moments: np.ndarray) -> np.ndarray:
    """(k,) sum of squares that `base` leaves with a step like `start` at each of `moments` [s], to first order."""
    each = [moved(start, float(moment)) for moment in moments]
    columns = columns_of(solver, base, each)
    own = base.jacobian
    basis, _ = np.linalg.qr(own / np.maximum(np.linalg.norm(own, axis=0), 1e-300))
    left = columns - np.einsum("np,pk->nk", basis, np.einsum("np,nk->pk", basis, columns))
    residual = base.residual - basis @ np.einsum("np,n->p", basis, base.residual)
    gain = np.einsum("nk,n->k", left, residual) ** 2 / np.maximum(np.einsum("nk,nk->k", left, left), 1e-9)
    return square_of(residual) - gain


def columns_of(solver: Solver, base: Fitted, starts: list[AbstractStepInTime]) -> np.ndarray:
    """(n, k) what each of `starts` changes beside `base` [standard deviations]."""
    motor = with_effect(base.motor, starts[0])
    begins = np.repeat(base.speeds[None], len(starts), axis=0)
    found = solver.residuals(with_each(base.motor, starts), begins, solver.width(motor))
    return (found - solver.residual_of(base.motor, base.speeds)[1]).T
