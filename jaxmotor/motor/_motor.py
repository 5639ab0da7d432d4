"""A motor with effects, and its free simulation in open or closed loop.

Within a tick the motor moves in steps of at most about a millisecond; the linear part moves exactly in each, so that
without effects any number of steps gives what `simulate` gives. Laws are computed element by element: many experiments
and many motors side by side are arrays in the place of numbers, which broadcast.
"""

import abc
import functools
import math
import operator
from collections.abc import Callable
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from jaxmotor.motor._late_volts import LateVolts, late_volts
from jaxmotor.motor._linear import AbstractLinearMotor
from jaxmotor.motor._readable import readable
from jaxmotor.motor._scan import scan_rows
from jaxmotor.motor._speed_law import SpeedLaw, command
from jaxmotor.motor.effects._base import AbstractEffect, AbstractLagSensorEffect, Scalar, Source
from jaxmotor.motor.effects._elementwise import elementwise
from jaxmotor.motor.effects._substep import (
    Linear,
    Parts,
    Place,
    State,
    fresh,
    lag_of,
    linear_part,
    parts_of,
    sensed_speed_of,
    step,
)
from jaxmotor.motor.effects._table import tabulated

LONGEST_ROW = 4.0
"""Times the typical one, up to which uneven rows have steps that are short enough for a contact."""


class Motor(eqx.Module):
    """A linear motor and what makes it differ from one."""

    linear: AbstractLinearMotor
    effects: tuple[AbstractEffect, ...] = ()
    viscous_share: Float[Array, ""] = eqx.field(default_factory=lambda: jnp.zeros(()))
    """β = b R/(b R + Kt²), the share of the pole that is viscous friction and not back-EMF [1].

    Voltage and speed show it only through effects on the current (`supply_sag`, `current_limit`, `coast_drive`,
    `winding_heating`) and, a little, through the electrical time constant.
    """

    __repr__ = readable


class Rows(NamedTuple):
    """What is done to a motor, row by row; experiments may stand end to end, and in sequences side by side."""

    volts: Float[Array, "n *sequence"]
    """Mean bridge voltage asked for, duty times nominal supply [V]; with a controller its reference [rad/s]."""
    reset: Bool[Array, "n *sequence"]
    """An experiment begins: the bridge was off before."""
    initial_speed: Float[Array, "n *sequence"]
    """Where `reset` is true [rad/s]."""
    time: Float[Array, "n *sequence"]
    """Since the recording began [s]."""
    angle: Float[Array, "n *sequence"] | None = None
    """The measured angle [rad], for laws locked to it; without it they take the simulated one, which starts at 0."""
    warmth: Float[Array, "n *sequence"] | None = None
    """Where `reset` is true: the winding's relative rise of resistance (`WindingHeating.history`). Without it
    experiments follow each other in the order of their rows, and the winding cools in the time between them."""
    place: Float[Array, "n *sequence"] | None = None
    """Where `reset` is true: that of a load within its gap, from -1 to 1. Without it that is the middle."""


class AbstractController(eqx.Module):
    """Chooses the voltage of each tick from the reading."""

    @abc.abstractmethod
    def begin(self) -> Any:
        """Its memory where an experiment begins."""

    @abc.abstractmethod
    def volts(self, memory: Any, reference: Scalar, turned: Scalar, duration: Scalar) -> tuple[Scalar, Any]:
        """Voltage [V] and new memory, from the angle that the reading `turned` in the last tick [rad]."""


class SpeedLoop(AbstractController):
    """The PI law around the speed that the reading shows."""

    law: SpeedLaw

    def begin(self) -> Scalar:
        return jnp.zeros_like(self.law.gain)

    def volts(self, memory: Scalar, reference: Scalar, turned: Scalar, duration: Scalar) -> tuple[Scalar, Scalar]:
        return command(self.law, reference - turned / duration, memory, duration)


class InitialAngle(NamedTuple):
    """Where the shaft stands before the first row."""

    angle: Float[Array, ""]
    """For laws locked to it, where it is not measured throughout [rad]."""
    reading: Float[Array, ""]
    """Within a count, 0 to 1 [counts]."""


