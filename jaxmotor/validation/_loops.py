"""Motors, encoders and the controller of a header in closed loops, against the run on the motor itself."""

import dataclasses
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from jaxmotor._precision import to_jax
from jaxmotor._programs import Arrays, program
from jaxmotor.motor import Begin, Motor, Rows, SpeedLaw, SpeedLoop, simulate_motor
from jaxmotor.prediction import bucket, shaft_angles, steps_per_row, supply_of
from jaxmotor.recording import Recording
from jaxmotor.validation._controller import Controller, Logged, agreeing_ticks, compare_with_log, on_ticks
from jaxmotor.validation._response import measure_runs
from jaxmotor.validation._validation import Band, Comparison, Interval

FEWEST = 20
"""Ticks of a run that says something."""


class Loop(NamedTuple):
    """What the motors of one run share."""

    law: SpeedLaw
    period: Float[Array, ""]
    """[s]"""
    steps: Int[Array, ""]
    """Per tick."""
    used: Int[Array, ""]
    """Ticks of the run; the others are padding."""
    supply: Float[Array, ""]
    """[V]"""
    speed: Float[Array, ""]
    """At first [rad/s]."""
    angle: Float[Array, ""]
    """Of the shaft at first, for laws locked to it [rad]."""
    warmth: Float[Array, ""]
    """The winding's relative rise of resistance at first."""


class Interface(NamedTuple):
    """Between each motor and its controller."""

    reading: Float[Array, " batch"]
    """Where the encoder stands within a count at first, 0 to 1."""
    count_rad: Float[Array, " batch"]
    """One count [rad]; 0 where the angle is known as it is."""
    step_V: Float[Array, " batch"]
    """One duty [V]; 0 where the command is not quantised."""
    at_tick: Bool[Array, " batch"]
    """The speed at the tick is seen, not the mean over the tick before."""


@dataclasses.dataclass(frozen=True, eq=False)
class LoopOfMotors:
    """One closed-loop segment, and what draws from the covariance of the fitted motor do in its place."""

    segment: int
    kind: str
    """`P` or `PI`."""
    reference_rad_s: float
    time_s: np.ndarray
    measured_rad_s: np.ndarray
    """(n,) speed as the controller saw it; NaN where the tick was lost."""
    speed: Band
    """(n,) as the controller of the fitted motor would see it without rounding; the limits hold 95 % of the runs."""
    rise_time_s: Comparison
    overshoot_percent: Comparison
    steady_error_rad_s: Comparison
    rmse_rad_s: Interval
    """Of a run's speed from the measured one."""


@program
def loops_program(motors: Motor, interfaces: Interface, reference: Float[Array, " n"], loop: Loop) -> Arrays:
    """(batch, n) what the controller sees of each of `motors` [rad/s], the same of one that need not count, and what
    it applies [V].

    At each tick the count is latched, then the voltage set, as format 1 has it.
    """
    ticks = jnp.arange(reference.shape[0])
    first = ticks == 0
    initial, warmth = (jnp.where(first, value, 0.0) for value in (loop.speed, loop.warmth))
    rows = Rows(reference, first, initial, ticks.astype(reference.dtype) * loop.period, warmth=warmth)

    def run(motor: Motor, own: Interface) -> tuple[Float[Array, " n"], ...]:
        done = simulate_motor(
            motor,
            rows,
            loop.period,
            loop.supply,
            loop.steps,
            SpeedLoop(loop.law._replace(step_V=own.step_V)),
            own.count_rad,
            loop.used,
            Begin(loop.angle, own.reading),
            at_tick=own.at_tick,
        )
        # From the tick before the first one on.
        before = jnp.stack([-loop.speed * loop.period, jnp.zeros_like(loop.speed)])
        angle = jnp.concatenate([before, jnp.cumsum(done.seen_turn)[:-1]])
        count = jnp.where(own.count_rad > 0, own.count_rad, 1.0)
        counted = jnp.where(own.count_rad > 0, jnp.floor(own.reading + angle / count) * count, angle)
        seen, smooth = (jnp.diff(angles) / loop.period for angles in (counted, angle))
        return jnp.where(own.at_tick, done.seen_speed, seen), smooth, done.volts

    seen, smooth, volts = jax.vmap(run)(motors, interfaces)
    return {"seen": seen, "smooth": smooth, "volts": volts}


