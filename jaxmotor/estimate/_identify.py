"""From a recording to a motor: the steps in their order, each written elsewhere."""

import dataclasses
import os
from collections.abc import Callable, Iterable
from typing import Any, Literal, NamedTuple, get_args

import numpy as np

from jaxmotor._arguments import check_choice, check_whole
from jaxmotor._errors import JaxmotorError
from jaxmotor._precision import in_float64, to_jax, to_numpy
from jaxmotor._programs import compile_ahead
from jaxmotor.estimate._assess import (
    EVIDENCE,
    HELD_OFFSET,
    NO_OFFSET,
    UNDETERMINED,
    UNLIKE,
    Assessment,
    assess,
    is_quiet,
    leaves_something,
)
from jaxmotor.estimate._averaging import OF_LOG, averaged, offset_alone, packed_for_average
from jaxmotor.estimate._compiled import evaluate_program, response_program, start_program, trajectory_program
from jaxmotor.estimate._dead_time import dead_time
from jaxmotor.estimate._electrical import electrical_share
from jaxmotor.estimate._estimate import Estimate, fit_whole
from jaxmotor.estimate._fingerprint import fingerprint
from jaxmotor.estimate._fit import Fit
from jaxmotor.estimate._frequency_response import FrequencyResponse
from jaxmotor.estimate._hidden import ENDLESS
from jaxmotor.estimate._model import ModelRig
from jaxmotor.estimate._open_hypotheses import SHOWN
from jaxmotor.estimate._paper import fit_paper
from jaxmotor.estimate._sine_data import sine_data, sine_segments
from jaxmotor.estimate._speed_average import SpeedAverage, average_seen, stated
from jaxmotor.estimate._start import pole_range
from jaxmotor.estimate._timing import MOST_ROWS
from jaxmotor.estimate._traces import chi2_per_sample, fit_percent, traces_of
from jaxmotor.motor import FirstOrder
from jaxmotor.prediction import Packed, Problem, as_angles, as_problem, coarse_stamps, holding, late_readings, pack
from jaxmotor.recording import Recording, Which, check, chosen_segments, is_steady, recording_of

METHODS = Literal["exact", "paper"]
ORDERS = Literal["first", "second"]
FIRST_OFFSET_ROWS = 0.05
"""Timing offset from which it is sought."""
ONE_VOLTAGE = 0.05
"""Part of a voltage by which others are no second one."""
STAMPS = "the time stamps are "
"""How the note on them begins."""
NOT_CONVERGED = "the fit to the frequency response did not converge; gain and pole come from the whole recording"


class Prepared(NamedTuple):
    """A recording that passed its checks, ready to be fitted."""

    recording: Recording
    fitted: tuple[int, ...]
    """Segments to fit."""
    held_out: tuple[int, ...]
    packed: Packed
    average: SpeedAverage | None
    """How speeds were averaged from row to row, where the header does not state it; `recording` does."""
    notes: tuple[str, ...]


class SineMotor(NamedTuple):
    """The motor that the sines alone give."""

    psi: np.ndarray
    """(K, b, log a) of the fit to it."""
    covariance: np.ndarray
    """(2, 2) of (log |K|, log a)."""
    solved: bool


