"""What explains a recording: its linear motor, the window of its speeds, the effects that a search finds, its noise."""

import dataclasses
from typing import NamedTuple

from jaxmotor.diagnosis._extension import extended
from jaxmotor.diagnosis._found import EXPLAINED, FINE, LEAST, Explained, Found
from jaxmotor.diagnosis._free import linear_of, with_effect
from jaxmotor.diagnosis._held_out import HeldOut, hold_out
from jaxmotor.diagnosis._parallel import side_by_side
from jaxmotor.diagnosis._part import part_of
from jaxmotor.diagnosis._reading_time import is_near, with_timing_offset
from jaxmotor.diagnosis._request import Request
from jaxmotor.diagnosis._residual_dependence import Dependence, dependences
from jaxmotor.diagnosis._residual_voltage import ResidualVoltage, residual_voltage
from jaxmotor.diagnosis._rest import may_be
from jaxmotor.diagnosis._rounding import rounding_chi2
from jaxmotor.diagnosis._score import Scored, scored
from jaxmotor.diagnosis._search import Search
from jaxmotor.diagnosis._segment_angles import with_angles
from jaxmotor.diagnosis._solve import Fitted
from jaxmotor.diagnosis._study import Study, study_of
from jaxmotor.diagnosis._timed import TIE, timed
from jaxmotor.diagnosis._trial import rig_of
from jaxmotor.diagnosis._visited import EQUAL, FAR, Names
from jaxmotor.diagnosis._window import (
    LAG,
    average_of,
    beside_window,
    does_as_well,
    is_average,
    is_stated,
    is_window,
    window_beside,
    window_s,
    with_window,
)
from jaxmotor.estimate import Fit, SpeedAverage, stated
from jaxmotor.motor import Motor
from jaxmotor.motor.effects import LEARNED, TERMS, AbstractDisturbance, SpeedWindow, TimingOffset
from jaxmotor.prediction import rounding_level
from jaxmotor.recording import Recording

TIME_ONLY = 0.6
"""Share of the residual voltage that depends on time alone where something acts on the motor from outside."""
HALF = 0.5
"""Share of what a linear motor leaves that it may leave with a window of speeds which is the log's, where no effect is
found."""
RIVALS = 4
"""Of the motors without a curve, the likeliest, of which the best is held against that with one."""
ROUNDS = 3
"""Times that a window of speeds is found anew with the effects that were found with the last one."""


class Residual(NamedTuple):
    """What a motor leaves of a recording."""

    scored: Scored
    residual_voltage: ResidualVoltage
    dependences: tuple[Dependence, ...]


class Explanation(NamedTuple):
    """A recording, its linear motor and what that leaves, what a search has found of it, and what that leaves."""

    fit: Fit
    study: Study
    """Of a recording that states how its speeds were made, where that is known."""
    search: Search
    found: Found
    before: Residual
    held: HeldOut
    after: Residual


class _Searched(NamedTuple):
    fit: Fit
    study: Study
    search: Search
    found: Found
    before: Residual

    @property
    def square(self) -> float:
        """Mean square of what the motor that was found leaves [SI]."""
        return self.found.fitted.chi2 * self.study.packed.observation.unit**2


def explained(recording: Recording, fit: Fit, request: Request, seed: int) -> Explanation:
    """`recording`, whose linear motor `identify` has found as `fit`."""
    known = _of_part(recording, fit, request, seed) or _searched(recording, fit, request, seed)
    known = _in_own_noise(_carried_over(known))
    known, held = _validated(_in_time(known, request, seed))
    if not known.found.named:
        return Explanation(*known, held, known.before)
    after = _residual(known.study, known.found.fitted, seed)
    if not _is_disturbance(known.study, known.found, (*known.before.dependences, *after.dependences)):
        return Explanation(*known, held, after)
    linear = known.found.linear
    nothing = Found(linear, linear, (), {}, {})
    return Explanation(*known._replace(found=nothing), hold_out(known.study, nothing), known.before)