def simulate_loops(
    motors: Motor,
    recording: Recording,
    index: int,
    controller: Controller,
    now: float,
    ticks: int,
    *,
    reading: np.ndarray,
    ideal: np.ndarray,
    speed_rad_s: float = 0.0,
    warmth: float = 0.0,
) -> dict[str, np.ndarray]:
    """`loops_program` over `ticks` ticks of the segment `index`, closed by `controller` on each of a batch of `motors`.

    `now` is that of its law, `reading` (batch,) where in a count each encoder begins; where `ideal` (batch,) neither
    counts nor duties are rounded.
    """
    period, counts, angles = recording.period_s, recording.counts_per_rev, shaft_angles(recording)
    assert period is not None
    instantaneous = recording.measured == "speed" and recording.speed_window_s == 0.0
    count_rad = np.where(ideal, 0.0, 2 * np.pi / counts if counts else 0.0)
    interfaces = Interface(
        *to_jax((reading, count_rad, np.where(ideal, 0.0, controller.step_V), instantaneous & (count_rad == 0)))
    )
    steps = steps_per_row(period, float(np.asarray(motors.linear.pole)[0]))
    angle = 0.0 if angles is None else float(angles[index][0])
    place = (np.float64(value) for value in (supply_of(recording), speed_rad_s, angle, warmth))
    shared = to_jax((np.float64(period), np.int32(steps), np.int32(ticks), *place))
    reference = to_jax(np.full(bucket(ticks), controller.reference_rad_s))
    runs = loops_program(motors, interfaces, reference, Loop(controller.law(now), *shared))
    return {name: np.asarray(values)[:, :ticks] for name, values in runs.items()}


def loop_of_motors(
    motors: Motor, recording: Recording, index: int, controller: Controller, *, seed: int = 0
) -> LoopOfMotors | None:
    """The `closed_loop` segment `index` of `recording`, from rest, run by `controller` on each of a batch of `motors`.

    The first of them is the fitted one, the others are draws from its covariance. A run is taken up to where the
    header's controller is no more the one that ran; None where that is at once.
    """
    assert recording.period_s is not None
    logged = on_ticks(recording, recording.segments[index], 0.0)
    _, now = compare_with_log(controller, recording.period_s, logged)
    number = agreeing_ticks(controller, recording.period_s, logged, now)
    if number < FEWEST:
        return None
    size = len(np.asarray(motors.linear.pole))
    reading = np.random.default_rng(seed).random(size)
    exact = np.zeros(size, bool)
    runs = simulate_loops(motors, recording, index, controller, now, number, reading=reading, ideal=exact)
    logged = Logged(*(values[:number] for values in logged))
    return _compared(index, controller, recording.period_s, logged, runs["smooth"][0], runs["seen"])


def _compared(
    index: int, controller: Controller, period: float, logged: Logged, ideal: np.ndarray, speed: np.ndarray
) -> LoopOfMotors:
    time = np.arange(len(ideal)) * period
    own, _, predicted = measure_runs(logged.speed, np.concatenate([ideal[None], speed]), time, 0.0)
    reference = controller.reference_rad_s

    return LoopOfMotors(
        segment=index,
        kind=controller.kind,
        reference_rad_s=reference,
        time_s=time,
        measured_rad_s=np.where(logged.seen, logged.speed, np.nan),
        speed=dataclasses.replace(Band.of(speed), mean=ideal),
        rise_time_s=Comparison.of(own.rise_time[0], predicted.rise_time),
        overshoot_percent=Comparison.of(own.overshoot[0], predicted.overshoot),
        steady_error_rad_s=Comparison.of(reference - own.final[0], reference - predicted.final),
        rmse_rad_s=Interval.of(np.sqrt(np.mean((speed - logged.speed)[:, logged.seen] ** 2, axis=1))),
    )