@in_float64
def identify(
    recording: Recording | str | os.PathLike[str],
    *,
    method: METHODS = "exact",
    model: ORDERS = "first",
    hold_out: Which = (),
    seed: int = 0,
) -> Fit:
    """Identify the linear motor that made `recording`, which may be the path of its file.

    `hold_out` are segments to leave for validation: indices, kinds, or text such as "3,7-9,step". `seed` draws the
    random encoder offsets that the standard errors may rest on. `model` "second" adds the electrical time constant
    where the data show one.

    **Raises:** `JaxmotorError`, one sentence, where the recording is damaged or does not determine the motor.
    """
    recording = recording_of(recording)
    check_choice("method", method, get_args(METHODS))
    check_choice("model", model, get_args(ORDERS))
    check_whole("seed", seed)
    if method == "paper" and model == "second":
        raise JaxmotorError("the paper's method is of first order; leave method paper or model second out")
    prepared = prepare(recording, hold_out, few_shapes=True)
    fitted, held_out, packed, notes = prepared.fitted, prepared.held_out, prepared.packed, list(prepared.notes)
    problem = as_problem(packed)
    about = _about(recording, fitted, held_out)
    recording = prepared.recording
    if method == "paper":
        return _paper(recording, packed, problem, fitted, notes, about)
    needs_more_than_one_frequency(recording, fitted)
    needs_transients(recording, fitted)
    _compile_ahead(recording, fitted, packed, model)
    response, sines = _response(recording, fitted, notes)
    psi = sines.psi if sines is not None and sines.solved else _data_start(problem)
    if model == "second":
        estimate = _second_order(recording, problem, fit_whole(recording, problem, psi, seed), seed, notes)
        assessment = assess(recording, packed, *estimate)
    else:
        packed, estimate, assessment = _first_order(recording, fitted, packed, psi, seed)
        assessment = _with_dead_time(recording, packed, estimate, assessment, seed)
    if assessment.average is not None:
        notes = list(check(stated(recording, assessment.average)))
    if assessment.average is assessment.timing is None:
        notes += agreement(sines, assessment)
    return Fit(
        **vars(assessment) | {"average": assessment.average or prepared.average, "notes": (*notes, *assessment.notes)},
        method="exact",
        frequency_response=response,
        **about,
        **scores(packed, np.asarray(estimate.solution.residual)),
    )


def best_guess(recording: Recording, why: str) -> Fit:
    """The linear motor that comes nearest where `identify` refuses to give one, with infinite errors.

    `why` becomes a note. **Raises:** `JaxmotorError` where the recording is damaged.
    """
    prepared = prepare(recording, few_shapes=True)
    problem = as_problem(prepared.packed)
    psi = _data_start(problem)
    solution = evaluate_program(problem, to_jax(psi))
    unknown = to_jax(np.float64(np.inf))
    return Fit(
        motor=to_numpy(FirstOrder(*(to_jax(np.float64(value)) for value in (psi[0], np.exp(psi[2]))))),
        standard_error=to_numpy(FirstOrder(unknown, unknown)),
        covariance=np.diag([np.inf, np.inf]),
        offset_V=float(psi[1] / psi[0]),
        offset_standard_error_V=float("inf"),
        average=prepared.average,
        method="exact",
        frequency_response=None,
        notes=(*prepared.notes, f"a linear motor alone: {why.partition(': ')[2] or why}"),
        **_about(recording, prepared.fitted, ()),
        **scores(prepared.packed, np.asarray(solution["residual"])),
    )


def prepare(recording: Recording, hold_out: Which = (), few_shapes: bool = False) -> Prepared:
    """`recording` checked and packed as `pack` says, without the segments `hold_out`. Numpy only.

    **Raises:** `JaxmotorError`, as `identify`.
    """
    notes = check(recording)
    held_out = chosen_segments(recording, hold_out)
    fitted = _fitted(recording, held_out)
    stamps = _stamps_note(recording, fitted)
    if stamps:
        recording, notes = as_angles(recording), (*notes, stamps)
    average = average_seen(recording, fitted)
    if average is not None:
        recording = stated(recording, average)
        notes = (*check(recording), average.sentence)
    packed = pack(recording, fitted, few_shapes=few_shapes)
    return Prepared(recording, fitted, held_out, packed, average, notes)


def _stamps_note(recording: Recording, fitted: tuple[int, ...]) -> str:
    """Where the stamps of counts bring more error than their rounding, why; else nothing."""
    resolution = coarse_stamps(recording, fitted)
    spread = late_readings(recording, fitted) if resolution is None else None
    if resolution is not None:
        why, advice = f"coarse: whole multiples of {1e3 * resolution:g} ms bring", "print the time in microseconds"
    elif spread is not None:
        why = f"off: readings come {1e3 * spread:.2g} ms (standard deviation) from them at random, which brings"
        advice = "let the board that reads the count stamp it, too"
    else:
        return ""
    return f"{STAMPS}{why} more error than the encoder's rounding, so the error of a reading is estimated; {advice}"


def _fitted(recording: Recording, held_out: tuple[int, ...]) -> tuple[int, ...]:
    fitted = tuple(
        index
        for index, segment in enumerate(recording.segments)
        if index not in held_out and segment.kind != "rest" and len(segment) >= 2
    )
    if not fitted:
        raise JaxmotorError(f"{recording.name}: no segment is left to fit; hold fewer out")
    return fitted