class Run(NamedTuple):
    """What a motor with effects did, row by row."""

    speed: Float[Array, "n *sequence"]
    """At the row [rad/s]."""
    turn: Float[Array, "n *sequence"]
    """Angle turned from this row to the next [rad]."""
    sensed_speed: Float[Array, "n *sequence"]
    """What a sensor of speed shows at the row [rad/s]."""
    sensed_turn: Float[Array, "n *sequence"]
    """What the encoder shows of `turn`, before it is rounded to counts [rad]."""
    volts: Float[Array, "n *sequence"]
    """Asked of the bridge at the row [V]."""


def steps_for(duration_s: float, pole_rad_s: float) -> int:
    """Steps per row that effects need: of at most a millisecond, and a tenth of 1/a."""
    return max(1, math.ceil(duration_s * max(1e3, 10 * pole_rad_s) - 1e-6))


class _Spans(NamedTuple):
    """A tick: `first` steps of the old voltage, then the new one, `steps` in all."""

    old: Linear
    new: Linear
    first: Int[Array, "..."]
    steps: Int[Array, ""]
    whole: Int[Array, "..."]
    """Whole ticks that the voltage is late, where all are equally long."""


class _Row(NamedTuple):
    volts: Scalar
    """Asked for; where voltages may be early those of the next row."""
    own: Scalar
    reset: Bool[Array, "..."]
    speed: Scalar
    time: Scalar
    pause: Scalar
    """Since the row before ended [s]."""
    duration: Scalar
    angle: "_Readings | None"
    warmth: Scalar | None
    place: Scalar | None
    late: LateVolts | None
    """Where voltages act late and rows have lengths of their own."""
    at: "_Number | None" = None
    """Where voltages act late and rows are even."""


class _Number(NamedTuple):
    row: Int[Array, "..."]
    first: Int[Array, "..."]
    """Of the row with which its experiment begins."""
    volts: Scalar
    """Asked for in that row."""


class _Readings(NamedTuple):
    """Of the angle, at the ends of a tick and of its neighbours [rad]."""

    before: Scalar
    begin: Scalar
    end: Scalar
    after: Scalar
    inside: Bool[Array, "..."]
    """The neighbours belong to the same experiment."""


class _Angle(NamedTuple):
    """The measured angle over a tick: a parabola through its ends, bent as its neighbours say [rad]."""

    begin: Scalar
    turn: Scalar
    bend: Scalar

    def at(self, part: Scalar) -> Scalar:
        return self.begin + part * (self.turn - (1 - part) * self.bend)


class _Carry(NamedTuple):
    x: tuple[Scalar, ...]
    memory: tuple[Scalar, ...]
    past: Float[Array, "k *sequence"]
    """Voltages of all rows that a controller has asked for, where they act late; else empty."""
    angle: Scalar
    """Simulated [rad]."""
    read: Scalar
    """Turned in the last tick, as read [rad]."""
    reading: Scalar
    """Where the reading stands within a count, at first in its middle [counts]."""
    control: Any


class _Setup(NamedTuple):
    """What stays the same from tick to tick."""

    motor: Motor
    parts: Parts
    steps: Int[Array, ""]
    supply: Scalar
    controller: AbstractController | None
    count_rad: Scalar | None
    instantaneous: Bool[Array, ""] | None

    @property
    def back(self) -> Scalar:
        """Back-EMF per speed [V s/rad]."""
        return (1 - self.motor.viscous_share) / self.motor.linear.gain

    def over(self, length: Scalar) -> Linear:
        """The linear part over a step of `length` [s]."""

        def one(motor: Motor, length: Scalar) -> Linear:
            return linear_part(motor.linear, motor.viscous_share, parts_of(motor.effects), length)

        return elementwise(one, (self.motor, length))

    def resting(self, speed: Scalar, place: Scalar | None = None) -> tuple[Scalar, ...]:
        return fresh(self.parts, lag_of(self.motor.linear, self.parts) is not None, speed, place)


