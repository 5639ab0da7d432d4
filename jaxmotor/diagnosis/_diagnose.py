"""From a recording to what its linear model gets wrong, why, and what a longer model is worth."""

import dataclasses
import os
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from jaxmotor._arguments import check_whole
from jaxmotor._errors import JaxmotorError
from jaxmotor._precision import in_float64
from jaxmotor.diagnosis._certainty import OF_FAMILY, OF_NAME
from jaxmotor.diagnosis._curves import learned_laws
from jaxmotor.diagnosis._diagnosis import Diagnosis, FoundEffect, Rival, Verdict
from jaxmotor.diagnosis._early import is_early
from jaxmotor.diagnosis._errors import (
    covariance,
    differs,
    effect_errors,
    linear_covariance,
    linear_errors,
    with_indistinguishable,
)
from jaxmotor.diagnosis._experiment import Experiment, experiment
from jaxmotor.diagnosis._extension import extended
from jaxmotor.diagnosis._found import EXPLAINED, FINE, NONE, Explained, Found, Named
from jaxmotor.diagnosis._free import linear_of, of_motor
from jaxmotor.diagnosis._held_out import HeldOut, hold_out, worth_of
from jaxmotor.diagnosis._joint import joint_covariance
from jaxmotor.diagnosis._left_open import left_open, moves
from jaxmotor.diagnosis._looks import Look, looks
from jaxmotor.diagnosis._loops import loop_gains
from jaxmotor.diagnosis._missing import MissingVolts, missing_volts
from jaxmotor.diagnosis._moments import moment_error
from jaxmotor.diagnosis._parallel import side_by_side
from jaxmotor.diagnosis._request import Asked, Progress, Request
from jaxmotor.diagnosis._rounding import rounding_chi2
from jaxmotor.diagnosis._score import Scored, scored
from jaxmotor.diagnosis._search import Search
from jaxmotor.diagnosis._solve import Fitted
from jaxmotor.diagnosis._study import Study, study_of
from jaxmotor.diagnosis._timed import timed, timing_of, with_average
from jaxmotor.diagnosis._trial import rig_of
from jaxmotor.diagnosis._visited import falling
from jaxmotor.diagnosis._window import LAG, beside_all, window_beside
from jaxmotor.estimate import Fit, SpeedAverage, Trace, best_guess, identify, stated
from jaxmotor.motor import AbstractEffect, Motor
from jaxmotor.motor.effects import LEARNED, OF_LOG, AbstractDisturbance, AbstractLearnedEffect, AbstractStepInTime
from jaxmotor.recording import Recording, check, recording_of

OUTSIDE = 0.6
"""Share of the missing volts that depends on time alone where something acts on the motor from outside."""
RIVALS = 4
FAR = 2.0
"""Times chi2 of the best motor, above which nobody asks how much worse another one is, exactly."""
EARLY = (
    "the shaft moves before it is driven: the log seems to hold the input that was applied until each row, not from it "
    "on; import it with --input-acts before"
)
HALF = 0.5
"""Share of the mean square of a linear motor, or of one effect, up to which a window of speeds is taken for the log's
before the other effects are known: it is found anew with them."""
EARLY_ROUNDS, ROUNDS = 2, 3
"""Times that a window of speeds is found, each time with the effects that were found with the last one: the first ones
also without those of them that are lags."""
UNKNOWN = 0.5
"""Relative standard error from which a parameter is not determined."""