def _in_time(known: _Searched, request: Request, seed: int) -> _Searched:
    """`known`, or with the log's timing offset, where its motor with effects tells that rows were not read when
    voltages change: a law may have imitated that, so they are sought again beside it."""
    moved = _timed_beside(known)
    if moved is None:
        return known
    study, fitted = moved
    offset = next(effect for effect in fitted.motor.effects if isinstance(effect, TimingOffset))
    own = study.solver.fit(known.found.linear.motor, known.found.linear, FINE)
    # Without the effects it would be another one: what it is here is where fits with them begin.
    linear = study.solver.fit(with_effect(own.motor, offset), own, FINE, steps=0)
    first = with_effect(known.search.first, offset)
    again = _begun(dataclasses.replace(known.fit, timing=None), study, linear, first, request, seed)
    again = _carried_over(again._replace(found=_resumed(again, known) or _extended(again, seed)))
    return _in_own_noise(again) if again.found.named and is_near(study, again.found.fitted) else known


def _timed_beside(known: _Searched) -> tuple[Study, Fitted] | None:
    """The motor of `known` with the timing offset that it tells, or without one of its effects where it leaves no more
    with that in its place; None where there is none."""
    study, found = known.study, known.found
    if not (found.named and known.fit.average is None and is_stated(study.recording)):
        return None
    names = frozenset(found.fitted.names)
    shorter = [known.search.visited.fitted.get(names - {one.name}) for one in found.named]
    for base in (found.fitted, *(one for one in shorter if one is not None and one.names)):
        moved = with_timing_offset(study, base)
        if moved is not None and moved[1].chi2 < found.fitted.chi2 + TIE:
            return moved
    return None


def _of_part(recording: Recording, fit: Fit, request: Request, seed: int) -> _Searched | None:
    """`recording`, if it is long, by what a search of a part of it finds, and what the whole asks for beside that."""
    part = part_of(recording, float(fit.motor.pole))
    if part is None:
        return None
    request.keep_noise_of_part(part, fit.noise)
    earlier = _searched(part, fit, request, seed)
    fit = dataclasses.replace(fit, average=earlier.fit.average)
    first = linear_of(float(fit.motor.gain), float(fit.motor.pole))
    now = _begun(fit, *_linear(recording, fit, first, request), first, request, seed)
    return _angled(now._replace(found=_resumed(now, earlier) or _extended(now, seed)), seed)


def _searched(
    recording: Recording, fit: Fit, request: Request, seed: int, rounds: int = 0, earlier: _Searched | None = None
) -> _Searched:
    """`recording` with the window of its speeds that `fit` has, where the header does not state one; in the first of
    `rounds` it is fitted with the effects, where the linear motor is not enough. What `earlier` found is tried first.
    """
    first = linear_of(float(fit.motor.gain), float(fit.motor.pole))
    study, linear = _linear(recording, fit, first, request)
    sought = not (is_stated(recording) or study.timed or (fit.average and fit.average.rows is not None))
    windowed = None
    if sought and earlier is None and linear.chi2 > EXPLAINED:
        windowed = earlier = _with_window(recording, fit, first, linear, request, seed)
        fit = dataclasses.replace(fit, average=_average(earlier, fit, linear) or fit.average)
        study, linear = _linear(recording, fit, first, request)
    now = _begun(fit, study, linear, first, request, seed)
    now = now._replace(found=_resumed(now, earlier) or _extended(now, seed))
    if sought and fit.average is None and rounds == 0 and _is_late(now.found):
        windowed = windowed or _with_window(recording, fit, first, linear, request, seed)
        average = _in_place_of(now.found, windowed)
        if average is not None:
            return _searched(recording, dataclasses.replace(fit, average=average), request, seed, 1, windowed)
    if sought and now.found.named and fit.average is not None and fit.average.is_fitted:
        better, moved = window_beside(recording, now.found.fitted, fit.average, request)
        fit = dataclasses.replace(fit, average=better)
        if moved and rounds < ROUNDS:
            return _searched(recording, fit, request, seed, rounds + 1, now)
    return _angled(now._replace(fit=fit), seed)


