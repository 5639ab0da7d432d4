"""Closed loop: a speed controller run on the model, against its run on the motor (Fig. 11 and 12, eq. 21)."""

import jax
import numpy as np

from jaxmotor._precision import to_jax
from jaxmotor.estimate import Model
from jaxmotor.motor import warmth
from jaxmotor.prediction import pack
from jaxmotor.recording import Recording
from jaxmotor.validation._controller import Controller, Logged, compare_with_log, on_ticks
from jaxmotor.validation._drawn_motors import draw_motors
from jaxmotor.validation._free_simulation import is_heated, whole_log
from jaxmotor.validation._loops import compared, run_loops
from jaxmotor.validation._open_loop import initial_speed
from jaxmotor.validation._response import Response, tail_of
from jaxmotor.validation._validation import Band, ClosedLoop, Comparison, Interval

OFF_PERCENT = 5.0
"""Share of ticks from which the header's controller is said not to be the one that ran [%]."""
SETTLED = 0.02
"""Share of the change by which the ideal run may still move over the last quarter."""


def validate_closed_loop(
    model: Model, recording: Recording, index: int, controller: Controller, key: jax.Array, simulations: int
) -> ClosedLoop:
    """The `closed_loop` segment `index`, run by `controller`."""
    assert recording.period_s is not None
    segment = recording.segments[index]
    initial = 0.0 if segment.at_rest else initial_speed(model, recording, index)
    logged = on_ticks(recording, segment, initial)
    off, now = compare_with_log(controller, recording.period_s, logged)
    time = np.arange(len(logged.speed)) * recording.period_s
    motors, encoders = jax.random.split(key)
    number = simulations + 1
    runs = run_loops(
        draw_motors(model, number, motors),
        recording,
        index,
        controller,
        now,
        len(time),
        reading=np.asarray(jax.random.uniform(encoders, (number,))),
        ideal=np.arange(number) == 0,
        speed_rad_s=initial,
        warmth=_initial_warmth(model, recording, index),
    )
    run, first = compared(index, controller, time, logged, runs["seen"], initial)
    volts = runs["volts"][1:]
    volts_band, saturated = Band.of(volts), _saturated(volts, controller)
    applied = np.isfinite(logged.volts)
    return ClosedLoop(
        **vars(run),
        gain_V_s_rad=controller.gain_V_s_rad,
        integral_gain_V_rad=controller.integral_gain_V_rad,
        duty_step_V=controller.step_V or float("nan"),
        limit_V=controller.limit_V if np.isfinite(controller.limit_V) else float("nan"),
        measured_volts_V=logged.volts,
        volts=volts_band,
        speed_inside_percent=_inside(logged.speed, run.speed, logged.seen),
        volts_inside_percent=_inside(logged.volts, volts_band, applied),
        controller_off_percent=off,
        theory_error_rad_s=_theory(model, controller),
        theory_error_with_offset_rad_s=_theory_with_offset(model, controller),
        saturated_percent=Comparison.of(_saturated(logged.volts[applied][None], controller)[0], saturated),
        notes=_notes(recording, index, controller, logged, off, runs, first),
    )


def _initial_warmth(model: Model, recording: Recording, index: int) -> float:
    """Relative rise of the winding's resistance where the segment `index` begins [1]."""
    if not is_heated(model.whole):
        return 0.0
    packed = pack(recording, (index,))
    log = whole_log(model.whole, recording, packed)
    rise = warmth(to_jax(model.whole), log.measured_log)
    assert rise is not None
    first = np.argmin(np.where(packed.segment_of == index, packed.row_of, len(recording.segments[index])))
    return float(rise[np.asarray(log.row).reshape(-1)[first]])


def _inside(values: np.ndarray, band: Band, used: np.ndarray) -> float:
    """Share of the `used` ticks whose value lies in the band [%]; limits belong to it, to rounding."""
    slack = 1e-9 * max(float(np.abs(band.high).max()), float(np.abs(band.low).max()))
    inside = (values >= band.low - slack) & (values <= band.high + slack)
    return float(100 * inside[used].mean()) if used.any() else float("nan")


def _saturated(volts: np.ndarray, controller: Controller) -> np.ndarray:
    """(run,) share of ticks at the limit [%]."""
    return 100 * (np.abs(volts) >= controller.limit_V - 0.5 * controller.step_V - 1e-9).mean(axis=1)


def _theory(model: Model, controller: Controller) -> Interval:
    """R/(1 + k G(0)) with what the gain's standard error makes of it; 0 for PI; NaN where the loop has no balance."""
    if controller.kind == "PI":
        return Interval(0.0, 0.0, 0.0)
    loop = 1 + controller.gain_V_s_rad * float(model.motor.gain)
    if loop == 0:
        return Interval.alone(float("nan"))
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
    logged: Logged,
    off: float,
    runs: dict[str, np.ndarray],
    ideal: Response,
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
    return (*notes, *_steady_notes(where, controller, runs, ideal, logged.speed[0]))


def _steady_notes(
    where: str, controller: Controller, runs: dict[str, np.ndarray], ideal: Response, initial: float
) -> list[str]:
    """Where eq. 21 does not apply."""
    tail = tail_of(np.ones(runs["seen"].shape[1], bool))
    last, volts = runs["seen"][0][tail], runs["volts"][0][tail]
    notes = []
    if np.abs(volts).mean() > 0.999 * controller.limit_V:
        notes.append(f"{where}: the reference is beyond what the supply can do; eq. 21 does not hold at the limit")
    if np.ptp(last) > SETTLED * abs(float(ideal.final[0]) - initial) + 1e-9:
        notes.append(
            f"{where}: the model has not settled when the segment ends; the steady state is the mean over its last "
            "quarter"
        )
    return notes