def simulate_motor(
    motor: Motor,
    rows: Rows,
    duration: Float[Array, ""] | Float[Array, "n *sequence"],
    supply: Float[Array, ""],
    steps: Int[Array, ""] | int = 5,
    controller: AbstractController | None = None,
    count_rad: Float[Array, ""] | None = None,
    used: Int[Array, ""] | None = None,
    begin: InitialAngle | None = None,
    lengths: Float[Array, " 2"] | None = None,
    instantaneous: Bool[Array, ""] | None = None,
) -> Run:
    """Free motion of `motor`, each row held for `duration` [s] (one for all, or one per row) in `steps` (`steps_for`).

    What `motor` holds broadcasts against a row's sequences: with numbers of shape (k,) and rows of shape
    (n, sequence, 1) it is k motors in the same sequences, and results are (n, sequence, k). A controller has one
    sequence and one motor.

    `supply` [V] is the nominal one: duty 1 is this voltage. With a `controller` the loop is closed around a reading
    that is rounded to counts of `count_rad` [rad] where this is given and not 0; or, where `instantaneous`, around the
    speed that a sensor shows at the tick. Rows from `used` on are not simulated. Without `begin` the shaft stands at 0,
    in the middle of a count. `lengths` are a typical `duration` and the longest [s]: given them, many rows of durations
    of their own are interpolated, to parts in 1e8, instead of computed one by one; a row that is longer still is taken
    to be that long.

    **Raises:** `ValueError` where a `controller` chooses voltages that it does not know in time: they may be early, or
    rows have lengths of their own and voltages act late.
    """
    shape = jnp.broadcast_shapes(*(jnp.shape(leaf) for leaf in jax.tree.leaves((motor, rows.initial_speed[0]))))
    motor = jax.tree.map(lambda leaf: jnp.reshape(leaf, (1,) * (len(shape) - jnp.ndim(leaf)) + jnp.shape(leaf)), motor)
    parts, steps = parts_of(motor.effects), jnp.asarray(steps, jnp.int32)
    setup = _Setup(motor, parts, steps, supply, controller, count_rad, instantaneous)
    if controller is not None and setup.parts.early:
        raise ValueError("a controller cannot choose voltages that act before they are chosen")
    if controller is not None and setup.parts.delays and duration.ndim > 0:
        raise ValueError("a controller cannot choose voltages that act late in rows of lengths of their own")
    over = setup.over
    if lengths is not None:
        # As many steps in each row: loops side by side would wait for the longest, and do all else twice.
        longest = jnp.minimum(lengths[1], LONGEST_ROW * lengths[0])
        setup, over = _stepped(setup, longest), tabulated(setup.over, lengths, len(rows.volts))
    spans = None
    if duration.ndim == 0:
        whole, part = _ticks_late(setup, duration, len(rows.volts))
        spans = _spans(_stepped(setup, duration), over, duration, part, whole)

    inputs = _inputs(rows, duration, setup.parts.early)

    def tick(carry: _Carry, row: _Row) -> tuple[_Carry, Run]:
        own = setup if lengths is not None or spans is not None else _stepped(setup, row.duration)
        over_row = spans or functools.partial(_spans, own, over)
        return _tick(setup, over_row, _begun(setup, carry, row), row, inputs.volts)

    if spans is not None and parts.delays:
        inputs = inputs._replace(at=_numbered(rows))
    elif parts.delays:
        typical = duration.max() if lengths is None else lengths[0]
        late_ones = late_volts(_delay(setup), rows.volts, rows.reset, duration, typical, used, early=parts.early)
        inputs = inputs._replace(late=late_ones)
    remembered = len(rows.volts) if controller is not None and parts.delays else 0
    _, run = scan_rows(tick, _start(setup, rows.volts[0], shape, begin, remembered), inputs, used)
    return run


