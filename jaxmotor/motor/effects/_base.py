"""What an effect is: a small law with parameters, and the place in the motor where it acts.

An effect is final. Where it acts (`drive`, `motion`, `sensor`) is its first base; how it acts is its second, one of the
roles below, each a single equation. With the neutral value of every parameter an effect is the identity.
"""

import abc
import functools
import math
from typing import Any, ClassVar, Literal, NamedTuple, TypeVar

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxmotor._precision import to_jax
from jaxmotor.motor._readable import readable

E = TypeVar("E", bound="AbstractEffect")
Scalar = Float[Array, "..."]
"""One number, or one for each of the motors and experiments that are simulated side by side."""
Kind = Literal["positive", "signed", "amplitude", "phase", "fixed", "term", "range"]

INFINITE = 1e6
"""Neutral value of a limit [V]: far beyond any motor's."""


MOST_DRAG = 9.0
"""Times what the back-EMF takes at the largest speed, that drag takes there at most: a motor turns a load with a tenth
of its power at least."""


class Rig(NamedTuple):
    """What is known of a recording before any effect is: how large an effect could be in it."""

    supply_V: float
    """Nominal supply."""
    volts_V: tuple[float, ...]
    """Sizes of the voltages that were applied, in rising order, without zero; equal ones once."""
    speed_rad_s: float
    """Largest speed."""
    period_s: float
    """From row to row."""
    duration_s: float
    """From the first row to the last."""
    turns: bool
    """The measured angle is known throughout, and the shaft turned around."""
    supply_known: bool = True
    """What share of the supply each voltage was is known."""
    supply_logged: bool = False
    """The voltages are those that the logged supply gave: its sag and drift are in them."""
    counts: bool = True
    """The log holds an encoder's counts, or speeds or angles that were made of them."""
    swing_rad: float = 0.0
    """From the least to the largest measured angle, where that is known throughout; else zero."""
    driven_s: tuple[float, float] = (0.0, math.inf)
    """When a voltage was first applied, and when last, since the recording began."""
    rest_s: float = 0.0
    """How long the log shows the shaft at rest before it is first driven."""
    slowest_rad_s: float = math.inf
    """The slowest speed that would have been seen there."""
    back_emf_V: float = math.inf
    """That the back-EMF of the motor takes at the largest speed, where a motor is given."""

    @property
    def has_sizes(self) -> bool:
        """Voltages of more than one size were applied."""
        return len(self.volts_V) > 1

    def of(self, gain_rad_s_V: float) -> "Rig":
        """With a motor of this gain."""
        return self._replace(back_emf_V=self.speed_rad_s / gain_rad_s_V if gain_rad_s_V > 0 else math.inf)


def parameter(
    unit: str,
    kind: Kind,
    *,
    neutral: float,
    start: float,
    scale: float,
    spread: float = math.inf,
    absent: float | None = None,
    least: str | None = None,
    choices: tuple[float, ...] = (),
) -> Any:
    """A parameter's field: its `unit`, its value without effect, where a fit starts, and how far it may be off;
    `absent` is its value in model files of before it was there.

    `kind` says how it is fitted: `positive` through its logarithm, `signed` as it is, `amplitude` and `phase` together
    as A cos φ and A sin φ (in which the law is linear), `fixed` not at all. Of a learned curve a `term` is fitted as it
    is, with `spread` that of its prior about zero; its `range` is how far it was learned. A `positive` one that is
    never less than the parameter before it, `least`, is fitted through the logarithm of its ratio to that. Where there
    are `choices` it is one of these.
    """
    about = {"unit": unit, "kind": kind, "neutral": neutral, "start": start, "scale": scale, "spread": spread}
    about |= {} if absent is None else {"absent": absent}
    about |= {} if least is None else {"least": least}
    about |= {"choices": choices} if choices else {}
    return eqx.field(metadata=about)


