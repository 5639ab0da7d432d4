"""A model against a recording: which segments may be scored, and each scored in its way."""

import os
from typing import NamedTuple

import jax

from jaxmotor._arguments import check_whole
from jaxmotor._errors import JaxmotorError
from jaxmotor._precision import in_float64
from jaxmotor.estimate import AnyModel, Model, fingerprint, model_of
from jaxmotor.recording import Recording, check_jumps, check_output, lost_ticks, recording_of, warn_sign
from jaxmotor.validation._averaged import as_averaged
from jaxmotor.validation._closed_loop import validate_closed_loop
from jaxmotor.validation._controller import Controller, controller_of
from jaxmotor.validation._drawn_motors import check_covariance
from jaxmotor.validation._free_simulation import has_gap
from jaxmotor.validation._locked import in_place
from jaxmotor.validation._open_loop import has_pieces, score_open_loop
from jaxmotor.validation._steps import validate_steps
from jaxmotor.validation._timed import in_time
from jaxmotor.validation._trials import group_steps
from jaxmotor.validation._validation import Skipped, Validation

SIMULATIONS = 256
"""Of which bands are made, unless told."""
LEAST_SIMULATIONS = 64
"""Fewer give no 95 % band."""
VALUES = 8_000_000
"""Numbers that the simulations of one segment may hold; long segments get fewer simulations."""


class _Plan(NamedTuple):
    """What is done with each segment."""

    fitted: tuple[int, ...]
    skipped: tuple[Skipped, ...]
    open_loop: tuple[int, ...]
    closed_loop: dict[int, Controller]
    notes: tuple[str, ...]


@in_float64
def validate(
    model: AnyModel, recording: Recording | str | os.PathLike[str], *, seed: int = 0, simulations: int = SIMULATIONS
) -> Validation:
    """Hold `model` against those segments of `recording` that it was not fitted to.

    A `Fit`, a `Diagnosis` or the path of a model file will do for the model, a path for the recording.

    Open loop: every segment but rests and closed loops. Steps: trials of equal voltages, averaged. Closed loop: the
    controller in the header run on the model. `seed` draws the parameters and encoder offsets of `simulations` runs
    (at least 64) behind each band. A model with effects is simulated with them.

    **Raises:** `JaxmotorError`, one sentence, where the recording is damaged or nothing in it may be scored.
    """
    model, recording = model_of(model), recording_of(recording)
    check_whole("seed", seed)
    check_whole("simulations", simulations)
    if simulations < LEAST_SIMULATIONS:
        raise JaxmotorError(f"{simulations} simulations give no 95 % band; ask for {LEAST_SIMULATIONS} or more")
    check_output(recording)
    check_jumps(recording)
    check_covariance(model)
    plan = _plan(model, recording)
    _something_left(recording, plan)
    scored = tuple(sorted((*plan.open_loop, *plan.closed_loop)))
    known, simulations = model, _affordable(recording, simulations)
    model, recording, averaged = as_averaged(model, recording, scored)
    model, placed = in_place(model, recording, scored)
    shown, timed = in_time(model, recording, plan.open_loop)
    key = jax.random.key(seed)
    steps = group_steps(recording, plan.open_loop)
    return Validation(
        model=known,
        recording=recording.name,
        fitted=plan.fitted,
        scored=scored,
        skipped=plan.skipped,
        open_loop=score_open_loop(shown, recording, plan.open_loop) if plan.open_loop else None,
        steps=tuple(
            validate_steps(shown, recording, group, jax.random.fold_in(key, group[0]), simulations) for group in steps
        ),
        closed_loop=tuple(
            validate_closed_loop(model, recording, index, controller, jax.random.fold_in(key, index), simulations)
            for index, controller in plan.closed_loop.items()
        ),
        seed=seed,
        simulations=simulations,
        notes=(*_notes(model, recording, plan), *averaged, *placed, *timed, *plan.notes),
    )


def _plan(model: Model, recording: Recording) -> _Plan:
    fitted, skipped, open_loop, notes = [], [], [], []
    closed_loop: dict[int, Controller] = {}
    for index, segment in enumerate(recording.segments):
        reason = _unscorable(recording, index)
        if fingerprint(recording, index) in model.fitted:
            fitted.append(index)
        elif reason is not None:
            skipped.append(Skipped(index, segment.kind, reason))
        elif segment.kind != "closed_loop":
            open_loop.append(index)
        elif isinstance(controller := controller_of(recording, index), Controller):
            closed_loop[index] = controller
        else:
            open_loop.append(index)
            notes.append(
                f"segment {index} is a closed loop that cannot be simulated ({controller}); it is scored in open loop "
                "under the voltage that was logged"
            )
    return _Plan(tuple(fitted), tuple(skipped), tuple(open_loop), closed_loop, tuple(notes))


def _unscorable(recording: Recording, index: int) -> str | None:
    """Why a segment cannot be scored; None where it can."""
    segment = recording.segments[index]
    if segment.kind == "rest":
        return "the motor rests"
    if len(segment) < 2:
        return "it has one row only"
    if not has_pieces(recording, index):
        return "it is too short, or lost too many ticks, to show a speed"
    return None


def _something_left(recording: Recording, plan: _Plan) -> None:
    if plan.open_loop or plan.closed_loop:
        return
    if plan.fitted:
        raise JaxmotorError(
            f"{recording.source}: every segment that could be scored was fitted, so nothing is left to validate on; "
            "hold some out (hold_out of identify, --hold-out), or validate on another recording of the motor"
        )
    reasons = "; ".join(f"segment {skipped.segment}: {skipped.reason}" for skipped in plan.skipped[:3])
    raise JaxmotorError(f"{recording.source}: no segment can be scored ({reasons}); record steps or sines")


def _affordable(recording: Recording, simulations: int) -> int:
    longest = max(len(segment) + lost_ticks(segment) for segment in recording.segments)
    return max(LEAST_SIMULATIONS, min(simulations, VALUES // longest))


def _notes(model: Model, recording: Recording, plan: _Plan) -> list[str]:
    notes = warn_sign(recording)
    if not model.fitted:
        notes.append(
            "the model file does not say which data it was fitted to; if they are in this recording, these scores "
            "are not of held-out data"
        )
    elif not plan.fitted and model.recording == recording.name:
        notes.append(
            "the model comes from a recording of this name, but none of its segments is found again; if the data "
            "were edited since, these scores are not of held-out data"
        )
    if has_gap(model.whole):
        notes.append("where in its gap the load is as a segment begins is fitted to these data: one number each")
    if model.offset_V:
        notes.append(
            f"every simulation includes the voltage offset of {1e3 * model.offset_V:.3g} mV of the rig that the model "
            "was identified on"
        )
    return notes
