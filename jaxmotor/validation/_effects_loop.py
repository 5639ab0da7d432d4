"""A closed loop of motors with effects, against the run on the motor itself."""

import dataclasses
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from jaxmotor._precision import to_jax
from jaxmotor._programs import Arrays, program
from jaxmotor.estimate import bucket
from jaxmotor.motor import AbstractController, Begin, Motor, Rows, simulate_motor, steps_for
from jaxmotor.recording import Recording
from jaxmotor.validation._controller import Controller, Law, agreeing_ticks, command, compare_with_log, on_ticks
from jaxmotor.validation._draws import alone, interval, spread
from jaxmotor.validation._response import Rows as Part
from jaxmotor.validation._response import measure, tail_of
from jaxmotor.validation._validation import Band, Comparison, Interval

MOST_STEPS = 10
"""Per tick."""
FEWEST = 20
"""Ticks of a run that says something."""


class HeaderLaw(AbstractController):
    """The controller of a recording's header (`command`), in the loop of a motor with effects."""

    law: Law

    def begin(self) -> Float[Array, ""]:
        return jnp.zeros_like(self.law.gain)

    def volts(
        self, memory: Any, reference: Float[Array, ""], turned: Float[Array, ""], duration: Float[Array, ""]
    ) -> tuple[Float[Array, ""], Any]:
        return command(self.law._replace(reference=reference), memory, turned / duration)


class Rig(NamedTuple):
    """What the motors of one run share."""

    law: Law
    supply: Float[Array, ""]
    period: Float[Array, ""]
    unit: Float[Array, ""]
    """One count [rad]."""
    steps: Int[Array, ""]
    """Per tick."""
    used: Int[Array, ""]
    """Ticks of the run; the others are padding."""
    speed: Float[Array, ""]
    """At its first tick [rad/s]."""
    angle: Float[Array, ""]
    """The same [rad]."""


@dataclasses.dataclass(frozen=True, eq=False)
class LoopOfMotors:
    """One closed-loop segment, and what motors as likely as the fitted one do in its place."""

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
def loops_program(motors: Motor, readings: Float[Array, " batch"], reference: Float[Array, " n"], rig: Rig) -> Arrays:
    """(batch, n) what the controller sees of each of `motors` [rad/s], and the same of one that need not count."""

    def run(motor: Motor, reading: Float[Array, ""]) -> tuple[Float[Array, " n"], Float[Array, " n"]]:
        ticks = jnp.arange(reference.shape[0])
        first = ticks == 0
        initial = jnp.where(first, rig.speed, 0.0)
        rows = Rows(reference, first, initial, ticks.astype(reference.dtype) * rig.period)
        begin = Begin(rig.angle, reading)
        control = HeaderLaw(rig.law)
        done = simulate_motor(motor, rows, rig.period, rig.supply, rig.steps, control, rig.unit, rig.used, begin)
        counted = jnp.diff(jnp.floor(reading + jnp.cumsum(done.seen_turn) / rig.unit), prepend=0.0) * rig.unit
        return _before(counted / rig.period, rig.speed), _before(done.seen_turn / rig.period, rig.speed)

    counted, smooth = jax.vmap(run)(motors, readings)
    return {"counted": counted, "smooth": smooth}


def _before(speed: Float[Array, " n"], first: Float[Array, ""]) -> Float[Array, " n"]:
    """What the controller sees at a tick is the tick before."""
    return jnp.concatenate([first[None], speed[:-1]])


def loop_of_motors(
    motors: Motor,
    recording: Recording,
    index: int,
    controller: Controller,
    *,
    supply_V: float,
    begins_at_rad_s: float = 0.0,
    angle_rad: float = 0.0,
    seed: int = 0,
) -> LoopOfMotors | None:
    """The `closed_loop` segment `index` of `recording`, run by `controller` on each of a batch of `motors`.

    The first of them is the fitted one, the others are drawn as likely as it. `angle_rad` is the shaft's at the first
    row, for laws locked to it. A run is taken up to where the header's controller is no more the one that ran; None
    where that is at once.
    """
    assert recording.period_s is not None
    measured, volts, seen = on_ticks(recording, recording.segments[index], begins_at_rad_s)
    _, now = compare_with_log(controller, recording, measured, volts, seen)
    number = agreeing_ticks(controller, recording, measured, volts, now)
    if number < FEWEST:
        return None
    measured, seen = measured[:number], seen[:number]
    law = controller.law(recording.period_s, now)
    poles = np.asarray(motors.linear.pole)
    reference = np.full(bucket(number), controller.reference_rad_s)
    readings = np.random.default_rng(seed).random(len(poles))
    counts = recording.counts_per_rev
    rig = Rig(
        Law(*(to_jax(np.asarray(value, float)) for value in law)),
        to_jax(np.float64(supply_V)),
        to_jax(np.float64(recording.period_s)),
        # Without an encoder a count is too small to matter.
        to_jax(np.float64(2 * np.pi / counts if counts else 1e-9)),
        to_jax(np.int32(min(steps_for(recording.period_s, float(poles[0])), MOST_STEPS))),
        to_jax(np.int32(number)),
        to_jax(np.float64(begins_at_rad_s)),
        to_jax(np.float64(angle_rad)),
    )
    runs = loops_program(motors, to_jax(readings), to_jax(reference), rig)
    speed = np.asarray(runs["counted"])[:, :number]
    ideal = np.asarray(runs["smooth"])[0, :number]
    return _compared(index, controller, recording.period_s, measured, seen, ideal, speed, begins_at_rad_s)


def _compared(
    index: int,
    controller: Controller,
    period: float,
    measured: np.ndarray,
    seen: np.ndarray,
    ideal: np.ndarray,
    speed: np.ndarray,
    begins_at: float,
) -> LoopOfMotors:
    number, size = len(ideal), bucket(len(ideal))
    curves = np.zeros((len(speed) + 2, size))
    curves[0, :number], curves[1, :number], curves[2:, :number] = ideal, measured, speed
    plateau = np.arange(size) < number
    time = np.arange(size) * period
    part = Part(*map(jnp.asarray, (time, plateau, tail_of(plateau), np.asarray(period), np.asarray(begins_at))))
    every = measure(np.nan_to_num(curves, nan=0.0, posinf=0.0, neginf=0.0), part)
    reference = controller.reference_rad_s

    def compared(values: np.ndarray) -> Comparison:
        return Comparison(alone(float(values[1])), interval(values[2:]))

    return LoopOfMotors(
        segment=index,
        kind=controller.kind,
        reference_rad_s=reference,
        time_s=time[:number],
        measured_rad_s=np.where(seen, measured, np.nan),
        speed=Band(ideal, *spread(speed)),
        rise_time_s=compared(every.rise_time),
        overshoot_percent=compared(every.overshoot),
        steady_error_rad_s=compared(reference - every.final),
        rmse_rad_s=interval(np.sqrt(np.mean((speed - measured)[:, seen] ** 2, axis=1))),
    )