def _numbered(rows: Rows) -> _Number:
    number = jnp.arange(len(rows.reset), dtype=jnp.int32).reshape(-1, *(1,) * (rows.reset.ndim - 1))
    first = jax.lax.cummax(jnp.where(rows.reset, number, 0), axis=0)
    return _Number(jnp.broadcast_to(number, first.shape), first, jnp.take_along_axis(rows.volts, first, 0))


def _inputs(rows: Rows, duration: Float[Array, "..."], early: bool) -> _Row:
    lengths, one = jnp.broadcast_to(duration, rows.volts.shape), jnp.ones_like(rows.reset[:1])
    ended = jnp.concatenate([rows.time[:1], (rows.time + lengths)[:-1]])
    pause = jnp.maximum(rows.time - ended, 0.0)
    angle = None if rows.angle is None else _readings(rows.angle, rows.reset)
    ends = jnp.concatenate([rows.reset[1:], one])
    volts = jnp.where(ends, rows.volts, jnp.roll(rows.volts, -1, axis=0)) if early else rows.volts
    own = (rows.volts, rows.reset, rows.initial_speed, rows.time)
    return _Row(volts, *own, pause, lengths, angle, rows.warmth, rows.place, None)


def _readings(angle: Float[Array, "n *sequence"], reset: Bool[Array, "n *sequence"]) -> _Readings:
    end = jnp.ones_like(reset[:1])
    last = jnp.concatenate([reset[1:], end])
    later = jnp.where(last, angle, jnp.concatenate([angle[1:], angle[-1:]]))
    inside = ~reset & ~last & ~jnp.concatenate([last[1:], end])
    before, after = jnp.concatenate([angle[:1], angle[:-1]]), jnp.concatenate([later[1:], later[-1:]])
    return _Readings(before, angle, later, after, inside)


def _measured(parts: Parts, read: _Readings, memory: tuple[Scalar, ...]) -> _Angle:
    trail = _trail(parts, memory)
    before, begin, end, after = (_true_angle(parts, reading + trail) for reading in read[:4])
    turn = end - begin
    return _Angle(begin, turn, jnp.where(read.inside, 0.25 * ((after - end) - (begin - before)), 0.0))


def _trail(parts: Parts, memory: tuple[Scalar, ...]) -> Scalar | float:
    """By how much a filtered reading is behind the shaft [rad]."""
    owned = zip(parts.memories, memory, strict=True)
    return sum((now for effect, now in owned if isinstance(effect, AbstractLagSensorEffect)), 0.0)


def _true_angle(parts: Parts, read: Scalar) -> Scalar:
    """θ = y - e(θ), by as many repetitions as it takes for any error that a turning encoder can have."""
    angle = read
    for _ in range(4 if parts.discs else 0):
        angle = read - sum((disc.error(angle) for disc in parts.discs), jnp.zeros_like(read))
    return angle


def _stepped(setup: _Setup, duration: Scalar) -> _Setup:
    """`setup` with as many steps as rows of `duration` need."""
    steps = jnp.ones_like(setup.steps) if setup.parts.steady else setup.steps
    for effect in setup.parts.loads:
        steps = jnp.maximum(steps, jnp.ceil(duration.max() / effect.longest_step_s - 1e-6).astype(steps.dtype))
    return setup._replace(steps=steps)


def _spans(
    setup: _Setup,
    over: Callable[[Scalar], Linear],
    duration: Scalar,
    part: Scalar,
    whole: Int[Array, "..."],
) -> _Spans:
    """A tick of `duration` [s] of which the old voltage acts for a `part`: where that ends a further step begins, so
    that each step has one voltage."""
    steps = setup.steps
    if not setup.parts.delays:
        even, none = over(duration / steps.astype(duration.dtype)), jnp.zeros_like(steps)
        return _Spans(even, even, none, steps, none)
    first = jnp.clip(jnp.ceil(part * steps.astype(part.dtype)).astype(steps.dtype), 1, steps)
    numbers = jnp.stack([first, steps + 1 - first]).astype(part.dtype)
    both = jax.vmap(over)(jnp.stack([part * duration, (1 - part) * duration]) / numbers)
    old, new = (jax.tree.map(operator.itemgetter(k), both) for k in (0, 1))
    return _Spans(old, new, first, steps + 1, whole)