class AbstractEffect(eqx.Module):
    """One way in which a motor differs from a linear one."""

    name: ClassVar[str]
    """As in reports and files."""
    family: ClassVar[str] = ""
    """What it has in common with its likes, for people: a recording that does not say which of them it is may still say
    that it is one of them. Empty where it has no likes."""
    acts_on: ClassVar[str]
    """`drive`, `motion` or `sensor`."""
    says: ClassVar[str]
    """What it does, for people: the end of a sentence, with its parameters in braces."""
    says_negative: ClassVar[str] = ""
    """The same where its signed parameter is negative, with that parameter's size in braces; as `says` where empty."""
    advice: ClassVar[str]
    """What to do about it, for people."""
    stage: ClassVar[int] = 0
    """Effects of one role act in this order, whatever their order in the motor."""
    beside: ClassVar[tuple[str, ...]] = ()
    """Effects without which its law fits no motor: they are tried with it first."""
    contains: ClassVar[tuple[str, ...]] = ()
    """Effects that are special cases of it: never together with it in one motor."""
    same_as: ClassVar[tuple[str, ...]] = ()
    """Effects that are the same law, whatever it is called: tried once, and all named as alternatives. Said once, here
    or there, it holds both ways; so do `excludes` and `relatives`."""
    excludes: ClassVar[tuple[str, ...]] = ()
    """Further effects that cannot be together with it in one motor. Two that bring a load never can."""
    relatives: ClassVar[tuple[str, ...]] = ()
    """Effects of one parameter of the same unit, as it has, that do the same while the motor turns one way or changes
    slowly: where one of them is found, the others are near."""
    rarity: ClassVar[float] = 1.0
    """Of effects that explain a recording equally well the least rare is preferred: 0 the most usual, 1 all others,
    more what few motors have."""
    always_tried: ClassVar[bool] = False
    """It is like no small multiple of itself: fitted beside the linear motor whatever its score."""
    over: ClassVar[str] = ""
    """The coordinate that alone decides what it takes or gives, `speed` or `voltage`: where two such are named, one law
    of another shape may be there. Empty for all others."""
    sought_last: ClassVar[bool] = False
    """It is sought only where the other effects leave something unexplained."""
    explained_chi2: ClassVar[float] = 1.0
    """chi2 per sample up to which a motor with it leaves nothing unexplained, where its law is not exact."""
    holds_by: ClassVar[str] = ""
    """Its parameter [V] that is the voltage up to which it keeps a motor at rest; empty where it does not."""
    ordinary: ClassVar[float] = 0.0
    """Size of its one parameter, in that one's unit, up to which any motor has it: so much is no cause."""
    roughness: ClassVar[float] = 0.0
    """Relative error of its parameters that its law's simplifications bring, as blind tests show it."""
    unlikeness: ClassVar[float] = 1.0
    """How many times what the encoder's noise alone would give the errors of its parameters are, where its law follows
    what shows of it only roughly: the less shows, the more that matters. As blind tests show it."""
    unlikeness_beside: ClassVar[float] = 1.0
    """The same of the effects beside it: what it gets wrong is theirs to explain."""
    program_level: ClassVar[int | None] = None
    """Motors whose effects have levels up to one share a compiled program, in which those that they lack are neutral:
    level 0 costs next to nothing there, level 1 a little. None: its programs are its own."""
    cheap_alone: ClassVar[bool] = False
    """It costs next to nothing, too, where a log is one sequence: then all such motors share their program with it."""
    difference: ClassVar[float] = 1e-3
    """Over which fits difference its parameters: relative where they are positive, else of their scale."""

    __repr__ = readable

    def told(self) -> tuple[str, dict[str, float]]:
        """The sentence that says what it does, its parameters in braces, and their values as the sentence has them."""
        values = {name: float(getattr(self, name)) for name in parameters(self)}
        signed = [name for name in values if parameters(self)[name]["kind"] == "signed"]
        if not self.says_negative or all(values[name] >= 0 for name in signed):
            return self.says, values
        return self.says_negative, values | {name: -values[name] for name in signed}

    @classmethod
    def of(cls: type[E], **values: Any) -> E:
        """The effect with these parameters; plain numbers will do. Those that came later may be left out."""
        every = {key: about["absent"] for key, about in parameters(cls).items() if "absent" in about} | values
        return cls(**to_jax({key: np.asarray(value, float) for key, value in every.items()}))

    @classmethod
    def neutral(cls: type[E]) -> E:
        """The effect that does nothing."""
        return cls.of(**{key: about["neutral"] for key, about in parameters(cls).items()})

    @classmethod
    def start(cls: type[E], **values: Any) -> E:
        """A plausible size to start a fit from, but for the `values` given."""
        return cls.of(**({key: about["start"] for key, about in parameters(cls).items()} | values))

    @classmethod
    @abc.abstractmethod
    def starts(cls, rig: Rig) -> "tuple[AbstractEffect, ...]":
        """Plausible sizes in a recording, from which fits start; none where the recording cannot show the effect.

        Laws that a factor makes larger or smaller (`scaled`) need one for each shape, others a few sizes.
        """

    def around(self: E, rig: Rig) -> "tuple[E, ...]":
        """It at the places around its own, where it has one that no derivative leads to and that has more than its
        `starts`."""
        del rig
        return ()

    def possible(self, rig: Rig) -> bool:
        """A motor on `rig` can have it of this size: what lies beyond is another law, or none.

        No effect takes more volts than there are, or is as small as any motor has it.
        """
        if self.ordinary and float(getattr(self, next(iter(parameters(self))))) <= self.ordinary:
            return False
        volts = [name for name, about in parameters(self).items() if about["unit"] == "V"]
        return all(abs(float(getattr(self, name))) < rig.supply_V for name in volts)

    @property
    def is_special(self) -> bool:
        """A parameter is as small as the one that it is never less than: then the law is one that it `contains`."""
        pairs = [(name, about["least"]) for name, about in parameters(self).items() if "least" in about]
        return any(float(getattr(self, name)) <= float(getattr(self, below)) for name, below in pairs)

    def but(self: E, **values: float) -> E:
        """The effect with these parameters in the place of its own; plain numbers."""
        own = {name: float(getattr(self, name)) for name in parameters(self)}
        return type(self).of(**(own | values))

    def scaled(self, factor: float) -> "AbstractEffect":
        """About `factor` times as much of the effect; parameters whose neutral value is not zero stay."""
        sizes = {name: getattr(self, name) for name in parameters(self)}
        for name, about in parameters(self).items():
            if about["neutral"] == 0.0 and about["kind"] in ("positive", "signed", "amplitude"):
                sizes[name] = sizes[name] * factor
        return type(self)(**sizes)