def _response(
    recording: Recording, fitted: tuple[int, ...], notes: list[str]
) -> tuple[FrequencyResponse, SineMotor] | tuple[None, None]:
    """The frequency response and the motor that fits it, where there are sines for it."""
    if not enough_sines(recording, fitted):
        return None, None
    sines, number = sine_data(recording, fitted, few_shapes=True), len(sine_segments(recording, fitted))
    found = {name: np.asarray(value) for name, value in response_program(sines).items()}
    each = (sines.frequency_Hz, found["response"], found["response_covariance"], found["amplitude_V"])
    arrays = (*(values[:number] for values in each), sines.period)
    window = sines.window_s if sines.kind == "speed" else None
    response = to_numpy(FrequencyResponse(*to_jax(arrays), window_s=window))
    if not found["solved"]:
        notes.append(NOT_CONVERGED)
    return response, sine_motor(found)


def enough_sines(recording: Recording, fitted: tuple[int, ...]) -> bool:
    """There are sines of two frequencies among the segments `fitted`."""
    sines = sine_segments(recording, fitted)
    return len({recording.segments[index].sine_Hz for index in sines}) >= 2


def sine_motor(found: dict[str, np.ndarray]) -> SineMotor:
    """From the arrays of `response_program`."""
    psi = np.array([found["gain"], 0.0, np.log(found["pole"])])
    return SineMotor(psi, found["covariance"], bool(found["solved"]))


def needs_more_than_one_frequency(recording: Recording, fitted: tuple[int, ...]) -> None:
    """**Raises:** `JaxmotorError` where all segments are sines of one frequency."""
    frequencies = {recording.segments[index].sine_Hz for index in fitted}
    if len(frequencies) == 1 and (frequency := frequencies.pop()) is not None:
        raise JaxmotorError(
            f"{recording.name}: all segments are sines of one frequency ({frequency:g} Hz), so nothing checks "
            "the pole they give; record a second frequency, or a step"
        )


def needs_transients(recording: Recording, fitted: Iterable[int]) -> None:
    """**Raises:** `JaxmotorError` where all segments are steady states."""
    segments = [recording.segments[index] for index in fitted]
    if segments and all(map(is_steady, segments)):
        raise JaxmotorError(
            f"{recording.name}: all segments are steady states, which show the gain and not how fast the motor comes "
            "to it; record a step from rest too, and join the two"
        )


def _data_start(problem: Problem) -> np.ndarray:
    return np.asarray(start_program(problem, to_jax(pole_range(problem.batch)))["psi"])


def _compile_ahead(recording: Recording, fitted: tuple[int, ...], packed: Packed, model: ORDERS) -> None:
    """The programs of the fit, while its start is sought: of nearly every log of speeds it asks for their average."""

    def fit(problem: Callable[[], Problem], size: int) -> None:
        compile_ahead(trajectory_program, lambda: (problem(), to_jax(np.zeros(size)), to_jax(np.uint32(0))))

    def with_average() -> Problem:
        own = packed_for_average(recording, fitted, packed.observation.noise)
        return as_problem(own, True, np.zeros(3 + len(OF_LOG), bool))

    fit(lambda: as_problem(packed), 3)
    if model == "first" and _is_unstated(recording):
        fit(with_average, 3 + len(OF_LOG))
    if model == "first" and _is_one_voltage(packed):
        fit(lambda: holding(as_problem(packed), HELD_OFFSET), 3)


Whole = tuple[Packed, Estimate, Assessment]


def _first_order(recording: Recording, fitted: tuple[int, ...], packed: Packed, psi: np.ndarray, seed: int) -> Whole:
    """The fit from `psi`; without a voltage offset where a single voltage was applied, which does not tell the two
    apart, and the gain is determined only then.

    **Raises:** `JaxmotorError` where it does not settle.
    """
    ends: list[Whole | JaxmotorError] = []
    for offset in (True, False) if _is_one_voltage(packed) else (True,):
        try:
            ends.append(_fit_of(recording, fitted, packed, psi * [1, offset, 1], seed, offset))
        except JaxmotorError as refused:
            ends.append(refused)
        if _gain_is_known(ends[-1]):
            break
    found = next((end for end in (ends[-1], *ends) if not isinstance(end, JaxmotorError)), ends[-1])
    if isinstance(found, JaxmotorError):
        raise found
    return found