def _delay(setup: _Setup) -> Scalar:
    """How late voltages are [s]."""
    return sum((effect.delay() for effect in setup.parts.delays), jnp.zeros_like(setup.motor.linear.gain))


def _ticks_late(setup: _Setup, duration: Scalar, most: int) -> tuple[Int[Array, "..."], Scalar]:
    """Whole ticks, each of `duration` [s] and `most` of them, and the part of one by which voltages are late."""
    ticks = _delay(setup) / duration
    if setup.parts.early:  # and nowhere else: at a delay of zero the limit would halve its derivative
        ticks = jnp.maximum(ticks + 1.0, 0.0)
    whole = jnp.clip(jnp.floor(ticks), 0.0, float(most))
    return whole.astype(setup.steps.dtype), jnp.minimum(ticks - whole, 1.0)


def _start(setup: _Setup, volts: Scalar, shape: tuple[int, ...], begin: InitialAngle | None, remembered: int) -> _Carry:
    zero = jnp.zeros(shape, volts.dtype)
    angle, reading = (zero, zero + 0.5) if begin is None else begin
    memory = tuple(zero for _ in setup.parts.memories)
    past = jnp.zeros((remembered, *(shape if remembered else volts.shape)), volts.dtype)
    control = None if setup.controller is None else setup.controller.begin()
    return _Carry(setup.resting(zero), memory, past, angle, zero, reading, control)


def _begun(setup: _Setup, carry: _Carry, row: _Row) -> _Carry:
    """`carry`, or where an experiment begins its begin. The angle goes on, and what is warm stays warm."""
    if row.warmth is None:
        before, pause = carry.memory, row.pause
    else:
        before, pause = tuple(row.warmth for _ in carry.memory), jnp.zeros_like(row.pause)
    effects = zip(setup.parts.memories, before, strict=True)
    new = carry._replace(
        x=setup.resting(row.speed, row.place),
        memory=tuple(effect.begin(memory, row.speed, pause) for effect, memory in effects),
        read=-_rounded(carry.reading, -row.speed * row.duration, setup.count_rad)[0],
        control=None if setup.controller is None else setup.controller.begin(),
    )
    return jax.tree.map(lambda new, old: jnp.where(row.reset, new, old), new, carry)


def _tick(
    setup: _Setup,
    spans: _Spans | Callable[[Scalar, Scalar, Scalar], _Spans],
    carry: _Carry,
    row: _Row,
    every: Float[Array, "n *sequence"],
) -> tuple[_Carry, Run]:
    """One row of those whose voltages are `every` one, where no controller chooses them."""
    parts, volts, control = setup.parts, row.volts, carry.control
    if setup.controller is not None:
        volts, control = setup.controller.volts(control, volts, _reading(setup, carry, row.duration), row.duration)
    past = carry.past
    if len(past):
        assert row.at is not None
        volts = jnp.broadcast_to(volts, past.shape[1:])
        past = jax.lax.dynamic_update_index_in_dim(past, volts, row.at.row.reshape(-1)[0], 0)
    old, new, part, zero = volts, volts, row.duration, jnp.zeros_like(carry.angle)
    if row.late is not None:
        old, new, part = row.late
    elif parts.delays and isinstance(spans, _Spans):
        assert row.at is not None
        old, new = (_ago(past if len(past) else every, row.at, spans.whole + more, parts.early) for more in (1, 0))
    now = spans if isinstance(spans, _Spans) else spans(row.duration, part, jnp.zeros_like(setup.steps))
    measured = None if row.angle is None else _measured(parts, row.angle, carry.memory)
    state = _steps(setup, now, State(carry.x, carry.memory, zero, zero), (old, new), measured or carry.angle, row)
    seen = state.seen + _disc_error(parts, carry.angle, state.turn, measured)
    read, reading = _rounded(carry.reading, seen, setup.count_rad)
    after = _Carry(state.x, state.memory, past, carry.angle + state.turn, read, reading, control)
    speed = carry.x[0]
    return after, Run(speed, state.turn, sensed_speed_of(parts, speed, carry.memory, setup.supply), seen, volts)