@in_float64
def diagnose(
    recording: Recording | str | os.PathLike[str],
    *,
    effects: Asked | None = None,
    exclude: Asked = (),
    seed: int = 0,
    on_progress: Callable[[Progress], object] | None = None,
) -> Diagnosis:
    """Say what the linear motor of `recording` gets wrong, name the causes, and measure what knowing them is worth.

    `recording` may be the path of its file. Only `effects` (names, such as those in `EFFECTS`, and classes of your own;
    None: all that are known) without those in `exclude` are sought. `on_progress` is called with a `Progress` as the
    work goes on, by one thread at a time; what it raises ends the work.

    `seed` draws the shuffles that tell a dependence from chance, and encoder offsets.

    **Raises:** `JaxmotorError`, one sentence, where the recording does not determine a linear motor.
    """
    recording = recording_of(recording)
    check_whole("seed", seed)
    request = Request(effects, exclude, on_progress)
    request.tell(0)
    fit, refused = _linear_fit(recording, seed)
    fit, study, linear, before, missing, found_looks, search, found = _in_own_noise(
        _explained(stated(recording, fit.average), fit, request, seed)
    )
    recording = study.recording
    after, left, left_looks = _left(study, found.fitted, seed) if found.named else (before, missing, found_looks)
    if found.named and _from_outside(study, found, (*found_looks, *left_looks)):
        found, after, left, left_looks = Found(linear, linear, (), {}, {}), before, missing, found_looks
    held = hold_out(study, found)
    request.tell(3)
    verdict = _verdict(study, found, held, found_looks, left, left_looks)
    spread = with_average(covariance(found.fitted, study.solver.block), fit)
    if refused is not None and not (found.named and spread[1, 1] < UNKNOWN**2):
        raise refused
    every, timing = _effects(study, held, found, spread), timing_of(found.fitted, spread)
    laws = learned_laws(search, found, held, spread, study.solver.block, partial=verdict == "unexplained")
    every = tuple(dataclasses.replace(one, curve=laws.get(one.name)) for one in every)
    causes = tuple(one for one in every if not isinstance(one.effect, AbstractDisturbance))
    indistinguishable = _indistinguishable(found, every)
    errors = linear_errors(found.fitted, with_indistinguishable(found.fitted, spread, list(indistinguishable.values())))
    opened, allowed = left_open(study, fit, found, errors)
    undecided = verdict == "complete" and moves(opened, found.fitted.motor)
    return Diagnosis(
        fit=fit,
        linear=of_motor(linear.motor),
        motor=of_motor(found.fitted.motor),
        standard_error=errors,
        covariance=linear_covariance(found.fitted, spread),
        joint=joint_covariance(found.fitted, spread, rig_of(study.recording, study.trial)),
        effects=causes,
        disturbances=tuple(one for one in every if one not in causes),
        probabilities=_probabilities(found, every),
        families=_families(found, every),
        verdict="unexplained" if undecided else verdict,
        held_out=worth_of(held.segments, held.before, held.after, seed, held.in_part),
        whole=worth_of(fit.fitted, before, after, seed),
        adds_up=float(study.trial.memory) > 0,
        closed_loop=loop_gains(study, found, seed),
        missing=missing,
        looks=found_looks,
        left=left,
        left_looks=left_looks,
        learned=tuple(laws.values()),
        experiments=_experiments(study, found.fitted, indistinguishable, {one.name for one in every if one.is_told}),
        notes=_once(
            *_notes(_of_linear(fit) if verdict == "unexplained" else check(recording), held, found, every),
            *_ambiguous(found.fitted, spread, indistinguishable),
            *(one.sentence for one in (fit.average, timing) if one is not None),
            *(one.note for one in opened),
            *([EARLY] if verdict == "unexplained" and is_early(recording, found.fitted) else []),
        ),
        open_hypotheses=opened,
        allowed=allowed,
        undecided=undecided,
        timing=timing,
        average=fit.average,
    )


class _Explained(NamedTuple):
    """A recording, its linear motor and what that leaves, and what a search has found of it."""

    fit: Fit
    study: Study
    linear: Fitted
    before: Scored
    missing: MissingVolts
    looks: tuple[Look, ...]
    search: Search
    found: Found


def _explained(recording: Recording, fit: Fit, request: Request, seed: int, rounds: int = 0) -> _Explained:
    """`recording`, which states how its speeds were made, if that is known: by its header or, from the first of
    `rounds` on, by what was found with fewer effects."""
    first = linear_of(float(fit.motor.gain), float(fit.motor.pole))
    study, linear = timed(recording, fit, first, request) or _untimed(recording, first, request)
    before = scored(study.solver, linear.motor, recording, study.packed, linear.speeds)
    missing = _missing(study, linear.motor, before.traces)
    found_looks = looks(missing, seed)
    request.tell(1)
    search = Search(study.solver, first, linear, rig_of(recording, study.trial))
    found = Found(linear, linear, (), {}, {})
    average = _window(search, study, lambda: linear, HALF)
    average = average or _window(search, study, lambda: search.best_without(LAG), HALF)
    if average is None:
        found = extended(
            search,
            lambda fitted: _left(study, fitted, seed)[2],
            lambda fitted: _is_explained(study, fitted, linear),
        )
        average = _window(search, study, lambda: found.fitted)
    known = fit.average is not None and fit.average.kind == "window" and not study.timed
    if average is None and fit.average is not None and known and (rounds or found.named):
        # Beside a linear motor that is not enough the window is hardly known, and what it lacks looks like a lag.
        better, moved = beside_all(recording, study, found.fitted, fit.average, early=rounds < EARLY_ROUNDS)
        average = better if moved and rounds < ROUNDS else None
        fit = dataclasses.replace(fit, average=better)
    if average is not None:
        # Lags of the readings are not the motor's: what was found with them is found anew.
        fit = dataclasses.replace(fit, average=average)
        return _explained(stated(recording, average), fit, request, seed, rounds + 1)
    return _Explained(fit, study, linear, before, missing, found_looks, search, found)


def _in_own_noise(known: _Explained) -> _Explained:
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
        linear=linear,
        before=scored(quieter.solver, linear.motor, quieter.recording, quieter.packed, linear.speeds),
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


