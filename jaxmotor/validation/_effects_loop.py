"""A closed loop of motors with effects, against the run on the motor itself."""

import dataclasses
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from jaxmotor._precision import to_jax
from jaxmotor._programs import Arrays, program
from jaxmotor.motor import AbstractController, Begin, Motor, Rows, simulate_motor
from jaxmotor.prediction import bucket, steps_per_row
from jaxmotor.recording import Recording
from jaxmotor.validation._controller import Controller, Law, agreeing_ticks, command, compare_with_log, on_ticks
from jaxmotor.validation._draws import alone, interval, spread
from jaxmotor.validation._response import Rows as Part
from jaxmotor.validation._response import measure, tail_of
from jaxmotor.validation._validation import Band, Comparison, Interval

FEWEST = 20
"""Ticks of a run that says something."""
FINE_RAD = 1e-9
"""A count too small to matter, where there is no encoder."""


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
    period: Float[Array, ""]
    steps: Int[Array, ""]
    """Per tick."""
    used: Int[Array, ""]
    """Ticks of the run; the others are padding."""
    place: "Place"


class Place(NamedTuple):
    """Where a run begins, and on which supply."""

    supply: Float[Array, ""]
    """[V]"""
    speed: Float[Array, ""]
    """[rad/s]"""
    angle: Float[Array, ""]
    """Of the shaft, for laws locked to it [rad]."""
    warmth: Float[Array, ""]
    """The winding's relative rise of resistance."""

    @classmethod
    def of(cls, supply_V: float, speed_rad_s: float, angle_rad: float, warmth: float = 0.0) -> "Place":
        """From plain numbers."""
        return cls(*(to_jax(np.float64(value)) for value in (supply_V, speed_rad_s, angle_rad, warmth)))


class Each(NamedTuple):
    """What each run has for itself."""

    reading: Float[Array, " batch"]
    """Where the encoder stands within a count."""
    unit: Float[Array, " batch"]
    """One count [rad]."""
    step: Float[Array, " batch"]
    """One duty [V]; 0 where the command is not quantised."""


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
def loops_program(motors: Motor, each: Each, reference: Float[Array, " n"], rig: Rig) -> Arrays:
    """(batch, n) what the controller sees of each of `motors` [rad/s], the same of one that need not count, and what
    it applies [V]."""
    ticks, place = jnp.arange(reference.shape[0]), rig.place
    first = ticks == 0
    initial, warmth = (jnp.where(first, value, 0.0) for value in (place.speed, place.warmth))
    rows = Rows(reference, first, initial, ticks.astype(reference.dtype) * rig.period, warmth=warmth)

    def run(motor: Motor, own: Each) -> tuple[Float[Array, " n"], ...]:
        control, begin = HeaderLaw(rig.law._replace(step=own.step)), Begin(place.angle, own.reading)
        done = simulate_motor(motor, rows, rig.period, place.supply, rig.steps, control, own.unit, rig.used, begin)
        counted = jnp.diff(jnp.floor(own.reading + jnp.cumsum(done.seen_turn) / own.unit), prepend=0.0) * own.unit
        seen = (_before(turned / rig.period, place.speed) for turned in (counted, done.seen_turn))
        return *seen, done.volts

    counted, smooth, volts = jax.vmap(run)(motors, each)
    return {"counted": counted, "smooth": smooth, "volts": volts}


def _before(speed: Float[Array, " n"], first: Float[Array, ""]) -> Float[Array, " n"]:
    """What the controller sees at a tick is the tick before."""
    return jnp.concatenate([first[None], speed[:-1]])


def run_loops(
    motors: Motor, rounded: np.ndarray, number: int, rig: tuple[Recording, Controller, float], place: Place, seed: int
) -> dict[str, np.ndarray]:
    """`loops_program` for `number` ticks of a batch of `motors`, whose encoders begin anywhere within a count.

    `rig` is the recording, its controller, and which `now` of its law ran. Where `rounded` (batch,) is false neither
    counts nor duties are.
    """
    recording, controller, now = rig
    period, counts = recording.period_s, recording.counts_per_rev
    assert period is not None
    law, pole = controller.law(period, now), float(np.asarray(motors.linear.pole)[0])
    each = Each(
        to_jax(np.random.default_rng(seed).random(len(rounded))),
        to_jax(np.where(rounded, 2 * np.pi / counts if counts else FINE_RAD, FINE_RAD)),
        to_jax(np.where(rounded, controller.step_V, 0.0)),
    )
    steps = steps_per_row(period, pole)
    shared = Rig(law, to_jax(np.float64(period)), to_jax(np.int32(steps)), to_jax(np.int32(number)), place)
    reference = to_jax(np.full(bucket(number), controller.reference_rad_s))
    runs = loops_program(motors, each, reference, shared)
    return {name: np.asarray(values)[:, :number] for name, values in runs.items()}


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
    rounded = np.ones(np.shape(motors.linear.pole), bool)
    place = Place.of(supply_V, begins_at_rad_s, angle_rad)
    runs = run_loops(motors, rounded, number, (recording, controller, now), place, seed)
    ideal, speed = runs["smooth"][0], runs["counted"]
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