class AbstractDriveEffect(AbstractEffect):
    """Acts on the voltage before the motor."""

    acts_on: ClassVar[str] = "drive"


class AbstractMotionEffect(AbstractEffect):
    """Acts on torque and speed."""

    acts_on: ClassVar[str] = "motion"


class AbstractSensorEffect(AbstractEffect):
    """Acts on the reading."""

    acts_on: ClassVar[str] = "sensor"


def parameters(effect: AbstractEffect | type[AbstractEffect]) -> dict[str, dict[str, Any]]:
    """What is known about each parameter, by its name: unit, kind, neutral, start, scale."""
    return _parameters(effect if isinstance(effect, type) else type(effect))


@functools.cache
def _parameters(law: type[AbstractEffect]) -> dict[str, dict[str, Any]]:
    fields = getattr(law, "__dataclass_fields__", {})
    return {name: dict(field.metadata) for name, field in fields.items() if "kind" in field.metadata}


def told_parameters(effect: AbstractEffect | type[AbstractEffect]) -> dict[str, dict[str, Any]]:
    """Of `parameters`, those that tell people something; the terms of a curve do not."""
    return {name: about for name, about in parameters(effect).items() if about["kind"] not in ("term", "range")}


def free_size(effect: AbstractEffect | type[AbstractEffect]) -> int:
    """How many numbers `to_free` gives."""
    sizes = {"positive": 1, "signed": 1, "term": 1, "amplitude": 2, "phase": 0, "fixed": 0, "range": 0}
    return sum(sizes[about["kind"]] for about in parameters(effect).values())


def to_free(effect: AbstractEffect) -> Float[np.ndarray, " p"]:
    """The effect's parameters as unconstrained numbers."""
    free: list[float] = []
    for name, about in parameters(effect).items():
        value = float(getattr(effect, name))
        if about["kind"] == "positive":
            below = float(getattr(effect, about["least"])) if "least" in about else 1.0
            free.append(math.log(value) - math.log(below) if min(value, below) > 0 else -math.inf)
        elif about["kind"] in ("signed", "term"):
            free.append(value)
        elif about["kind"] == "amplitude":
            phase = float(effect.phase_rad)  # pyright: ignore[reportAttributeAccessIssue]
            free += [value * math.cos(phase), value * math.sin(phase)]
    return np.array(free, float)


