"""One step: the linear part moves exactly, and the laws fix the mean current, the mean torque and the friction.

Everything is affine in the effective voltage e and the torque f of the step, so a law of the winding's mean current is
solved in closed form, friction takes its full share or stops the rotor within the step, and nothing is smoothed.
"""

from typing import NamedTuple, TypeVar

import jax
import jax.numpy as jnp

from jaxmotor.motor._linear import AbstractLinearMotor, SecondOrder
from jaxmotor.motor.effects import _base as base
from jaxmotor.motor.effects._base import AbstractEffect, Scalar, Source, Step, Winding
from jaxmotor.motor.effects._contact import Contact, contact
from jaxmotor.motor.effects._propagate import Matrix, cells, propagator
from jaxmotor.motor.effects._yielding import yielding

TINY = 1e-12
"""In the place of a zero that something is divided by."""
PROBE_V = 0.1
"""By which it is seen how far a step yields to a torque."""
Role = TypeVar("Role", bound=AbstractEffect)


class Parts(NamedTuple):
    """A motor's effects by role, in the order in which they act."""

    delays: tuple[base.AbstractDelayEffect, ...]
    sources: tuple[base.AbstractSourceEffect, ...]
    windings: tuple[base.AbstractWindingEffect, ...]
    lags: tuple[base.AbstractLagEffect, ...]
    torques: tuple[base.AbstractTorqueEffect, ...]
    frictions: tuple[base.AbstractFrictionEffect, ...]
    bristles: tuple[base.AbstractMemoryTorqueEffect, ...]
    loads: tuple[base.AbstractLoadEffect, ...]
    counts: tuple[base.AbstractCountEffect, ...]
    discs: tuple[base.AbstractAngleSensorEffect, ...]
    memories: tuple[base.AbstractMemoryEffect, ...]

    @property
    def lagless(self) -> bool:
        """Some law wants a current without lag."""
        return any(effect.lagless for effect in self.windings)

    @property
    def early(self) -> bool:
        """Voltages may act before their row."""
        return any(effect.early for effect in self.delays)

    @property
    def has_gap(self) -> bool:
        """Within it the load moves freely."""
        return any(effect.has_gap for effect in self.loads)

    @property
    def exact(self) -> bool:
        """Nothing changes within a tick but what moves exactly, and a load in steps of its own."""
        return not (self.windings or self.torques or self.frictions or self.counts or self.memories)

    @property
    def steady(self) -> bool:
        """One step is as good as many."""
        return self.exact and not self.loads


def parts_of(effects: tuple[AbstractEffect, ...]) -> Parts:
    ordered = sorted(effects, key=lambda effect: (effect.stage, effect.name))

    def of(role: type[Role]) -> tuple[Role, ...]:
        return tuple(effect for effect in ordered if isinstance(effect, role))

    parts = Parts(
        delays=of(base.AbstractDelayEffect),
        sources=of(base.AbstractSourceEffect),
        windings=of(base.AbstractWindingEffect),
        lags=of(base.AbstractLagEffect),
        torques=of(base.AbstractTorqueEffect),
        frictions=of(base.AbstractFrictionEffect),
        bristles=of(base.AbstractMemoryTorqueEffect),
        loads=of(base.AbstractLoadEffect),
        counts=of(base.AbstractCountEffect),
        discs=of(base.AbstractAngleSensorEffect),
        memories=of(base.AbstractMemoryEffect),
    )
    if len(parts.loads) > 1:
        raise ValueError(f"one load only: {' and '.join(effect.name for effect in parts.loads)} each bring one")
    return parts


class Linear(NamedTuple):
    """The motor's linear part over a step of one length."""

    duration: Scalar
    closed: Matrix
    """On the spring, in contact, or without a load."""
    open: Matrix | None
    """Within the gap."""
    lag: Scalar | None
    """L/R [s]."""


