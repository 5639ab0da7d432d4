"""Closed loop: a speed controller run on the model, against its run on the motor (Fig. 11 and 12, eq. 21)."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from jaxmotor._precision import to_jax
from jaxmotor.estimate import Model
from jaxmotor.motor import warmth
from jaxmotor.prediction import bucket, pack, shaft_angles, supply_of
from jaxmotor.recording import Recording
from jaxmotor.validation._controller import Controller, compare_with_log, on_ticks
from jaxmotor.validation._drawn_motors import draw_motors
from jaxmotor.validation._draws import alone, interval, psi_of, relative_root, spread
from jaxmotor.validation._effects_loop import Place, run_loops
from jaxmotor.validation._effects_open import whole_log
from jaxmotor.validation._loop_simulation import Sensor, simulate_loops
from jaxmotor.validation._open_loop import initial_speed
from jaxmotor.validation._response import Measures, Rows, measure, tail_of
from jaxmotor.validation._validation import Band, ClosedLoop, Comparison, Interval

OFF_PERCENT = 5.0
"""Share of ticks from which the header's controller is said not to be the one that ran [%]."""
SETTLED = 0.02
"""Share of the change by which the ideal run may still move over the last quarter."""


class Measured(NamedTuple):
    """The motor's own run, at every tick."""

    speed: np.ndarray
    """(n,) as the controller saw it [rad/s]; over a gap the mean."""
    volts: np.ndarray
    """(n,) [V], NaN where the tick was lost."""
    seen: np.ndarray
    """(n,) `speed` was measured at this tick."""


class Runs(NamedTuple):
    """Simulated runs (1 + simulation, n), the ideal one of the model itself first."""

    speed: np.ndarray
    """As the controller saw it [rad/s]."""
    volts: np.ndarray
    """[V]"""


class Ran(NamedTuple):
    """What ran, and for how long."""

    recording: Recording
    segment: int
    controller: Controller
    now: float
    """Of the controller's law."""
    begins_at: float
    """[rad/s]"""
    ticks: int


def validate_closed_loop(
    model: Model, recording: Recording, index: int, controller: Controller, key: jax.Array, simulations: int
) -> ClosedLoop:
    """The `closed_loop` segment `index`, run by `controller`."""
    assert recording.period_s is not None
    segment = recording.segments[index]
    begins_at = 0.0 if segment.at_rest else initial_speed(model, recording, index)
    measured = Measured(*on_ticks(recording, segment, begins_at))
    off, now = compare_with_log(controller, recording, *measured)
    ran = Ran(recording, index, controller, now, begins_at, len(measured.speed))
    runs = _simulated(model, ran, key, simulations)
    speed, volts = runs.speed[1:], runs.volts[1:]
    time = np.arange(len(measured.speed)) * recording.period_s
    own, first, predicted = _responses(runs.speed, measured.speed, time, begins_at)
    saturated = _saturated(volts, controller)
    speed_band, volts_band = _band(speed), _band(volts)
    logged = np.isfinite(measured.volts)
    reference = controller.reference_rad_s
    return ClosedLoop(
        segment=index,
        kind=controller.kind,
        reference_rad_s=reference,
        gain_V_s_rad=controller.gain_V_s_rad,
        integral_gain_V_rad=controller.integral_gain_V_rad,
        duty_step_V=controller.step_V or float("nan"),
        limit_V=controller.limit_V if np.isfinite(controller.limit_V) else float("nan"),
        time_s=time,
        measured_speed_rad_s=np.where(measured.seen, measured.speed, np.nan),
        measured_volts_V=measured.volts,
        speed=speed_band,
        volts=volts_band,
        speed_inside_percent=_inside(measured.speed, speed_band, measured.seen),
        volts_inside_percent=_inside(measured.volts, volts_band, logged),
        controller_off_percent=off,
        rise_time_s=_compare(own.rise_time, predicted.rise_time),
        overshoot_percent=_compare(own.overshoot, predicted.overshoot),
        steady_speed_rad_s=_compare(own.final, predicted.final),
        steady_error_rad_s=_compare(reference - own.final, reference - predicted.final),
        theory_error_rad_s=_theory(model, controller),
        theory_error_with_offset_rad_s=_theory_with_offset(model, controller),
        saturated_percent=_compare(_saturated(measured.volts[logged][None], controller), saturated),
        notes=(*_notes(recording, index, controller, measured, off, runs, first), *_effect_notes(model, ran)),
    )