def _angled(now: _Searched, seed: int) -> _Searched:
    """`now`, where it tells at which angles segments begin with laws that are locked to the angle, too: all that was
    fitted stays."""
    study = with_angles(now.study, now.found.fitted)
    if study is None:
        return now
    linear = now.search.linear
    search = Search(study.solver, now.search.first, linear, rig_of(study.recording, study.trial))
    search.goes_on(now.search)
    angled = now._replace(study=study, search=search, before=_residual(study, linear, seed))
    return angled._replace(found=_extended(angled, seed))


def _is_late(found: Found) -> bool:
    """By what was named the readings follow late, as means do whose window is not stated."""
    return any(effect.family == LAG for effect in found.fitted.motor.effects)


def _linear(recording: Recording, fit: Fit, first: Motor, request: Request) -> tuple[Study, Fitted]:
    """`recording`, which states how its speeds were made if `fit` has found that, and its linear motor."""
    stating = stated(recording, fit.average)
    found = timed(stating, fit, first, request)
    if found is None:
        study = study_of(stating, float(first.linear.pole), request=request)
        found = study, study.solver.fit(first, tolerance=FINE)
    return found


def _begun(fit: Fit, study: Study, linear: Fitted, first: Motor, request: Request, seed: int) -> _Searched:
    """Before the search, which begins at the `linear` motor, or at the `first` one."""
    before = _residual(study, linear, seed)
    request.tell(1)
    search = Search(study.solver, first, linear, rig_of(study.recording, study.trial))
    search.try_offset(fit.offset_V)
    return _Searched(fit, study, search, Found(linear, linear, (), {}, {}), before)


def _with_window(
    recording: Recording, fit: Fit, first: Motor, linear: Fitted, request: Request, seed: int
) -> _Searched:
    """What a search finds where each motor has a window of the speeds, too."""
    study, averaged = beside_window(recording, linear, _window_of(fit), request)
    first = with_window(first, window_s(averaged))
    now = _begun(fit, study, averaged, first, request, seed)
    return now._replace(found=_extended(now, seed))


def _average(searched: _Searched, fit: Fit, linear: Fitted) -> SpeedAverage | None:
    """The window of the speeds, if it is one; of a linear motor, if `fit` has none and it takes up half of what the
    `linear` one leaves."""
    study, fitted = searched.study, searched.found.fitted
    takes_up = searched.found.named or (_window_of(fit) is None and fitted.chi2 < HALF * linear.chi2)
    own = takes_up and is_average(study, fitted) and is_window(study, fitted, searched.search.visited)
    return average_of(study, fitted) if own else None


def _in_place_of(found: Found, windowed: _Searched) -> SpeedAverage | None:
    """The window of `windowed`, if it does as well as what is late in the motor of `found`."""
    study, fitted = windowed.study, windowed.found.fitted
    alone = SpeedWindow.name in fitted.names and not _is_late(windowed.found) and is_average(study, fitted)
    alone = alone and does_as_well(study, fitted, found.fitted.motor, windowed.search.visited)
    return average_of(study, fitted) if alone else None


def _window_of(fit: Fit) -> SpeedAverage | None:
    """The window that `identify` fitted. A filter that it saw may be the motor's: a lag, or what a window leaves of a
    motor with effects."""
    return fit.average if fit.average is not None and fit.average.is_fitted else None


def _extended(now: _Searched, seed: int) -> Found:
    """What a search finds; nothing where the linear motor leaves less than the rounding of what was read."""
    if _is_rounding(now.study, now.search.linear):
        return now.search.as_found(now.search.linear)
    return extended(
        now.search,
        lambda fitted: _residual(now.study, fitted, seed).dependences,
        lambda fitted: is_explained(now.study, fitted, now.search.linear),
    )


