"""From a recording to what its linear model gets wrong, why, and how much an extended model improves it."""

import dataclasses
import os
from collections.abc import Callable

import numpy as np

from jaxmotor._arguments import check_whole
from jaxmotor._errors import JaxmotorError
from jaxmotor._precision import in_float64
from jaxmotor.diagnosis._curves import learned_laws
from jaxmotor.diagnosis._diagnosis import Diagnosis, Verdict
from jaxmotor.diagnosis._errors import (
    at_least,
    covariance,
    linear_covariance,
    linear_errors,
    with_indistinguishable,
)
from jaxmotor.diagnosis._experiment import Experiment, experiment, joined
from jaxmotor.diagnosis._explain import Explanation, depends_on_time_only, explained, is_disturbed, is_explained
from jaxmotor.diagnosis._found import Found
from jaxmotor.diagnosis._found_effect import FoundEffect
from jaxmotor.diagnosis._free import of_motor
from jaxmotor.diagnosis._held_out import HeldOut, before_after
from jaxmotor.diagnosis._input_convention import is_applied_until_row
from jaxmotor.diagnosis._joint import joint_covariance
from jaxmotor.diagnosis._left_open import left_open, moves
from jaxmotor.diagnosis._level import with_convention
from jaxmotor.diagnosis._loops import loop_gains
from jaxmotor.diagnosis._request import Asked, Progress, Request
from jaxmotor.diagnosis._solve import Fitted
from jaxmotor.diagnosis._study import Study
from jaxmotor.diagnosis._timed import timing_of, with_average
from jaxmotor.diagnosis._trial import rig_of
from jaxmotor.diagnosis._weighed import (
    UNKNOWN,
    ambiguous,
    families,
    found_effects,
    indistinguishable_motors,
    judged_by,
    probabilities,
)
from jaxmotor.estimate import SHOWN, STAMPS, Fit, best_guess, identify, needs_transients
from jaxmotor.motor.effects import AbstractDisturbance, AbstractLearnedEffect
from jaxmotor.prediction import as_angles
from jaxmotor.recording import EARLY, Recording, check, recording_of

LINE = (
    "the gain is that of the straight line through the curve over the voltage, and the volts of other effects are "
    "voltages on that line"
)
BEGINS = "the log does not hold the angle at which each segment begins: it was fitted to what is locked to the angle"


@in_float64
def diagnose(
    recording: Recording | str | os.PathLike[str],
    *,
    effects: Asked | None = None,
    exclude: Asked = (),
    seed: int = 0,
    on_progress: Callable[[Progress], object] | None = None,
) -> Diagnosis:
    """Say what the linear motor of `recording` gets wrong, name the causes, and measure how much they improve it.

    `recording` may be the path of its file. Only `effects` (names, such as those in `EFFECTS`, and classes of your own;
    None: all that are known) without those in `exclude` are sought. `on_progress` is called with a `Progress` as the
    work goes on, by one thread at a time; what it raises ends the work.

    `seed` draws the shuffles that tell a dependence from chance, and encoder offsets.

    **Raises:** `JaxmotorError`, one sentence, where the recording does not determine a linear motor.
    """
    recording = recording_of(recording)
    check_whole("seed", seed)
    needs_transients(recording, range(len(recording.segments)))
    request = Request(effects, exclude, on_progress)
    request.tell(0)
    fit, refused = _linear_fit(recording, seed)
    if recording.measured == "count" and not fit.floor_known:
        recording = as_angles(recording)
    if fit.average is None:  # else the study is of a log that states one, whose noise is another
        request.keep_noise(recording, False, fit.noise)
    known = explained(recording, fit, request, seed)
    fit, study, found, before, after = known.fit, known.study, known.found, known.before, known.after
    held = known.held
    found = judged_by(held, found, known.search.explained)
    request.tell(3)
    verdict = _verdict(known, held)
    level = with_average(covariance(found.fitted, study.solver.block), fit)
    spread = with_convention(level, study.solver, found.fitted)
    if refused is not None and not (found.named and spread[1, 1] < UNKNOWN**2):
        raise refused
    if not found.named and refused is None:
        # A delay below what shows moves a linear motor, too: `identify` allows for that.
        linear = fit.standard_error
        spread = at_least(spread, np.abs([linear.gain / fit.motor.gain, linear.pole / fit.motor.pole]).astype(float))
    every = found_effects(study, held, found, spread)
    timing = timing_of(found.fitted, spread)
    laws = learned_laws(known.search, found, held, level, study.solver.block, partial=verdict == "unexplained")
    every = tuple(dataclasses.replace(one, curve=laws.get(one.name)) for one in every)
    causes = tuple(one for one in every if not isinstance(one.effect, AbstractDisturbance))
    indistinguishable = indistinguishable_motors(found, every)
    errors = linear_errors(found.fitted, with_indistinguishable(found.fitted, spread, list(indistinguishable.values())))
    opened, allowed = left_open(study, fit, found, errors)
    undecided = verdict == "complete" and moves(opened, found.fitted.motor)
    return Diagnosis(
        fit=fit,
        linear=of_motor(found.linear.motor),
        motor=of_motor(found.fitted.motor),
        standard_error=errors,
        covariance=linear_covariance(found.fitted, spread),
        joint=joint_covariance(found.fitted, spread, rig_of(study.recording, study.trial)),
        effects=causes,
        disturbances=tuple(one for one in every if one not in causes),
        probabilities=probabilities(found, every),
        families=families(found, every),
        verdict="unexplained" if undecided else verdict,
        held_out=before_after(held.segments, held.before, held.after, seed, held.in_part),
        whole=before_after(fit.fitted, before.scored, after.scored, seed),
        adds_up=float(study.trial.memory) > 0,
        closed_loop=loop_gains(study, found, seed),
        residual_voltage=before.residual_voltage,
        dependences=before.dependences,
        unexplained_voltage=after.residual_voltage,
        unexplained_dependences=after.dependences,
        learned=tuple(laws.values()),
        experiments=_experiments(study, found.fitted, indistinguishable, {one.name for one in every if one.is_told}),
        notes=_once(
            *_notes(
                _of_linear(fit, recording, study)
                if verdict == "unexplained" and not found.named
                else check(study.recording),
                held,
                found,
                every,
            ),
            *ambiguous(found.fitted, spread, indistinguishable),
            *(one.sentence for one in (fit.average, timing) if one is not None),
            *(note for note in fit.notes if note.startswith(STAMPS)),
            *(one.note for one in opened),
            *([BEGINS] if study.recording.segments[0].begins_rad is not None else []),
            *([EARLY] if verdict == "unexplained" and is_applied_until_row(study, found.fitted) else []),
        ),
        open_hypotheses=opened,
        allowed=allowed,
        undecided=undecided,
        timing=timing,
        average=fit.average,
    )