def _reading(setup: _Setup, carry: _Carry, duration: Scalar) -> Scalar:
    """What the controller takes to have been turned in the last tick [rad]."""
    if setup.instantaneous is None:
        return carry.read
    shown = sensed_speed_of(setup.parts, carry.x[0], carry.memory, setup.supply)
    return jnp.where(setup.instantaneous, shown * duration, carry.read)


def _ago(every: Float[Array, "n *sequence"], at: _Number, ticks: Int[Array, "..."], early: bool) -> Scalar:
    """Of `every` row's voltage that which was asked for so many `ticks` ago [V], none before the experiment; where it
    may be `early`, `every` one is that of the row after."""
    row = at.row - ticks
    asked = jnp.take_along_axis(every, jnp.maximum(row, 0)[None], 0, mode="promise_in_bounds")[0]
    before = jnp.where(row == at.first - 1, at.volts, 0.0) if early else jnp.zeros_like(asked)
    return jnp.where(row >= at.first, asked, before)


def _steps(
    setup: _Setup, spans: _Spans, state: State, volts: tuple[Scalar, Scalar], angle: Scalar | _Angle, row: _Row
) -> State:
    """All steps of a tick. A loop, not its steps one after the other: compiled once for any number of them."""
    middle_time = row.time + 0.5 * row.duration
    old, new = (source_of(setup.parts, setup.supply, asked, middle_time) for asked in volts)
    behind = _trail(setup.parts, state.memory)

    def body(k: Int[Array, ""], state: State) -> State:
        linear, source = spans.new, new
        if setup.parts.delays:
            early = k < spans.first
            linear, source = jax.tree.map(lambda a, b: jnp.where(early, a, b), (spans.old, old), (linear, source))
        if isinstance(angle, _Angle):
            trails = _trail(setup.parts, state.memory) - behind
            middle = angle.at(_part(setup, spans, k, row.duration)) + trails
        else:
            middle = angle + state.turn + 0.5 * linear.duration * state.x[0]
        return step(linear, setup.parts, state, source, Place(middle, middle_time), setup.supply, setup.back)

    return jax.lax.fori_loop(0, spans.steps, body, state)


def _part(setup: _Setup, spans: _Spans, k: Int[Array, ""], duration: Scalar) -> Scalar:
    """Where in the tick the middle of its step `k` is, 0 to 1."""
    number = k.astype(duration.dtype) + 0.5
    part = number * spans.new.duration / duration
    if not setup.parts.delays:
        return part
    shift = spans.first.astype(duration.dtype) * (spans.old.duration - spans.new.duration) / duration
    return jnp.where(k < spans.first, number * spans.old.duration / duration, part + shift)


def source_of(parts: Parts, supply: Scalar, volts: Scalar, time: Scalar) -> Source:
    """The bridge where `volts` are asked of it."""
    source = Source(volts / supply, supply, jnp.ones_like(volts), jnp.zeros_like(volts))
    for effect in parts.sources:
        source = effect.source(source, time)
    return source


def _disc_error(parts: Parts, angle: Scalar, turn: Scalar, measured: _Angle | None) -> Scalar:
    """What errors that depend on the angle add to a tick's reading [rad]."""
    begin, end = (angle, angle + turn) if measured is None else (measured.begin, measured.begin + measured.turn)
    return sum((disc.error(end) - disc.error(begin) for disc in parts.discs), jnp.zeros_like(turn))


def _rounded(reading: Scalar, seen: Scalar, count_rad: Scalar | None) -> tuple[Scalar, Scalar]:
    """What the counter shows of `seen` [rad], and where it stands within a count."""
    if count_rad is None:
        return seen, reading
    counts = count_rad > 0
    exact = reading + seen / jnp.where(counts, count_rad, 1.0)
    whole = jnp.floor(exact)
    return jnp.where(counts, whole * count_rad, seen), exact - whole