def from_free(effect: E, free: Float[np.ndarray, " p"]) -> E:
    """`effect` with the parameters that `free` stands for; those that are not fitted stay."""
    return type(effect).of(**{name: column[0] for name, column in values_at(effect, free[None]).items()})


def values_at(effect: AbstractEffect, free: Float[np.ndarray, "k p"]) -> dict[str, Float[np.ndarray, " k"]]:
    """The parameters that each row of `free` stands for, in the order of the fields; those not fitted stay."""
    values = {name: np.full(len(free), float(getattr(effect, name))) for name in parameters(effect)}
    rest = iter(free.T)
    for name, about in parameters(effect).items():
        if about["kind"] == "positive":
            values[name] = np.exp(next(rest)) * (values[about["least"]] if "least" in about else 1.0)
        elif about["kind"] in ("signed", "term"):
            values[name] = next(rest)
        elif about["kind"] == "amplitude":
            along, across = next(rest), next(rest)
            values |= {name: np.hypot(along, across), "phase_rad": np.arctan2(across, along)}
    return values


# ---- roles


class Source(NamedTuple):
    """The bridge: `duty` of a `supply` [V], times `factor`, plus `offset` [V]."""

    duty: Scalar
    supply: Scalar
    factor: Scalar
    offset: Scalar

    @property
    def mean(self) -> Scalar:
        """Mean voltage that the bridge is told to give [V]."""
        return self.duty * self.supply

    @property
    def volts(self) -> Scalar:
        """Mean voltage at the winding [V]."""
        return self.duty * self.supply * self.factor + self.offset

    def told(self, mean: Scalar) -> "Source":
        """The bridge told to give another mean voltage [V]."""
        return self._replace(duty=mean / self.supply)


class AbstractSourceEffect(AbstractEffect):
    """A law of the bridge without memory, evaluated where the voltage changes."""

    @abc.abstractmethod
    def source(self, source: Source, time: Scalar) -> Source:
        """The bridge with the effect, at `time` [s] since the recording began."""


OWN_LAG_S = 2.6e-4
"""Longest L/R of a motor without an effect: what is late by no more than that may be the winding's."""
LONGEST_DELAY_S = 0.5
"""Delays up to this are sought, and any of up to twenty rows."""


class AbstractDelayEffect(AbstractEffect):
    """Time passes between a command and the voltage."""

    early: ClassVar[bool] = False
    """It may be negative, by less than a row."""

    @abc.abstractmethod
    def delay(self) -> Scalar:
        """How late the voltage is [s]."""


class Winding(NamedTuple):
    """The winding for the length of a step; None where nothing has changed it.

    Its current times its cold resistance, q [V], is `share` (`volts` - back-EMF)/`resistance` within +-`limit`.
    """

    volts: Scalar
    """The voltage while it is connected."""
    way: Scalar
    """1 where the supply gives current, -1 where it takes current back."""
    resistance: Scalar | None = None
    """Relative to the cold winding's."""
    limit: Scalar | None = None
    """Of abs(q) [V]."""
    share: Scalar | None = None
    """The share of time in which it is connected; current then flows towards the voltage only, and without lag."""
    loss: Scalar | None = None
    """Voltage that is lost against the current [V]; what is less than that drives none."""

    def more_resistance(self, ratio: Scalar) -> "Winding":
        """With a further resistance, relative to the cold winding's."""
        return self._replace(resistance=(1.0 if self.resistance is None else self.resistance) + ratio)

    def current(self, back_emf: Scalar) -> tuple[Scalar, Scalar]:
        """q against `back_emf` [V] and its slope dq/d(back-EMF) [1], where the current is steady."""
        slope = -jnp.ones_like(back_emf)
        slope = slope if self.resistance is None else slope / self.resistance
        slope = slope if self.share is None else slope * self.share
        drop = self.volts - back_emf
        if self.loss is not None:
            slope = jnp.where(jnp.abs(drop) > self.loss, slope, 0.0)
            drop = drop - jnp.clip(drop, -self.loss, self.loss)
        q = -slope * drop
        if self.share is not None:
            q, slope = (jnp.where(q * self.volts > 0, one, 0.0) for one in (q, slope))
        if self.limit is not None:
            slope = jnp.where(jnp.abs(q) < self.limit, slope, 0.0)
            q = jnp.clip(q, -self.limit, self.limit)
        return q, slope