def _is_rounding(study: Study, linear: Fitted) -> bool:
    """Of readings on a grid the `linear` motor leaves no more than their rounding alone does. At a steady speed that is
    a pattern which repeats with the angle, as a law would. Means over a time are differences of what was counted."""
    observation = study.packed.observation
    rounded = rounding_level(observation.noise.step, observation.kind != "speed")
    return not observation.floor_known and linear.chi2 * observation.noise.level**2 <= rounded**2


def _resumed(now: _Searched, earlier: _Searched | None) -> Found | None:
    """The best of what was tried `earlier`, with another window, where what it leaves is not more by so much as an
    effect must take up; None where the readings over this window ask for something else, or show more, in less noise,
    than when all seemed to be explained."""
    if earlier is None:
        return None
    found = now.search.resumed(earlier.search)
    names = (frozenset(found.fitted.names) - now.search.own) | earlier.search.own
    tried = names in earlier.search.visited.fitted
    explained = is_explained(now.study, found.fitted, now.search.linear)
    as_good = (1 - LEAST) * now._replace(found=found).square <= earlier.square
    seemed_explained = is_explained(earlier.study, earlier.found.fitted, earlier.search.linear)
    return found if tried and (explained or (as_good and not seemed_explained)) else None


def _carried_over(known: _Searched) -> _Searched:
    """`known`, without the curves of the likeliest motor that has some if it is about as likely as the likeliest one
    without, or likelier, and predicts rows which it was not fitted to far worse than one of the likeliest without does:
    where segments have levels of their own a curve may pass through each, and blocks of rows that are left out do not
    tell. A curve over few voltages, in the place of a law that it contains, goes if it only predicts them no better.
    """
    visited, linear = known.search.visited, known.search.linear
    weight, (law, *others) = visited.weights(), visited.without(LEARNED)
    curved = max((names for names in weight if names & LEARNED.keys()), key=weight.__getitem__, default=None)
    if law is linear or curved is None or weight[curved] < EQUAL * weight[frozenset(law.names)]:
        return known
    held = hold_out(known.study, known.found)
    if not held.own:
        return known
    laws = [law, *(one for one in others[: RIVALS - 1] if one is not linear)]
    drift, *drifts = side_by_side(
        lambda one: held.after.drift if one.names == known.found.fitted.names else held.drift(one.motor, one),
        [visited.fitted[curved], *laws],
    )
    least, law = min(zip(drifts, laws, strict=True), key=lambda pair: pair[0])
    worse = 1.0 if _passes_through_each(known.search, frozenset(law.names), curved) else FAR
    if drift < worse * least:
        return known
    visited.forget(LEARNED.keys() & curved)
    return _carried_over(known._replace(found=known.search.as_found(law)))


def _passes_through_each(search: Search, laws: Names, curved: Names) -> bool:
    """What `curved` has more than `laws` is a curve over the voltage in the place of laws that it contains, with a term
    for each voltage that was applied."""
    [*curves], instead = curved - laws, laws - curved
    if len(curves) != 1 or not instead or len(search.rig.volts_V) > TERMS:
        return False
    return LEARNED[curves[0]].over == "voltage" and instead <= {*search.relations.simpler(curves[0])}