def _once(*notes: str) -> tuple[str, ...]:
    return tuple(dict.fromkeys(notes))


def _linear_fit(recording: Recording, seed: int) -> tuple[Fit, JaxmotorError | None]:
    """The linear motor, and why the recording does not determine it, where that is so: an effect may be why."""
    try:
        return identify(recording, seed=seed), None
    except JaxmotorError as refused:
        return best_guess(recording, str(refused)), refused


def _verdict(known: Explanation, held: HeldOut) -> Verdict:
    study, found, after = known.study, known.found, known.after
    if held.is_worse or (not found.named and any(map(depends_on_time_only, known.before.dependences))):
        return "unexplained"
    if is_disturbed(found.fitted) or not is_explained(study, found.fitted, found.linear):
        return "unexplained"
    loud = after.residual_voltage.rms_V > 1.25 * after.residual_voltage.noise_V
    if loud and after.dependences and after.dependences[0].beyond_chance and depends_on_time_only(after.dependences[0]):
        return "unexplained"
    return "extended" if found.named else "complete"


def _experiments(
    study: Study, fitted: Fitted, indistinguishable: dict[tuple[str, str], Fitted], told: set[str]
) -> tuple[Experiment, ...]:
    """For each effect that is `told`, what tells it from the alternatives that this recording cannot."""
    pairs = {pair: other for pair, other in indistinguishable.items() if pair[0] in told}
    wanted = [experiment(study.solver, pair, fitted.motor, other, study.recording) for pair, other in pairs.items()]
    return joined(sorted(wanted, key=lambda one: -one.chi2_excess))


def _of_linear(fit: Fit, recording: Recording, study: Study) -> tuple[str, ...]:
    """The notes of `fit` but for the laws that it shows or leaves open, of which the diagnosis knows more, and for what
    the header of `recording` does not state and the `study` has found."""
    told = {one.note for one in fit.open_hypotheses} | (set(check(recording)) - set(check(study.recording)))
    return tuple(note for note in fit.notes if note not in told and not note.startswith(SHOWN))


def _notes(known: tuple[str, ...], held: HeldOut, found: Found, effects: tuple[FoundEffect, ...]) -> tuple[str, ...]:
    notes = list(known)
    if not held.own:
        notes.append("the recording is too short to hold a part of it out")
    if held.is_worse:
        notes.append(
            "by its drift the extended motor predicts held-out data worse than the linear one: its effects do not "
            "carry over"
        )
    if not found.fitted.converged:
        notes.append(
            "the fit of the extended motor did not fully converge; its parameters may be off by more than stated"
        )
    if any(one.effect.over == "voltage" and isinstance(one.effect, AbstractLearnedEffect) for one in effects):
        notes.append(LINE)
    for effect in effects:
        if effect.unknown:
            notes.append(f"{effect.name}: this recording does not determine {', '.join(effect.unknown)}")
    return tuple(notes)
