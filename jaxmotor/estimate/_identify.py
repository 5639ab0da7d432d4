"""From a recording to a motor: the steps in their order, each written elsewhere."""

from collections.abc import Iterable
from typing import Literal

import jax
import jax.numpy as jnp
import numpy as np

from jaxmotor._errors import JaxmotorError
from jaxmotor._precision import in_float64, to_numpy
from jaxmotor.estimate._electrical import electrical_share
from jaxmotor.estimate._fingerprint import fingerprint
from jaxmotor.estimate._fit import Fit, Trace
from jaxmotor.estimate._frequency_response import FrequencyResponse
from jaxmotor.estimate._judge import Judgement, judge
from jaxmotor.estimate._lanes import Packed, pack
from jaxmotor.estimate._paper import fit_paper
from jaxmotor.estimate._response_fit import ResponseFit, fit_response
from jaxmotor.estimate._sine_data import SineData, sine_data, sine_segments
from jaxmotor.estimate._sine_fit import Sines, fit_sines
from jaxmotor.estimate._start import data_start
from jaxmotor.estimate._trajectory import MAX_STEPS, Problem, Solution, evaluate, motor_of, solve
from jaxmotor.estimate._uncertainty import Uncertainty, uncertainty
from jaxmotor.recording import Recording, check


@in_float64
def identify(
    recording: Recording,
    *,
    method: Literal["exact", "paper"] = "exact",
    model: Literal["first", "second"] = "first",
    hold_out: Iterable[int] = (),
    seed: int = 0,
) -> Fit:
    """Identify the linear motor that made `recording`.

    `hold_out` are segments (indices) to leave for validation. `seed` draws the random encoder offsets that the
    standard errors may rest on. `model` "second" adds the electrical time constant where the data show one.

    **Raises:** `JaxmotorError`, one sentence, where the recording is damaged or does not determine the motor.
    """
    notes = list(check(recording))
    held_out = tuple(sorted(set(hold_out)))
    fitted = _fitted(recording, held_out)
    packed = pack(recording, fitted)
    problem = as_problem(packed)
    if method == "paper":
        return _paper(recording, packed, problem, fitted, held_out, notes)
    response, response_fit = _response(recording, fitted, notes)
    _needs_more_than_one_frequency(recording, fitted)
    start = _start(problem, response_fit)
    solution = _settled(recording, solve(problem, start))
    errors = uncertainty(problem, solution, jax.random.key(seed))
    if model == "second":
        problem, solution, errors = _second_order(recording, problem, solution, errors, seed, notes)
    judgement = judge(recording, packed, solution, errors)
    return Fit(
        motor=to_numpy(motor_of(solution.psi)),
        standard_error=judgement.standard_error,
        covariance=judgement.covariance,
        offset_V=judgement.offset_V,
        offset_standard_error_V=judgement.offset_standard_error_V,
        method="exact",
        frequency_response=response,
        notes=(*notes, *judgement.notes, *_agreement(response_fit, judgement, solution)),
        **_scores(recording, packed, problem, solution, fitted, held_out),
    )


def as_problem(packed: Packed) -> Problem:
    """`packed` with what the solver needs to know of it."""
    observation, lanes = packed.observation, packed.lanes
    return Problem(
        lanes,
        jnp.asarray(observation.unit),
        jnp.asarray(observation.window_s),
        observation.kind,
        observation.floor_known,
        packed.pieces,
        packed.clusters,
        bool(lanes.free.any()),
    )


def as_sines(data: SineData) -> Sines:
    """`data` on the way into JAX."""
    frequency, time, volts, measured, valid, unit, period = map(
        jnp.asarray,
        (data.frequency_Hz, data.time, data.volts, data.measured, data.valid, data.unit, data.period_s),
    )
    return Sines(frequency, time, volts, measured, valid, unit, period, data.kind, data.window_s, data.floor_known)


def _fitted(recording: Recording, held_out: tuple[int, ...]) -> tuple[int, ...]:
    number = len(recording.segments)
    unknown = [index for index in held_out if not 0 <= index < number]
    if unknown:
        raise JaxmotorError(
            f"{recording.name}: there is no segment {unknown[0]} to hold out; they are 0 to {number - 1}"
        )
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
) -> tuple[FrequencyResponse | None, ResponseFit | None]:
    """The frequency response and the motor that fits it, where there are sines for it."""
    sines = sine_segments(recording, fitted)
    if len({recording.segments[index].parameters["frequency_Hz"] for index in sines}) < 2:
        return None, None
    data = sine_data(recording, fitted)
    response, _ = fit_sines(as_sines(data))
    fit = fit_response(response)
    if not bool(fit.solved):
        notes.append("the fit to the frequency response did not settle; gain and pole come from the whole recording")
        return to_numpy(response), None
    return to_numpy(response), fit


def _needs_more_than_one_frequency(recording: Recording, fitted: tuple[int, ...]) -> None:
    kinds = {recording.segments[index].kind for index in fitted}
    if kinds != {"sine"}:
        return
    frequencies = {float(recording.segments[index].parameters["frequency_Hz"]) for index in fitted}
    if len(frequencies) == 1:
        raise JaxmotorError(
            f"{recording.name}: all segments are sines of one frequency ({frequencies.pop():g} Hz), so nothing checks "
            "the pole they give; record a second frequency, or a step"
        )