def _validated(known: _Searched) -> tuple[_Searched, HeldOut]:
    """`known`, or that of the motors about as likely which predicts rows held out best, and what is held out: where the
    motor of `known` predicts them worse than the linear one, if that other one does better; where no effect is likely,
    but something unexplained, if it takes up as much there as an effect must. It is no cause then, but a better motor,
    of which a disturbance is no part. The linear one where that leaves next to nothing, of a noise that is not known,
    and no effect helps to predict rows held out.
    """
    held = hold_out(known.study, known.found)
    if _is_idle(known.study, known.found, held):
        known = known._replace(found=known.search.found_at(known.found.linear))
        return known, hold_out(known.study, known.found)
    if held.is_worse:
        enough = held.before.drift
    elif held.own and not known.found.named and not is_explained(known.study, known.found.fitted, known.found.linear):
        enough = (1 - LEAST) * held.before.drift
    else:
        return known, held
    visited = known.search.visited
    weight = visited.weights()
    likely = [visited.fitted[names] for names, own in weight.items() if own > EQUAL * max(weight.values())]
    motors = [one for one in likely if held.is_worse or not is_disturbed(one)]
    drifts = side_by_side(lambda one: held.drift(one.motor, one, held.before.drift), motors)
    better = [(drift, one) for drift, one in zip(drifts, motors, strict=True) if drift < enough]
    if not better:
        return known, held
    _, best = min(better, key=lambda pair: pair[0])
    known = known._replace(found=known.search.found_at(best))
    return known, hold_out(known.study, known.found)


def _is_idle(study: Study, found: Found, held: HeldOut) -> bool:
    """The effects of `found` take up next to nothing that is more than the noise, and nothing of rows held out: these
    are predicted no worse without all of them, and without each."""
    left = max(found.linear.chi2, held.before.drift)
    unsure = held.own and not study.packed.observation.floor_known and left <= EXPLAINED
    if not (found.named and unsure and held.after.drift >= held.before.drift):
        return False
    return all(held.without(one.name) <= held.after.drift for one in found.named)


def is_disturbed(fitted: Fitted) -> bool:
    """Something outside the motor of `fitted` acts on it."""
    return any(isinstance(effect, AbstractDisturbance) for effect in fitted.template.effects)


def _in_own_noise(known: _Searched) -> _Searched:
    """`known` in the noise that its motor leaves, where it was estimated without one and that is less."""
    study, found = known.study, known.found
    if not found.named or study.packed.observation.floor_known or found.fitted.chi2 >= 1:
        return known
    quieter = study.quieter(found.fitted.chi2)
    linear, fitted = (quieter.solver.fit(one.motor, one, FINE, ties=one.ties) for one in (found.linear, found.fitted))
    if not may_be(fitted.motor, known.search.rig):
        return known
    noise, before = quieter.packed.observation.noise, study.packed.observation.noise
    chi2 = known.fit.chi2_per_sample * (before.level / noise.level) ** 2
    now = known._replace(fit=dataclasses.replace(known.fit, noise=noise, chi2_per_sample=chi2))
    scores = scored(quieter.solver, linear.motor, study.recording, quieter.packed, linear.speeds)
    return now._replace(
        study=quieter,
        before=now.before._replace(scored=scores),
        found=dataclasses.replace(found, linear=linear, fitted=fitted),
    )


def _residual(study: Study, fitted: Fitted, seed: int) -> Residual:
    """What `fitted` leaves."""
    after = scored(study.solver, fitted.motor, study.recording, study.packed, fitted.speeds)
    linear = fitted.motor.linear
    voltage = residual_voltage(study.recording, after.traces, float(linear.gain), float(linear.pole))
    return Residual(after, voltage, dependences(voltage, seed))


def _is_disturbance(study: Study, found: Found, seen: tuple[Dependence, ...]) -> bool:
    """By what is `seen` before and after, something outside moves the motor, which the effects only seem to explain."""
    outside = any(map(depends_on_time_only, seen))
    return study.packed.observation.floor_known and outside and not is_explained(study, found.fitted, found.linear)


def depends_on_time_only(dependence: Dependence) -> bool:
    """Most of what is left depends on time alone."""
    return dependence.time_only and dependence.share > TIME_ONLY


def is_explained(study: Study, fitted: Fitted, linear: Fitted) -> bool:
    """`fitted` leaves no more than the encoder's rounding may, or what its laws are off by."""
    noise_known = study.packed.observation.floor_known
    if Explained(linear.chi2, noise_known).holds(fitted):
        return True
    return noise_known and fitted.chi2 <= rounding_chi2(study.solver, fitted)