def linear_part(motor: AbstractLinearMotor, viscous_share: Scalar, parts: Parts, duration: Scalar) -> Linear:
    lag = lag_of(motor, parts)
    load = parts.loads[0].load() if parts.loads else None

    def over(contact: Scalar | None) -> Matrix:
        return propagator(motor, viscous_share, lag, load, contact, duration)

    if load is None or load.gap is None:
        return Linear(duration, over(None), None, lag)
    closed, open_ = jax.vmap(over)(jnp.array([1.0, 0.0], duration.dtype))
    return Linear(duration, closed, open_, lag)


def lag_of(motor: AbstractLinearMotor, parts: Parts) -> Scalar | None:
    """L/R in all [s]; None where the current follows at once."""
    own = [motor.electrical_time_constant] if isinstance(motor, SecondOrder) else []
    lags = [*own, *(effect.lag() for effect in parts.lags)]
    return None if parts.lagless or not lags else sum(lags[1:], lags[0])


class State(NamedTuple):
    """Of the motor, within a tick."""

    x: tuple[Scalar, ...]
    """(w[, q][, w2, φ])."""
    memory: tuple[Scalar, ...]
    """Of each effect that has one."""
    turn: Scalar
    """Since the tick began [rad]."""
    seen: Scalar
    """What the sensor shows of it, but for errors that depend on the angle [rad]."""


class Moved(NamedTuple):
    """What a step with an assumed torque does."""

    x: tuple[Scalar, ...]
    mean: Scalar
    current: Scalar


def fresh(parts: Parts, has_lag: bool, speed: Scalar, place: Scalar | None = None) -> tuple[Scalar, ...]:
    """A motor that runs at `speed` without current and without twist, but for a load's `place` within its gap."""
    zero, gap = jnp.zeros_like(speed), parts.loads[0].load().gap if parts.has_gap else None
    twist = zero if place is None or gap is None else zero + place * gap / 2
    return (speed, *([zero] if has_lag else []), *([speed, twist] if parts.loads else []))


class Place(NamedTuple):
    """Where a step is, in its middle."""

    angle: Scalar
    """Of the shaft [rad]."""
    time: Scalar
    """Since the recording began [s]."""


def step(
    linear: Linear, parts: Parts, state: State, source: Source, place: Place, supply: Scalar, back: Scalar
) -> State:
    """`state` after a step."""
    speed, angle = state.x[0], place.angle
    guess = _torque(parts, speed, angle) + jnp.sign(speed) * _friction(parts, speed, place)
    guess = guess + _bristle(parts, state, jnp.zeros_like(speed), jnp.ones_like(speed))
    joined = _joined(linear, parts, state.x, source.volts, guess)
    winding = _winding(linear, parts, state, source, joined, guess, back)

    def moved(torque: Scalar) -> Moved:
        return _moved(joined, linear, torque, winding, back)

    # The laws that depend on the speed take the one in the middle of the step.
    middle = moved(guess).mean if parts.torques or parts.frictions else speed
    torque = _torque(parts, middle, angle)
    end = moved(torque)
    if parts.bristles:
        softness = (end.mean - moved(torque + PROBE_V).mean) / PROBE_V

        def resists(turn: Scalar, way: Scalar) -> Scalar:
            return _bristle(parts, state, turn, way)

        torque = torque + yielding(resists, end.mean, softness, linear.duration)
        end = moved(torque)
    if parts.frictions:
        # At rest it is the friction at rest that must be overcome.
        friction = _friction(parts, jnp.where(speed == 0, 0.0, middle), place)
        end = _rubbed(end, moved, torque, speed, friction)
    end = _parted(end, joined, parts, state.x, linear.duration)
    done = Step(linear.duration, speed, end.x[0], end.mean, end.current, end.mean, supply)
    for effect in parts.counts:
        done = done._replace(seen=effect.counted(done))
    memory = tuple(effect.advance(now, done) for effect, now in zip(parts.memories, state.memory, strict=True))
    seen = done.seen * linear.duration
    for effect, before, after in zip(parts.memories, state.memory, memory, strict=True):
        if isinstance(effect, base.AbstractLagSensorEffect):
            seen = seen - (after - before)
    return State(end.x, memory, state.turn + end.mean * linear.duration, state.seen + seen)


