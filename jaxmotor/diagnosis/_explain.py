"""What explains a recording: its linear motor, the window of its speeds, the effects that a search finds, its noise."""

import dataclasses
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from jaxmotor.diagnosis._extension import extended
from jaxmotor.diagnosis._found import EXPLAINED, FINE, Explained, Found
from jaxmotor.diagnosis._free import linear_of
from jaxmotor.diagnosis._looks import Look, looks
from jaxmotor.diagnosis._missing import MissingVolts, missing_volts
from jaxmotor.diagnosis._request import Request
from jaxmotor.diagnosis._rounding import rounding_chi2
from jaxmotor.diagnosis._score import Scored, scored
from jaxmotor.diagnosis._search import Search
from jaxmotor.diagnosis._segment_angles import with_angles
from jaxmotor.diagnosis._solve import Fitted
from jaxmotor.diagnosis._study import Study, study_of
from jaxmotor.diagnosis._timed import timed
from jaxmotor.diagnosis._trial import rig_of
from jaxmotor.diagnosis._window import LAG, beside_all, window_beside
from jaxmotor.estimate import Fit, SpeedAverage, stated
from jaxmotor.motor import Motor
from jaxmotor.recording import Recording

OUTSIDE = 0.6
"""Share of the missing volts that depends on time alone where something acts on the motor from outside."""
HALF = 0.5
"""Share of the mean square of a linear motor, or of one effect, up to which a window of speeds is taken for the log's
before the other effects are known: it is found anew with them."""
EARLY_ROUNDS, ROUNDS = 2, 3
"""Times that a window of speeds is found, each time with the effects that were found with the last one: the first ones
also without those of them that are lags."""


class Left(NamedTuple):
    """What a motor leaves of a recording."""

    scored: Scored
    missing: MissingVolts
    looks: tuple[Look, ...]


class Explanation(NamedTuple):
    """A recording, its linear motor and what that leaves, what a search has found of it, and what that leaves."""

    fit: Fit
    study: Study
    """Of a recording that states how its speeds were made, where that is known."""
    search: Search
    found: Found
    before: Left
    after: Left


class _Searched(NamedTuple):
    fit: Fit
    study: Study
    search: Search
    found: Found
    before: Left


def explained(recording: Recording, fit: Fit, request: Request, seed: int) -> Explanation:
    """`recording`, whose linear motor `identify` has found as `fit`."""
    fit, study, search, found, before = _in_own_noise(_searched(stated(recording, fit.average), fit, request, seed))
    after = _left(study, found.fitted, seed) if found.named else before
    if found.named and _from_outside(study, found, (*before.looks, *after.looks)):
        found, after = Found(found.linear, found.linear, (), {}, {}), before
    return Explanation(fit, study, search, found, before, after)


def _searched(
    recording: Recording, fit: Fit, request: Request, seed: int, rounds: int = 0, earlier: "_Searched | None" = None
) -> _Searched:
    """`recording`, which states how its speeds were made, if that is known: by its header or, from the first of
    `rounds` on, by what was found with fewer effects, or `earlier` with another window."""
    first = linear_of(float(fit.motor.gain), float(fit.motor.pole))
    study, linear = timed(recording, fit, first, request) or _untimed(recording, first, request)
    before = _left(study, linear, seed)
    request.tell(1)
    search = Search(study.solver, first, linear, rig_of(recording, study.trial))
    now = _Searched(fit, study, search, Found(linear, linear, (), {}, {}), before)
    average = _window(search, study, lambda: linear, HALF)
    average = average or _window(search, study, lambda: search.best_without(LAG), HALF)
    if average is None:
        now = now._replace(found=_resumed(now, earlier) or _extended(now, seed))
        average = _window(search, study, lambda: now.found.fitted)
    known = fit.average is not None and fit.average.kind == "window" and not study.timed
    if average is None and fit.average is not None and known and (rounds or now.found.named):
        # Beside a linear motor that is not enough the window is hardly known, and what it lacks looks like a lag.
        better, moved = beside_all(recording, study, now.found.fitted, fit.average, early=rounds < EARLY_ROUNDS)
        average = better if moved and rounds < ROUNDS else None
        fit = dataclasses.replace(fit, average=better)
    angled = None if average is not None else with_angles(study, now.found.fitted)
    if angled is not None:
        return _searched(angled, fit, request, seed, rounds)
    if average is not None:
        # Lags of the readings are not the motor's: what was found with them is found anew.
        fit = dataclasses.replace(fit, average=average)
        return _searched(stated(recording, average), fit, request, seed, rounds + 1, now)
    return now._replace(fit=fit)