def _once(*notes: str) -> tuple[str, ...]:
    return tuple(dict.fromkeys(notes))


def _untimed(recording: Recording, first: Motor, request: Request) -> tuple[Study, Fitted]:
    """`recording`, read as its voltages change, and the linear motor that fits it."""
    study = study_of(recording, float(first.linear.pole), request=request)
    return study, study.solver.fit(first, tolerance=FINE)


def _linear_fit(recording: Recording, seed: int) -> tuple[Fit, JaxmotorError | None]:
    """The linear motor, and why the recording does not determine it, where that is so: an effect may be why."""
    try:
        return identify(recording, seed=seed), None
    except JaxmotorError as refused:
        return best_guess(recording, str(refused)), refused


def _left(study: Study, fitted: Fitted, seed: int) -> tuple[Scored, MissingVolts, tuple[Look, ...]]:
    """What `fitted` leaves."""
    after = scored(study.solver, fitted.motor, study.recording, study.packed, fitted.speeds)
    left = _missing(study, fitted.motor, after.traces)
    return after, left, looks(left, seed)


def _from_outside(study: Study, found: Found, seen: tuple[Look, ...]) -> bool:
    """By what is `seen` before and after, something outside moves the motor, which the effects only seem to explain."""
    outside = any(look.outside and look.share > OUTSIDE for look in seen)
    return study.packed.observation.floor_known and outside and not _is_explained(study, found.fitted, found.linear)


def _missing(study: Study, motor: Motor, traces: tuple[Trace, ...]) -> MissingVolts:
    return missing_volts(study.recording, traces, float(motor.linear.gain), float(motor.linear.pole))


def _is_explained(study: Study, fitted: Fitted, linear: Fitted) -> bool:
    """`fitted` leaves no more than the encoder's rounding may, or what its laws are off by."""
    noise_known = study.packed.observation.floor_known
    if Explained(linear.chi2, noise_known).holds(fitted):
        return True
    return noise_known and fitted.chi2 <= rounding_chi2(study.solver, fitted)


def _verdict(
    study: Study,
    found: Found,
    held: HeldOut,
    first: tuple[Look, ...],
    left: MissingVolts,
    left_looks: tuple[Look, ...],
) -> Verdict:
    if held.is_worse or (not found.named and any(look.outside and look.share > OUTSIDE for look in first)):
        return "unexplained"
    disturbed = any(isinstance(effect, AbstractDisturbance) for effect in found.fitted.template.effects)
    if disturbed or not _is_explained(study, found.fitted, found.linear):
        return "unexplained"
    loud = left.rms_V > 1.25 * left.noise_V
    if loud and left_looks and left_looks[0].beyond_chance and left_looks[0].outside and left_looks[0].share > OUTSIDE:
        return "unexplained"
    return "extended" if found.named else "complete"


def _effects(study: Study, held: HeldOut, found: Found, spread: np.ndarray) -> tuple[FoundEffect, ...]:
    rig = rig_of(study.recording, study.trial)
    errors = effect_errors(found.fitted, spread, rig)
    effects = []
    rivals = _rivals(held, found)
    about = {named.name: named for named in found.named}
    for effect, error in zip(found.fitted.motor.effects, errors, strict=True):
        if isinstance(effect, OF_LOG):
            continue
        if isinstance(effect, AbstractStepInTime):
            error["moment_s"] = moment_error(study.solver, found.fitted, effect, rig)
        without = held.without(effect.name)
        gain = 100 * (1 - held.after.drift / max(without, 1e-300))
        own = about[effect.name]
        sure, with_equal, family = _sureness(own, found.families.get(effect.family, 0.0))
        unknown = _unknown(effect, error)
        effects.append(
            FoundEffect(
                effect,
                error,
                gain,
                rivals[own.name],
                unknown,
                probability=sure,
                family_probability=with_equal,
                of_family=family,
                unexplained_share=own.unexplained_share,
            )
        )
    return tuple(sorted(effects, key=lambda one: -one.held_out_gain_percent))


def _sureness(named: Named, of_family: float) -> tuple[float, float, float]:
    """The probabilities of an effect, of it or its equals, and of any of its family, by weights alone `of_family`. That
    something depends on a coordinate, as a curve says, is as sure as a family."""
    sure = (OF_FAMILY if named.name in LEARNED else OF_NAME)(named.unexplained_share)
    with_equal = sure * named.with_equal
    family = max(OF_FAMILY(named.unexplained_share) * of_family, with_equal) if of_family else 0.0
    return sure * named.probability, with_equal, family


def _probabilities(found: Found, effects: tuple[FoundEffect, ...]) -> dict[str, float]:
    """Of each effect that was tried and of `none`, the largest first."""
    sure = OF_NAME(found.unexplained_share)
    each = {name: share if name == NONE else sure * share for name, share in found.probabilities.items()}
    return falling(each | {one.name: one.probability for one in effects} if each else each)