def _start(problem: Problem, response_fit: ResponseFit | None) -> jax.Array:
    """(K, b, log a) to start from: the frequency response's where there is one, else the data's own."""
    if response_fit is None:
        return data_start(problem)
    motor = response_fit.motor
    return jnp.stack([motor.gain, jnp.zeros_like(motor.gain), jnp.log(motor.pole)])


def _settled(recording: Recording, solution: Solution) -> Solution:
    if not bool(jnp.isfinite(solution.psi).all()) or int(solution.steps) >= MAX_STEPS:
        raise JaxmotorError(
            f"{recording.name}: the fit did not settle in {MAX_STEPS} steps; the pole is not determined by this "
            "recording, or a column has the wrong unit or sign: look at speed over voltage, and add steps or sines"
        )
    return solution


def _second_order(
    recording: Recording, problem: Problem, first: Solution, errors: Uncertainty, seed: int, notes: list[str]
) -> tuple[Problem, Solution, Uncertainty]:
    """The second-order fit where the data show an electrical time constant, else the first-order one and a note."""
    period = float(np.min(problem.lanes.duration))
    start = jnp.append(first.psi, jnp.log(0.3 * period))
    second = solve(problem, start)
    judged = uncertainty(problem, second, jax.random.key(seed))
    relative = float(jnp.sqrt(jnp.maximum(judged.clustered[3, 3], judged.requantised[3, 3])))
    if not np.isfinite(relative) or int(second.steps) >= MAX_STEPS or relative > 0.3:
        notes.append(
            "the recording does not show an electrical time constant: the first-order model is all that it supports"
        )
        return problem, first, errors
    tau = float(jnp.exp(second.psi[3]))
    frequency, share = electrical_share(recording, tau)
    notes.append(
        f"the recording shows an electrical time constant of {1e3 * tau:.3g} ms: the first-order model neglects "
        f"2 pi f L/R (eq. 10), here {share:.3g} at {frequency:g} Hz"
    )
    return problem, second, judged


def _agreement(fit: ResponseFit | None, judgement: Judgement, solution: Solution) -> list[str]:
    """A note where the frequency response and the whole recording give different motors."""
    if fit is None or solution.psi.shape[0] != 3:
        return []
    logs = jnp.stack([jnp.log(jnp.abs(solution.psi[0])), solution.psi[2]])
    other = jnp.stack([jnp.log(jnp.abs(fit.motor.gain)), jnp.log(fit.motor.pole)])
    own = np.diag(judgement.covariance) / np.array([float(solution.psi[0]) ** 2, float(jnp.exp(solution.psi[2])) ** 2])
    spread = np.sqrt(own + np.diag(fit.covariance))
    apart = np.abs(np.asarray(other - logs))
    if (apart < 4 * spread).all():
        return []
    return [
        f"the sines alone give a gain {100 * float(jnp.expm1(other[0] - logs[0])):+.2g} % and a pole "
        f"{100 * float(jnp.expm1(other[1] - logs[1])):+.2g} % away from the whole recording's: the motor is not "
        "linear to the precision of this recording"
    ]


def _paper(
    recording: Recording,
    packed: Packed,
    problem: Problem,
    fitted: tuple[int, ...],
    held_out: tuple[int, ...],
    notes: list[str],
) -> Fit:
    found = fit_paper(recording, fitted)
    psi = jnp.stack([found.motor.gain, jnp.zeros_like(found.motor.gain), jnp.log(found.motor.pole)])
    solution = evaluate(problem, psi)
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
        **_scores(recording, packed, problem, solution, fitted, held_out),
    )


def _scores(
    recording: Recording,
    packed: Packed,
    problem: Problem,
    solution: Solution,
    fitted: tuple[int, ...],
    held_out: tuple[int, ...],
) -> dict:
    observation = packed.observation
    traces = _traces(packed, np.asarray(solution.residual))
    residual = np.asarray(solution.residual)[packed.lanes.valid]
    return {
        "source": recording.source,
        "period_s": recording.period_s,
        "chi2_per_sample": float((residual**2).mean() / observation.floor),
        "floor_known": observation.floor_known,
        "fit_percent": fit_percent(traces),
        "fitted": fitted,
        "held_out": held_out,
        "fingerprints": tuple(fingerprint(recording, index) for index in fitted),
        "traces": traces,
    }


def fit_percent(traces: tuple[Trace, ...]) -> float:
    """100 (1 - |y - ŷ|/|y - mean y|) over all rows of `traces`."""
    measured = np.concatenate([trace.measured_rad_s for trace in traces])
    simulated = np.concatenate([trace.simulated_rad_s for trace in traces])
    spread = np.linalg.norm(measured - measured.mean())
    return float(100 * (1 - np.linalg.norm(measured - simulated) / spread)) if spread > 0 else float("nan")


def _traces(packed: Packed, residual: np.ndarray) -> tuple[Trace, ...]:
    lanes, observation = packed.lanes, packed.observation
    duration = np.broadcast_to(lanes.duration, lanes.volts.shape)
    per_second = observation.unit / (duration if observation.kind == "turn" else 1.0)
    traces = []
    for segment in np.unique(packed.segment_of[lanes.valid]):
        cells = np.nonzero((packed.segment_of == segment) & lanes.valid)
        order = np.argsort(packed.row_of[cells], kind="stable")
        cells = tuple(axis[order] for axis in cells)
        scale = np.broadcast_to(per_second, lanes.volts.shape)[cells]
        measured = lanes.observed[cells] * scale
        traces.append(Trace(int(segment), packed.time_s[cells], measured, measured - residual[cells] * scale))
    return tuple(traces)