def _extended(now: _Searched, seed: int) -> Found:
    """What a search finds."""
    return extended(
        now.search,
        lambda fitted: _left(now.study, fitted, seed).looks,
        lambda fitted: is_explained(now.study, fitted, now.search.linear),
    )


def _resumed(now: _Searched, earlier: _Searched | None) -> Found | None:
    """The best of what was tried `earlier`, with another window, where it now leaves no more than the best did then;
    None where the readings over this window ask for something else."""
    if earlier is None or not earlier.found.named:
        return None
    old, found = earlier.found.fitted, now.search.resumed(earlier.search)
    tried = found.named and frozenset(found.fitted.names) in earlier.search.visited.fitted
    explained = is_explained(now.study, found.fitted, now.search.linear)
    return found if tried and (explained or found.fitted.chi2 <= old.chi2) else None


def _in_own_noise(known: _Searched) -> _Searched:
    """`known` in the noise that its motor leaves, where it was estimated without one and that is less."""
    study, found = known.study, known.found
    if not found.named or study.packed.observation.floor_known or found.fitted.chi2 >= 1:
        return known
    quieter = study.quieter(found.fitted.chi2)
    linear, fitted = (quieter.solver.fit(one.motor, one.speeds, FINE) for one in (found.linear, found.fitted))
    noise, before = quieter.packed.observation.noise, study.packed.observation.noise
    chi2 = known.fit.chi2_per_sample * (before.level / noise.level) ** 2
    return known._replace(
        fit=dataclasses.replace(known.fit, noise=noise, chi2_per_sample=chi2),
        study=quieter,
        before=known.before._replace(
            scored=scored(quieter.solver, linear.motor, quieter.recording, quieter.packed, linear.speeds)
        ),
        found=dataclasses.replace(found, linear=linear, fitted=fitted),
    )


def _window(search: Search, study: Study, motor: Callable[[], Fitted], share: float = np.inf) -> SpeedAverage | None:
    """Of the speeds of a recording, where neither it nor the linear motor tells, as the `motor` shows it; None where
    it leaves more than this `share` of what the motor leaves without one."""
    recording = study.recording
    if recording.measured != "speed" or recording.speed_window_s is not None or search.linear.chi2 <= EXPLAINED:
        return None
    found = motor()
    others = tuple(search.visited.fitted.values())
    return window_beside(recording, study, found, others, max(EXPLAINED, share * found.chi2))


def _untimed(recording: Recording, first: Motor, request: Request) -> tuple[Study, Fitted]:
    """`recording`, read as its voltages change, and the linear motor that fits it."""
    study = study_of(recording, float(first.linear.pole), request=request)
    return study, study.solver.fit(first, tolerance=FINE)


def _left(study: Study, fitted: Fitted, seed: int) -> Left:
    """What `fitted` leaves."""
    after = scored(study.solver, fitted.motor, study.recording, study.packed, fitted.speeds)
    linear = fitted.motor.linear
    missing = missing_volts(study.recording, after.traces, float(linear.gain), float(linear.pole))
    return Left(after, missing, looks(missing, seed))


def _from_outside(study: Study, found: Found, seen: tuple[Look, ...]) -> bool:
    """By what is `seen` before and after, something outside moves the motor, which the effects only seem to explain."""
    outside = any(map(is_from_outside, seen))
    return study.packed.observation.floor_known and outside and not is_explained(study, found.fitted, found.linear)


def is_from_outside(look: Look) -> bool:
    """Most of what is left depends on time alone."""
    return look.outside and look.share > OUTSIDE


def is_explained(study: Study, fitted: Fitted, linear: Fitted) -> bool:
    """`fitted` leaves no more than the encoder's rounding may, or what its laws are off by."""
    noise_known = study.packed.observation.floor_known
    if Explained(linear.chi2, noise_known).holds(fitted):
        return True
    return noise_known and fitted.chi2 <= rounding_chi2(study.solver, fitted)