def _families(found: Found, effects: tuple[FoundEffect, ...]) -> dict[str, float]:
    """Of each family of effects, the largest first."""
    each = {family: OF_FAMILY(found.unexplained_share) * share for family, share in found.families.items()}
    for one in effects:
        each[one.effect.family] = max(each.get(one.effect.family, 0.0), one.of_family)
    return falling({family: share for family, share in each.items() if family})


def _rivals(held: HeldOut, found: Found) -> dict[str, tuple[Rival, ...]]:
    """Of each effect."""
    pairs = [(named, other) for named in found.named for other in named.rivals[:RIVALS]]
    added = [_added(other, found) for _, other in pairs]
    far = FAR * held.fitted.chi2
    bars = [np.inf if one.name in named.equal else far for one, (named, _) in zip(added, pairs, strict=True)]
    drifts = side_by_side(
        lambda pair: held.drift(pair[0][1].motor, pair[0][1], pair[1]), list(zip(pairs, bars, strict=True))
    )
    rivals: dict[str, list[Rival]] = {named.name: [] for named in found.named}
    for one, (named, _), drift in zip(added, pairs, drifts, strict=True):
        if drift <= held.before.drift:
            equal, wider = one.name in named.equal, named.name in one.contains
            rivals[named.name].append(Rival(one.name, drift - held.after.drift, equal, wider))
    return {name: tuple(sorted(its, key=lambda rival: rival.chi2_excess)) for name, its in rivals.items()}


def _indistinguishable(found: Found, effects: tuple[FoundEffect, ...]) -> dict[tuple[str, str], Fitted]:
    """Motors that explain the recording as well, by the effect that was named and the one in its place."""
    indistinguishable = {}
    for named in found.named:
        [effect] = [effect for effect in effects if effect.name == named.name]
        close = [rival.name for rival in effect.rivals if rival.inseparable and not rival.wider]
        for other in named.rivals[:RIVALS]:
            name = _added(other, found).name
            if name in close:
                indistinguishable[named.name, name] = other
    return indistinguishable


def _added(other: Fitted, found: Found) -> AbstractEffect:
    """The effect of `other` that the motor of `found` has not."""
    return next(effect for effect in other.template.effects if effect.name not in found.fitted.names)


def _ambiguous(fitted: Fitted, spread: np.ndarray, indistinguishable: dict[tuple[str, str], Fitted]) -> list[str]:
    """What depends on which of them it is."""
    notes = []
    for (name, other), instead in indistinguishable.items():
        away = differs(fitted, spread, instead)
        for place, what, unit in ((0, "gain", "rad/s/V"), (1, "pole", "rad/s")):
            if away[place]:
                own, its = np.exp([fitted.free[place], instead.free[place]])
                notes.append(f"with {other} in place of {name} the {what} is {its:.4g} {unit}, not {own:.4g}")
    return notes


def _unknown(effect: AbstractEffect, error: dict[str, float]) -> tuple[str, ...]:
    if isinstance(effect, AbstractLearnedEffect):
        # Its terms mean nothing one by one.
        return ()
    values = {name: float(getattr(effect, name)) for name in error}
    return tuple(name for name in error if name != "phase_rad" and error[name] > UNKNOWN * abs(values[name]))


def _experiments(
    study: Study, fitted: Fitted, indistinguishable: dict[tuple[str, str], Fitted], told: set[str]
) -> tuple[Experiment, ...]:
    """For each effect that is `told`, what tells it from its rivals that this recording cannot."""
    pairs = {pair: other for pair, other in indistinguishable.items() if pair[0] in told}
    wanted = [experiment(study.solver, pair, fitted.motor, other, study.recording) for pair, other in pairs.items()]
    return tuple(sorted(wanted, key=lambda one: -one.chi2_excess))


def _of_linear(fit: Fit) -> tuple[str, ...]:
    """The notes of `fit` but for what it leaves open: that depends on the effects."""
    told = [one.note for one in fit.open_hypotheses]
    return tuple(note for note in fit.notes if note not in told)


def _notes(known: tuple[str, ...], held: HeldOut, found: Found, effects: tuple[FoundEffect, ...]) -> tuple[str, ...]:
    notes = list(known)
    if not held.own:
        notes.append("the recording is too short to hold a part of it out")
    if held.is_worse:
        notes.append(
            "the extended motor predicts held-out data worse than the linear one: its effects do not carry over"
        )
    if not found.fitted.settled:
        notes.append(
            "the fit of the extended motor did not quite settle; its parameters may be off by more than stated"
        )
    for effect in effects:
        if effect.unknown:
            notes.append(f"{effect.name}: this recording does not determine {', '.join(effect.unknown)}")
    return tuple(notes)