def _simulated(model: Model, ran: Ran, key: jax.Array, simulations: int) -> Runs:
    """(1 + simulations, number of ticks), the ideal run of the model first."""
    if model.effects:
        return _simulated_with_effects(model, ran, key, simulations)
    recording = ran.recording
    assert recording.period_s is not None
    runs = simulate_loops(
        jnp.asarray(psi_of(model)),
        jnp.asarray(relative_root(model)),
        simulations + 1,
        ran.controller.law(recording.period_s, ran.now),
        _sensor(recording),
        jnp.asarray(ran.begins_at),
        jnp.asarray(recording.period_s),
        jnp.zeros(bucket(ran.ticks)),
        key,
    )
    return Runs(*(np.asarray(values)[:, : ran.ticks] for values in runs))


def _simulated_with_effects(model: Model, ran: Ran, key: jax.Array, simulations: int) -> Runs:
    recording, angles = ran.recording, shaft_angles(ran.recording)
    angle = 0.0 if angles is None else float(angles[ran.segment][0])
    place = Place.of(supply_of(recording), ran.begins_at, angle, _rise(model, recording, ran.segment))
    of_motors, of_encoders = jax.random.split(key)
    motors = draw_motors(model, simulations + 1, of_motors)
    rounded, seed = np.arange(simulations + 1) > 0, int(jax.random.bits(of_encoders))
    runs = run_loops(motors, rounded, ran.ticks, (recording, ran.controller, ran.now), place, seed)
    return Runs(runs["counted"], runs["volts"])


def _rise(model: Model, recording: Recording, index: int) -> float:
    """Of the winding's resistance where the segment `index` begins [1]."""
    packed = pack(recording, (index,))
    log = whole_log(model.whole, recording, packed)
    rise = warmth(to_jax(model.whole), log.measured_log)
    first = np.argmin(np.where(packed.segment_of == index, packed.row_of, len(recording.segments[index])))
    return 0.0 if rise is None else float(rise[np.asarray(log.row).reshape(-1)[first]])


def _sensor(recording: Recording) -> Sensor:
    counts = recording.counts_per_rev
    return Sensor(
        jnp.asarray(2 * np.pi / counts if counts else 1.0),
        jnp.asarray(counts is not None),
        jnp.asarray(recording.measured == "speed" and recording.speed_window_s == 0.0),
    )


def _responses(
    runs: np.ndarray, measured: np.ndarray, time: np.ndarray, begins_at: float
) -> tuple[Measures, Measures, Measures]:
    """Of the measured speed, of the ideal run, and of the simulated runs."""
    number, size = len(time), bucket(len(time))
    curves = np.zeros((len(runs) + 1, size))
    curves[:-1, :number], curves[-1, :number] = runs, measured
    plateau = np.arange(size) < number
    period = float(time[1] - time[0])
    rows = Rows(
        jnp.asarray(np.arange(size) * period),
        jnp.asarray(plateau),
        jnp.asarray(tail_of(plateau)),
        jnp.asarray(period),
        jnp.asarray(begins_at),
    )
    every = measure(curves, rows)
    return every.of(slice(-1, None)), every.of(slice(0, 1)), every.of(slice(1, -1))


def _band(runs: np.ndarray) -> Band:
    low, high = spread(runs)
    return Band(runs.mean(axis=0), low, high)


def _inside(values: np.ndarray, band: Band, used: np.ndarray) -> float:
    """Share of the `used` ticks whose value lies in the band [%]; limits belong to it, to rounding."""
    slack = 1e-9 * max(float(np.abs(band.high).max()), float(np.abs(band.low).max()))
    inside = (values >= band.low - slack) & (values <= band.high + slack)
    return float(100 * inside[used].mean()) if used.any() else float("nan")