def _gain_is_known(found: Whole | JaxmotorError) -> bool:
    """Beside an offset, by more than the shape of one step."""
    if isinstance(found, JaxmotorError):
        return False
    packed, (_, errors), assessment = found
    by_blocks = is_quiet(packed, errors) or float(errors.degrees_of_freedom[0]) > ENDLESS
    return bool(by_blocks and np.sqrt(assessment.covariance[0, 0]) < UNDETERMINED * abs(float(assessment.motor.gain)))


def _is_one_voltage(packed: Packed) -> bool:
    """All rows have the same voltage, but for those without any."""
    volts = packed.batch.volts[packed.batch.valid & (packed.batch.volts != 0)]
    return bool(volts.size and np.ptp(volts) < ONE_VOLTAGE * np.abs(volts).max())


def _fit_of(
    recording: Recording, fitted: tuple[int, ...], packed: Packed, psi: np.ndarray, seed: int, offset: bool = True
) -> Whole:
    """The fit from `psi`, with what the header does not state of the log where that explains it; without `offset` that
    of `psi` stays.

    **Raises:** `JaxmotorError` where it does not settle.
    """
    unstated = _is_unstated(recording)
    noise = packed.observation.noise
    held = () if offset else HELD_OFFSET
    try:
        plain = fit_whole(recording, holding(as_problem(packed), held), psi, seed)
    except JaxmotorError:
        found = averaged(recording, fitted, noise, psi, seed, held) if unstated else None
        if found is None:
            raise
        return found
    if unstated and leaves_something(plain.errors):
        found = averaged(recording, fitted, noise, np.asarray(plain.solution.psi), seed, held)
        if found is not None:
            return found
    timed = _timed(recording, fitted, packed, plain, seed) if offset else None
    return timed or (packed, plain, assess(recording, packed, *plain, held=held))


def _is_unstated(recording: Recording) -> bool:
    """The header does not say over how long speeds were averaged."""
    return recording.measured == "speed" and recording.speed_window_s is None


def _timed(recording: Recording, fitted: tuple[int, ...], packed: Packed, untimed: Estimate, seed: int) -> Whole | None:
    """The fit with the log's timing offset, where its header does not state the timing and an offset explains the log.

    That is where no friction and no delay are left to be seen and, of counts, nothing beside their rounding.
    """
    if recording.duty_delay_s is not None or float(untimed.errors.evidence) <= EVIDENCE:
        return None
    packed = packed_for_average(recording, fitted, packed.observation.noise)
    timed = _with_offset(recording, packed, np.asarray(untimed.solution.psi), seed)
    if timed is None:
        return None
    explained = float(timed.errors.evidence) <= EVIDENCE
    explained &= is_quiet(packed, timed.errors) or not packed.observation.floor_known
    if not explained or abs(float(timed.solution.psi[-1])) > MOST_ROWS:
        return None
    assessment = assess(recording, packed, *timed, ("offset",))
    return (packed, timed, assessment) if assessment.timing is not None and assessment.timing.shows else None


def _with_offset(recording: Recording, packed: Packed, psi: np.ndarray, seed: int) -> Estimate | None:
    """The fit from ψ (3,) with a timing offset; None where it does not settle."""
    if _is_unstated(recording):
        return offset_alone(recording, packed, psi, seed)
    try:
        return fit_whole(recording, as_problem(packed, timed=True), np.append(psi, FIRST_OFFSET_ROWS), seed)
    except JaxmotorError:
        return None


def _with_dead_time(
    recording: Recording, packed: Packed, estimate: Estimate, assessment: Assessment, seed: int
) -> Assessment:
    """`assessment`; of a motor that it does not determine, and with laws that to first order are the most likely ones,
    with the note on a dead time in their place, if there is one."""
    notes = assessment.notes
    shown = [note for note in notes if note.startswith(SHOWN)]
    is_known = assessment.average is not None or assessment.timing is not None
    if is_known or not shown or not any(note.endswith(UNLIKE) for note in notes):
        return assessment
    late = dead_time(recording, packed, estimate, seed, HELD_OFFSET if NO_OFFSET in notes else ())
    if late is None:
        return assessment
    return dataclasses.replace(assessment, notes=tuple(late.note if note in shown else note for note in notes))