class AbstractWindingEffect(AbstractEffect):
    """A law of the winding's current."""

    lagless: ClassVar[bool] = False
    """The current follows its law without electrical lag."""

    @abc.abstractmethod
    def winding(self, winding: Winding, source: Source, memory: Scalar | None) -> Winding:
        """The winding with the effect."""


class AbstractLagEffect(AbstractEffect):
    """Adds to the electrical time constant."""

    @abc.abstractmethod
    def lag(self) -> Scalar:
        """Additional L/R [s]."""


class AbstractTorqueEffect(AbstractEffect):
    """A torque that depends on speed and angle smoothly."""

    @abc.abstractmethod
    def resists(self, speed: Scalar, angle: Scalar) -> Scalar:
        """The voltage [V] that overcomes it, positive where it resists positive motion."""


class AbstractFrictionEffect(AbstractEffect):
    """A torque against the motion, in either direction, that also holds at rest."""

    @abc.abstractmethod
    def friction(self, speed: Scalar, angle: Scalar, time: Scalar) -> Scalar:
        """The voltage [V] that overcomes it at `speed` [rad/s], of either sign, and `angle` [rad], at `time` [s] since
        the recording began."""


class Load(NamedTuple):
    """A second inertia, `ratio` times the rotor's, on a spring behind a gap.

    The load alone, the rotor held, swings at `frequency` [rad/s] with a `damping` ratio. Without a gap
    `gap` [rad] is None.
    """

    ratio: Scalar
    frequency: Scalar
    damping: Scalar
    gap: Scalar | None


class AbstractLoadEffect(AbstractEffect):
    """Puts a load behind a spring or a gap."""

    longest_step_s: ClassVar[float] = 1.0
    """Steps are made no longer than this, whatever number is asked for [s]."""
    has_gap: ClassVar[bool] = False
    """The load is behind a gap, and anywhere within it as an experiment begins."""

    @abc.abstractmethod
    def load(self) -> Load: ...


class Step(NamedTuple):
    """What happened in a step of `duration` [s]."""

    duration: Scalar
    before: Scalar
    """Speed at its begin [rad/s]."""
    after: Scalar
    """Speed at its end [rad/s]."""
    mean: Scalar
    """Mean speed [rad/s]."""
    current: Scalar
    """Mean current times the cold resistance [V]."""
    seen: Scalar
    """Mean speed as the sensor sees it [rad/s]."""
    supply: Scalar
    """Nominal supply [V]."""


class AbstractMemoryEffect(AbstractEffect):
    """Has a state of its own."""

    @abc.abstractmethod
    def begin(self, memory: Scalar, speed: Scalar, pause: Scalar) -> Scalar:
        """Its state where an experiment begins at `speed`, `pause` [s] after the one before it ended with `memory`."""

    @abc.abstractmethod
    def advance(self, memory: Scalar, step: Step) -> Scalar:
        """Its state after `step`."""


class AbstractMemoryTorqueEffect(AbstractMemoryEffect):
    """A torque that resists the more, the further the shaft turns one way, up to a limit, and keeps a state of that."""

    @abc.abstractmethod
    def resists_while(self, memory: Scalar, turn: Scalar, way: Scalar) -> Scalar:
        """The mean voltage [V] that overcomes it while the shaft turns by `turn` >= 0 [rad] in the direction `way` (1
        or -1) from the state `memory`, positive where it resists positive motion."""


class AbstractCountEffect(AbstractEffect):
    """The encoder shows another motion than the shaft's, step by step."""

    @abc.abstractmethod
    def counted(self, step: Step) -> Scalar:
        """Mean speed that the encoder shows in the step [rad/s]."""


class AbstractLagSensorEffect(AbstractMemoryEffect):
    """The reading trails behind by the effect's memory [rad]."""

    @abc.abstractmethod
    def speed(self, memory: Scalar, speed: Scalar) -> Scalar:
        """The filtered speed [rad/s]."""


class AbstractAngleSensorEffect(AbstractEffect):
    """The reading has an error that depends on the angle."""

    @abc.abstractmethod
    def error(self, angle: Scalar) -> Scalar:
        """Reading minus angle [rad], at `angle` [rad]."""