def _compare(measured: np.ndarray, predicted: np.ndarray) -> Comparison:
    low = interval(predicted)
    slack = 1e-9 * abs(low.value)
    return Comparison(alone(float(measured[0])), Interval(low.value, low.low - slack, low.high + slack))


def _saturated(volts: np.ndarray, controller: Controller) -> np.ndarray:
    """(run,) share of ticks at the limit [%]."""
    return 100 * (np.abs(volts) >= controller.limit_V - 0.5 * controller.step_V - 1e-9).mean(axis=1)


def _theory(model: Model, controller: Controller) -> Interval:
    """R/(1 + k G(0)) with what the gain's standard error makes of it; 0 for PI; NaN where the loop has no balance."""
    if controller.kind == "PI":
        return Interval(0.0, 0.0, 0.0)
    loop = 1 + controller.gain_V_s_rad * float(model.motor.gain)
    if loop == 0:
        return alone(float("nan"))
    value, error = controller.reference_rad_s / loop, float(np.sqrt(max(model.covariance[0, 0], 0.0)))
    half = 1.96 * abs(value * controller.gain_V_s_rad / loop) * error
    return Interval(value, value - half, value + half)


def _theory_with_offset(model: Model, controller: Controller) -> float:
    """(R - G(0) u0)/(1 + k G(0)): the offset u0 is a disturbance that the loop leaves a share of; 0 for PI."""
    gain = float(model.motor.gain)
    disturbance = (
        0.0 if controller.kind == "PI" else gain * model.offset_V / (1 + controller.gain_V_s_rad * gain or np.nan)
    )
    return _theory(model, controller).value - disturbance


def _notes(
    recording: Recording,
    index: int,
    controller: Controller,
    measured: Measured,
    off: float,
    runs: Runs,
    ideal: Measures,
) -> tuple[str, ...]:
    notes = []
    where = f"segment {index}"
    segment = recording.segments[index]
    if off > OFF_PERCENT:
        notes.append(
            f"{where}: the controller in the header is not what the rig ran: in {off:.0f} % of the ticks the logged "
            "command is more than one duty off what it makes of the measured speeds; the prediction is of the header's"
        )
    if recording.counts_per_rev is None:
        notes.append(f"{where}: no counts_per_rev is known, so the prediction has no encoder quantisation")
    elif recording.measured != "count":
        notes.append(f"{where}: the encoder is simulated from counts_per_rev, which the log does not show")
    window, period = recording.speed_window_s, recording.period_s
    if recording.measured == "speed" and window and period and abs(window - period) > 1e-6 * period:
        notes.append(f"{where}: speeds were averaged over {window:g} s; the controller is simulated with one tick")
    if recording.supply_V is None:
        notes.append(f"{where}: the supply is not known, so the prediction does not saturate")
    if controller.step_V == 0:
        notes.append(f"{where}: volts were logged, so the prediction has no duty quantisation")
    if controller.kind == "PI" and not segment.at_rest:
        notes.append(f"{where}: it begins in motion; the integral is taken to begin at zero")
    return (*notes, *_steady_notes(where, controller, runs, ideal, measured.speed[0]))


def _effect_notes(model: Model, ran: Ran) -> list[str]:
    if not model.effects or not _sensor(ran.recording).instantaneous:
        return []
    return [
        f"segment {ran.segment}: speeds were logged as they are at the tick; with effects the controller is simulated "
        "on the mean over the tick before"
    ]


def _steady_notes(where: str, controller: Controller, runs: Runs, ideal: Measures, begins_at: float) -> list[str]:
    """Where eq. 21 does not apply."""
    tail = tail_of(np.ones(runs.speed.shape[1], bool))
    last, volts = runs.speed[0][tail], runs.volts[0][tail]
    notes = []
    if np.abs(volts).mean() > 0.999 * controller.limit_V:
        notes.append(f"{where}: the reference is beyond what the supply can do; eq. 21 does not hold at the limit")
    if np.ptp(last) > SETTLED * abs(float(ideal.final[0]) - begins_at) + 1e-9:
        notes.append(
            f"{where}: the model has not settled when the segment ends; the steady state is the mean over its last "
            "quarter"
        )
    return notes