def _second_order(recording: Recording, problem: Problem, first: Estimate, seed: int, notes: list[str]) -> Estimate:
    """The second-order fit where its time constant is seen at all, else the first-order one; and a note on it."""
    start = np.append(np.asarray(first.solution.psi), np.log(0.3 * float(np.min(problem.batch.duration))))
    second = _shown(recording, problem, start, seed)
    if second is None:
        notes.append(
            "the recording does not show an electrical time constant: the first-order model is all that it supports"
        )
        return first
    tau = float(np.exp(second.solution.psi[3]))
    frequency, share = electrical_share(recording, tau)
    doubt = ""
    if second.errors.evidence > EVIDENCE and abs(float(second.errors.allowance[3])) > 0.3:
        doubt = "; a delay or friction would look alike, so it may not be electrical"
    notes.append(
        f"a time constant of {1e3 * tau:.3g} ms is seen, which the first-order model neglects: 2 pi f L/R (eq. 10) is "
        f"{share:.3g} at {frequency:g} Hz{doubt}"
    )
    return second


def _shown(recording: Recording, problem: Problem, start: np.ndarray, seed: int) -> Estimate | None:
    """The second-order fit, or None where its time constant is not known to a third of itself."""
    try:
        second = fit_whole(recording, problem, start, seed)
    except JaxmotorError:
        return None
    variance = max(float(second.errors.clustered[3, 3]), float(second.errors.requantised[3, 3]))
    return second if np.sqrt(variance) < 0.3 else None


def agreement(sines: SineMotor | None, assessment: Assessment) -> list[str]:
    """A note where the frequency response and the whole recording give different motors."""
    if sines is None or not sines.solved or assessment.covariance.shape != (2, 2):
        return []
    own = np.array([float(assessment.motor.gain), float(assessment.motor.pole)])
    apart = np.array([sines.psi[0], np.exp(sines.psi[2])]) / own - 1
    spread = np.sqrt(np.diag(assessment.covariance) / own**2 + np.diag(sines.covariance))
    if (np.abs(apart) < 4 * spread).all():
        return []
    return [
        f"the sines alone give a gain {100 * apart[0]:+.2g} % and a pole {100 * apart[1]:+.2g} % away from the whole "
        "recording's: the motor is not linear to the precision of this recording"
    ]


def _paper(
    recording: Recording,
    packed: Packed,
    problem: Problem,
    fitted: tuple[int, ...],
    notes: list[str],
    about: dict[str, Any],
) -> Fit:
    found = fit_paper(recording, fitted)
    psi = np.array([float(found.motor.gain), 0.0, np.log(float(found.motor.pole))])
    residual = np.asarray(evaluate_program(problem, to_jax(psi))["residual"])
    errors = np.array([float(found.standard_error.gain), float(found.standard_error.pole)])
    return Fit(
        motor=to_numpy(found.motor),
        standard_error=to_numpy(found.standard_error),
        covariance=np.diag(errors**2),
        offset_V=0.0,
        offset_standard_error_V=0.0,
        method="paper",
        frequency_response=to_numpy(found.response),
        notes=(
            *notes,
            "the paper's method reads the speed from the previous count, which its model lacks: the pole it gives is "
            "too low (15 to 20 % at a period of 5 ms), and its standard error does not know",
        ),
        **about,
        **scores(packed, residual),
    )


def _about(recording: Recording, fitted: tuple[int, ...], held_out: tuple[int, ...]) -> dict[str, Any]:
    return {
        "source": recording.source,
        "period_s": recording.period_s,
        "rig": ModelRig(*(getattr(recording, key) for key in ModelRig._fields)),
        "fitted": fitted,
        "held_out": held_out,
        "fingerprints": tuple(fingerprint(recording, index) for index in fitted),
    }


def scores(packed: Packed, residual: np.ndarray) -> dict[str, Any]:
    """How well a fit does that leaves `residual` (sequence, row) [units]."""
    observation = packed.observation
    traces = traces_of(packed, residual)
    return {
        "chi2_per_sample": chi2_per_sample(packed, residual, packed.batch.valid),
        "floor_known": observation.floor_known,
        "noise": observation.noise,
        "fit_percent": fit_percent(traces),
        "traces": traces,
    }