def _joined(linear: Linear, parts: Parts, x: tuple[Scalar, ...], volts: Scalar, torque: Scalar) -> Contact:
    none = jnp.zeros_like(torque)
    if linear.open is None:
        return Contact(x, cells(linear.closed), none, none)
    return contact(linear.closed, linear.open, parts.loads[0].load(), x, volts, torque, linear.duration)


def _parted(end: Moved, joined: Contact, parts: Parts, before: tuple[Scalar, ...], duration: Scalar) -> Moved:
    """`end` with its twist from the middle of the gap again, and with the moment of a contact's push."""
    if not parts.loads or joined.x is before:
        return end
    ratio = parts.loads[0].load().ratio
    twist = end.x[-1] + before[-1] - joined.x[-1] + (1 + ratio) * joined.late * duration
    return end._replace(x=(*end.x[:-1], twist), mean=end.mean + ratio * joined.late)


def sensed_speed_of(parts: Parts, speed: Scalar, memory: tuple[Scalar, ...], supply: Scalar) -> Scalar:
    """What a sensor of speed shows [rad/s]."""
    zero = jnp.zeros_like(speed)
    now = Step(zero, speed, speed, speed, zero, speed, supply)
    for effect in parts.counts:
        now = now._replace(seen=effect.counted(now))
    for effect, own in zip(parts.memories, memory, strict=True):
        if isinstance(effect, base.AbstractLagSensorEffect):
            now = now._replace(seen=effect.speed(own, now.seen))
    return now.seen


def _winding(
    linear: Linear, parts: Parts, state: State, source: Source, joined: Contact, torque: Scalar, back: Scalar
) -> Winding:
    winding = Winding(source.volts, jnp.ones_like(torque))
    if parts.windings:
        current = _moved(joined, linear, torque, winding, back).current
        winding = winding._replace(way=jnp.where(source.duty * current < 0, -1.0, 1.0))
    for effect in parts.windings:
        winding = effect.winding(winding, source, _memory_of(parts, state, effect))
    return winding


def _memory_of(parts: Parts, state: State, effect: AbstractEffect) -> Scalar | None:
    for owner, memory in zip(parts.memories, state.memory, strict=True):
        if owner is effect:
            return memory
    return None


def _torque(parts: Parts, speed: Scalar, angle: Scalar) -> Scalar:
    return sum((effect.resists(speed, angle) for effect in parts.torques), jnp.zeros_like(speed))


def _friction(parts: Parts, speed: Scalar, place: Place) -> Scalar:
    return sum((effect.friction(speed, place.angle, place.time) for effect in parts.frictions), jnp.zeros_like(speed))


def _bristle(parts: Parts, state: State, turn: Scalar, way: Scalar) -> Scalar:
    total = jnp.zeros_like(turn)
    for effect in parts.bristles:
        memory = _memory_of(parts, state, effect)
        assert memory is not None
        total = total + effect.resists_while(memory, turn, way)
    return total


def _moved(joined: Contact, linear: Linear, torque: Scalar, winding: Winding, back: Scalar) -> Moved:
    """The step at the effective voltage that gives the winding's mean current what its law says."""
    x, matrix = joined.x, joined.matrix
    n = len(x)
    inputs = dict(enumerate(x)) | {n + 1: torque}
    if len(matrix[0]) > n + 2:
        inputs[n + 2] = joined.push

    def row(k: int) -> Scalar:
        return sum((matrix[k][j] * value for j, value in inputs.items()), jnp.zeros_like(torque))

    volts = _effective(row(n), row(n + 1), matrix[n][n], matrix[n + 1][n], winding, back)
    if winding.limit is not None:
        current = row(n + 1) + matrix[n + 1][n] * volts
        most = winding.limit
        if linear.lag is not None:
            most = _most(linear, most, jnp.sign(current) * x[1], jnp.abs(volts - back * x[0]))
        volts = volts + (jnp.clip(current, -most, most) - current) / jnp.maximum(matrix[n + 1][n], TINY)
    end = tuple(row(k) + matrix[k][n] * volts for k in range(n))
    if winding.limit is not None and n % 2 == 0:
        end = (end[0], jnp.clip(end[1], -winding.limit, winding.limit), *end[2:])
    return Moved(end, row(n) + matrix[n][n] * volts, row(n + 1) + matrix[n + 1][n] * volts)


def _effective(
    speed: Scalar, current: Scalar, speed_e: Scalar, current_e: Scalar, winding: Winding, back: Scalar
) -> Scalar:
    """The voltage e that fits the law, for a mean speed `speed` + `speed_e` e and a mean q `current` + `current_e` e.

    Connected throughout the law is q = e - back-EMF [- lag] with e = volts - (resistance - 1) q.
    """
    resistance = winding.resistance

    def without_loss(volts: Scalar) -> Scalar:
        if winding.share is not None:
            conductance = winding.share if resistance is None else winding.share / resistance
            e = (conductance * (volts - back * speed) - current) / (current_e + conductance * back * speed_e)
            return jnp.where((current + current_e * e) * volts > 0, e, -current / current_e)
        if resistance is not None:
            return (volts - (resistance - 1) * current) / (1 + (resistance - 1) * current_e)
        return volts

    e = without_loss(winding.volts)
    if winding.loss is None:
        return e
    way = jnp.sign(current + current_e * e)
    e = without_loss(winding.volts - way * winding.loss)
    # The loss stops a current, it does not turn it around.
    return jnp.where((current + current_e * e) * way > 0, e, -current / jnp.maximum(current_e, TINY))


def _most(linear: Linear, limit: Scalar, begin: Scalar, final: Scalar) -> Scalar:
    """Largest mean q in a step [V]: from `begin` it rises towards `final` with the lag, until it is at the limit."""
    lag = jnp.maximum(jnp.zeros_like(limit) if linear.lag is None else linear.lag, TINY)
    limited = (final > limit) & (begin < limit)
    room = jnp.where(limited, final - limit, 1.0)
    way = jnp.where(limited, final - begin, 1.0)
    until = jnp.minimum(lag * jnp.log(way / room), linear.duration)
    missing = way * lag * -jnp.expm1(-until / lag) - room * until
    return limit - jnp.where(limited, missing, 0.0) / jnp.maximum(linear.duration, TINY)


def _rubbed(free: Moved, moved, torque: Scalar, w: Scalar, friction: Scalar) -> Moved:
    """Friction takes its full share, or stops the rotor within the step and then holds it or lets it go on."""
    way = jnp.where(w != 0, jnp.sign(w), jnp.sign(free.x[0]))
    full = moved(torque + way * friction)
    stops = full.x[0] * way < 0
    budget = jnp.abs(free.x[0] - full.x[0])
    # From here on the speed is nearly a straight line: the part of the step until it is zero, then what is left.
    until = w / jnp.where(stops, w - full.x[0], 1.0)
    pull = free.x[0] - w
    on = (1 - until) * jnp.sign(pull) * jnp.maximum(jnp.abs(pull) - budget, 0.0)
    # Before the stop friction drove the speed where it is going, after it against that.
    some = stops & (budget > 0)
    used = jnp.where(some, (free.x[0] - on) / jnp.where(some, budget * way, 1.0), 2 * until - 1)
    moves = until + (1 - until) * jax.nn.relu(1 - budget / jnp.where(stops, jnp.maximum(jnp.abs(pull), TINY), 1.0))
    mean = 0.5 * (until * w + (1 - until) * on) + moves * (free.mean - 0.5 * (w + free.x[0]))

    def between(a: Scalar, b: Scalar) -> Scalar:
        return jnp.where(stops, a + used * (b - a), b)

    rest = tuple(between(a, b) for a, b in zip(free.x[1:], full.x[1:], strict=True))
    speed = jnp.where(stops, on, full.x[0])
    mean = jnp.where(stops, mean, full.mean)
    return Moved((speed, *rest), mean, between(free.current, full.current))
