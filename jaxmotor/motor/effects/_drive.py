"""Effects between the command and the winding: bridge, supply, current."""

import itertools
from typing import ClassVar

import jax
import jax.numpy as jnp
import numpy as np

from jaxmotor.motor.effects._base import (
    INFINITE,
    LONGEST_DELAY_S,
    OWN_LAG_S,
    AbstractDelayEffect,
    AbstractDriveEffect,
    AbstractEffect,
    AbstractLagEffect,
    AbstractSourceEffect,
    AbstractWindingEffect,
    Rig,
    Scalar,
    Source,
    Winding,
    parameter,
)

MOST_ROWS_LATE, BEYOND = 20.0, 2.0
"""Rows up to which any delay is sought; and how many times as long as what is sought one may be."""


class TransportDelay(AbstractDriveEffect, AbstractDelayEffect):
    """u(t - d): the voltage acts late, by any fraction of a tick."""

    name: ClassVar[str] = "transport_delay"
    # A shorter one may be the winding's L/R.
    ordinary: ClassVar[float] = OWN_LAG_S
    family: ClassVar[str] = "lag"
    program_level: ClassVar[int | None] = 1
    rarity: ClassVar[float] = 1 / 6
    always_tried: ClassVar[bool] = True
    says: ClassVar[str] = "the voltage acts {delay_s} later than it was commanded"
    advice: ClassVar[str] = (
        "Write the duty at the start of a tick, shorten what lies between; a controller must allow for the rest."
    )
    delay_s: Scalar = parameter("s", "positive", neutral=0.0, start=4e-3, scale=4e-3)
    """d [s]."""

    @classmethod
    def starts(cls, rig: Rig) -> tuple[AbstractEffect, ...]:
        longest = LONGEST_DELAY_S / rig.period_s
        longer = itertools.takewhile(lambda ticks: ticks < longest, (34.0 * 1.7**k for k in itertools.count()))
        ticks = (0.3, 0.8, 1.4, 2.2, 4.0, 7.0, 12.0, MOST_ROWS_LATE, *longer)
        return tuple(cls.of(delay_s=number * rig.period_s) for number in ticks)

    def possible(self, rig: Rig) -> bool:
        """Fits lead beyond the longest that is sought where a reading hangs: no command is so late."""
        longest_s = max(LONGEST_DELAY_S, MOST_ROWS_LATE * rig.period_s)
        return super().possible(rig) and float(self.delay_s) <= BEYOND * longest_s

    def delay(self) -> Scalar:
        return self.delay_s


SLOWEST_CURRENT_S = 0.1
"""L/R of a motor at most: hobby motors have a few tenths of a millisecond to a few milliseconds, machines of hundreds
of kilowatts up to a tenth of a second."""
FASTEST_PER_S = 1 / 60
"""Of a supply that drifts by itself [1/s]: what drives a motor for a recording is not empty in a minute."""
FASTEST_RISE_PER_S = FASTEST_PER_S / 10
"""The same of one that rises [1/s]: batteries recover by a few percent in minutes, and only without a load."""


class SupplyDrift(AbstractDriveEffect, AbstractSourceEffect):
    """Vs (1 - r t): the supply falls over the recording."""

    name: ClassVar[str] = "supply_drift"
    family: ClassVar[str] = "drive"
    program_level: ClassVar[int | None] = 0
    says: ClassVar[str] = "the supply falls by {rate_per_s}"
    says_negative: ClassVar[str] = "the supply rises by {rate_per_s}"
    advice: ClassVar[str] = "Charge the battery, use a regulated supply, or log the supply's voltage with every row."
    stage: ClassVar[int] = 1
    rate_per_s: Scalar = parameter("1/s", "signed", neutral=0.0, start=1e-3, scale=1e-3)
    """r [1/s]."""

    @classmethod
    def starts(cls, rig: Rig) -> tuple[AbstractEffect, ...]:
        return () if rig.supply_logged else (cls.of(rate_per_s=0.07 / max(rig.duration_s, 1.0)),)

    def possible(self, rig: Rig) -> bool:
        """A supply that gains or loses more than half within a recording is none, nor one that is empty in a minute."""
        rate = float(self.rate_per_s)
        return super().possible(rig) and abs(rate) * rig.duration_s < 0.5 and -FASTEST_RISE_PER_S < rate < FASTEST_PER_S

    def source(self, source: Source, time: Scalar) -> Source:
        return source._replace(supply=source.supply * (1 - self.rate_per_s * time))


class DeadZone(AbstractDriveEffect, AbstractSourceEffect):
    """sgn(u) max(|u| - d, 0): the first volts are lost."""

    name: ClassVar[str] = "dead_zone"
    family: ClassVar[str] = "friction"
    program_level: ClassVar[int | None] = 0
    over: ClassVar[str] = "voltage"
    rarity: ClassVar[float] = 3 / 6
    holds_by: ClassVar[str] = "volts_V"
    says: ClassVar[str] = "the first {volts_V} of any voltage are lost"
    advice: ClassVar[str] = "Add that voltage to every command, with the command's sign; a MOSFET bridge loses less."
    stage: ClassVar[int] = 2
    volts_V: Scalar = parameter("V", "positive", neutral=0.0, start=0.3, scale=0.2)
    """d [V]."""

    @classmethod
    def starts(cls, rig: Rig) -> tuple[AbstractEffect, ...]:
        return tuple(cls.of(volts_V=share * rig.supply_V) for share in (0.02, 0.05, 0.1)) if rig.has_sizes else ()

    def possible(self, rig: Rig) -> bool:
        """Of voltages of one size it takes the same share as less gain does."""
        return super().possible(rig) and rig.has_sizes

    def source(self, source: Source, time: Scalar) -> Source:
        del time
        mean = source.mean
        return source.told(jnp.sign(mean) * jax.nn.relu(jnp.abs(mean) - self.volts_V))


class InputThreshold(AbstractDriveEffect, AbstractSourceEffect):
    """u where |u| >= d, else 0: small voltages do nothing, larger ones are complete."""

    name: ClassVar[str] = "input_threshold"
    family: ClassVar[str] = "friction"
    program_level: ClassVar[int | None] = 0
    over: ClassVar[str] = "voltage"
    holds_by: ClassVar[str] = "volts_V"
    says: ClassVar[str] = "voltages below {volts_V} do nothing, larger ones act in full"
    advice: ClassVar[str] = "Keep commands above it; look for a least duty in the driver or its firmware."
    stage: ClassVar[int] = 3
    # A recording shows only between which two of its voltages the threshold is: fits try each place.
    volts_V: Scalar = parameter("V", "fixed", neutral=0.0, start=0.3, scale=0.2)
    """d [V]."""

    @classmethod
    def starts(cls, rig: Rig) -> tuple[AbstractEffect, ...]:
        places = cls._places(rig)
        return tuple(cls.of(volts_V=volts) for volts in places[:: cls._apart(places)])

    def around(self, rig: Rig) -> tuple[AbstractEffect, ...]:
        places, volts = self._places(rig), float(self.volts_V)
        own, apart = int(np.searchsorted(places, volts)), self._apart(places)
        near = places[max(own - apart, 0) : own + apart + 1] if apart > 1 else []
        return tuple(self.of(volts_V=other) for other in near if other != volts)

    @staticmethod
    def _places(rig: Rig) -> list[float]:
        """In the middle between two of the voltages that were applied [V]: what is larger than most is no threshold."""
        low, high = 0.004 * rig.supply_V, 0.3 * rig.supply_V
        between = [(a + b) / 2 for a, b in zip((0.0, *rig.volts_V), rig.volts_V, strict=False)]
        return [volts for volts in between if low < volts < high]

    @staticmethod
    def _apart(places: list[float]) -> int:
        """Of how many `places` one is a start."""
        return max(1, len(places) // 32)

    def source(self, source: Source, time: Scalar) -> Source:
        del time
        mean = source.mean
        return source.told(jnp.where(jnp.abs(mean) < self.volts_V, 0.0, mean))


class VoltageSaturation(AbstractDriveEffect, AbstractSourceEffect):
    """u within +-Vmax: the bridge gives no more."""

    name: ClassVar[str] = "voltage_saturation"
    family: ClassVar[str] = "drive"
    program_level: ClassVar[int | None] = 0
    over: ClassVar[str] = "voltage"
    says: ClassVar[str] = "the bridge gives no more than {volts_V}"
    advice: ClassVar[str] = (
        "Plan with that limit instead of the supply's voltage, and tell the controller (anti-windup)."
    )
    stage: ClassVar[int] = 4
    volts_V: Scalar = parameter("V", "positive", neutral=INFINITE, start=6.0, scale=1.0)
    """Vmax [V]."""

    @classmethod
    def starts(cls, rig: Rig) -> tuple[AbstractEffect, ...]:
        shares = (0.75, 0.82, 0.88, 0.93, 0.97) if rig.has_sizes else ()
        return tuple(cls.of(volts_V=share * max(rig.volts_V)) for share in shares)

    def possible(self, rig: Rig) -> bool:
        """Voltages of one size may all be cut off, or none."""
        return super().possible(rig) and rig.has_sizes

    def source(self, source: Source, time: Scalar) -> Source:
        del time
        return source.told(jnp.clip(source.mean, -self.volts_V, self.volts_V))


class DirectionAsymmetry(AbstractDriveEffect, AbstractSourceEffect):
    """(1 + e sgn(u)) u: one direction gets more voltage than the other."""

    name: ClassVar[str] = "direction_asymmetry"
    family: ClassVar[str] = "direction"
    program_level: ClassVar[int | None] = 0
    over: ClassVar[str] = "voltage"
    says: ClassVar[str] = "voltages act {ratio} stronger forward, and as much weaker backward"
    says_negative: ClassVar[str] = "voltages act {ratio} weaker forward, and as much stronger backward"
    advice: ClassVar[str] = (
        "Scale commands by direction; measure at the motor's terminals which half of the bridge is weak."
    )
    stage: ClassVar[int] = 5
    ratio: Scalar = parameter("1", "signed", neutral=0.0, start=0.03, scale=0.03)
    """e [1]."""

    @classmethod
    def starts(cls, rig: Rig) -> tuple[AbstractEffect, ...]:
        return (cls.of(ratio=0.04),)

    def possible(self, rig: Rig) -> bool:
        """Beyond that one direction would turn backward."""
        return super().possible(rig) and abs(float(self.ratio)) < 1

    def source(self, source: Source, time: Scalar) -> Source:
        del time
        return source._replace(factor=source.factor * (1 + self.ratio * jnp.sign(source.duty)))


class VoltageOffset(AbstractDriveEffect, AbstractSourceEffect):
    """u + u0: a constant voltage in series with the winding."""

    name: ClassVar[str] = "voltage_offset"
    family: ClassVar[str] = "direction"
    program_level: ClassVar[int | None] = 0
    same_as: ClassVar[tuple[str, ...]] = ("load_torque",)
    rarity: ClassVar[float] = 4 / 6
    says: ClassVar[str] = "a constant {volts_V} is added to every voltage"
    advice: ClassVar[str] = (
        "Subtract it from every command; look for a duty that is not centred, or a load that pulls one way."
    )
    stage: ClassVar[int] = 6
    volts_V: Scalar = parameter("V", "signed", neutral=0.0, start=0.1, scale=0.1)
    """u0 [V]."""

    @classmethod
    def starts(cls, rig: Rig) -> tuple[AbstractEffect, ...]:
        return (cls.of(volts_V=0.02 * rig.supply_V),)

    def source(self, source: Source, time: Scalar) -> Source:
        del time
        return source._replace(offset=source.offset + self.volts_V)


class CoastDrive(AbstractDriveEffect, AbstractWindingEffect):
    """q = |D| (sgn(D) Vs - back-EMF), never against D: the winding is connected for the share |D| only.

    While the duty D is constant this is a linear motor whose pole shrinks with |D|; at D = 0 there is no current.
    """

    name: ClassVar[str] = "coast_drive"
    family: ClassVar[str] = "friction"
    excludes: ClassVar[tuple[str, ...]] = ("electrical_pole",)
    always_tried: ClassVar[bool] = True
    says: ClassVar[str] = (
        "the bridge lets the motor coast between pulses (fast decay), so speed is not in proportion to the duty"
    )
    advice: ClassVar[str] = "Let the bridge brake between pulses (slow decay) if it can; else simulate with this law."
    beside: ClassVar[tuple[str, ...]] = ("coulomb_friction",)
    lagless: ClassVar[bool] = True

    @classmethod
    def starts(cls, rig: Rig) -> tuple[AbstractEffect, ...]:
        # One voltage that is switched on and off is taken for the supply's: then the motor coasts while it is off.
        return (cls(),) if rig.supply_known or not rig.has_sizes else ()

    def winding(self, winding: Winding, source: Source, memory: Scalar | None) -> Winding:
        del memory
        volts = jnp.sign(source.duty) * source.supply * source.factor + source.offset
        return winding._replace(volts=volts, share=jnp.abs(source.duty), way=jnp.ones_like(volts))


class SupplySag(AbstractDriveEffect, AbstractWindingEffect):
    """D (Vs - Rs |D i|): the supply's resistance adds Rs D² to the winding's, and takes it back while braking.

    A bridge that gives one direction more voltage gives it so much more of the sag, too.
    """

    name: ClassVar[str] = "supply_sag"
    family: ClassVar[str] = "drive"
    program_level: ClassVar[int | None] = 1
    says: ClassVar[str] = "the supply gives way under load: its resistance is {ratio} of the winding's"
    advice: ClassVar[str] = "Use thicker leads or a stronger supply, or log the supply's voltage with every row."
    stage: ClassVar[int] = 1
    ratio: Scalar = parameter("1", "positive", neutral=0.0, start=0.2, scale=0.15)
    """Rs/R [1]."""

    @classmethod
    def starts(cls, rig: Rig) -> tuple[AbstractEffect, ...]:
        return (cls.of(ratio=0.2),) if rig.supply_known and not rig.supply_logged else ()

    def possible(self, rig: Rig) -> bool:
        """With more resistance than the winding a supply drives no motor."""
        return super().possible(rig) and float(self.ratio) < 1

    def winding(self, winding: Winding, source: Source, memory: Scalar | None) -> Winding:
        del memory
        return winding.more_resistance(self.ratio * source.duty**2 * source.factor * winding.way)


class CurrentLimit(AbstractDriveEffect, AbstractWindingEffect):
    """|i| R <= v: the driver gives no more current."""

    name: ClassVar[str] = "current_limit"
    family: ClassVar[str] = "drive"
    always_tried: ClassVar[bool] = True
    cheap_alone: ClassVar[bool] = True
    says: ClassVar[str] = "the driver gives no more current than {volts_V} would drive through the winding at rest"
    advice: ClassVar[str] = (
        "Raise the driver's current limit if motor and driver stand it; else accelerate more gently."
    )
    stage: ClassVar[int] = 3
    volts_V: Scalar = parameter("V", "positive", neutral=INFINITE, start=5.0, scale=2.0)
    """v = Imax R [V]."""

    @classmethod
    def starts(cls, rig: Rig) -> tuple[AbstractEffect, ...]:
        return tuple(cls.of(volts_V=share * rig.volts_V[-1]) for share in (0.3, 0.45, 0.6, 0.8, 1.1, 1.5))

    def winding(self, winding: Winding, source: Source, memory: Scalar | None) -> Winding:
        del source, memory
        limit = self.volts_V if winding.limit is None else jnp.minimum(winding.limit, self.volts_V)
        return winding._replace(limit=limit)


class ElectricalPole(AbstractDriveEffect, AbstractLagEffect):
    """L/R i' = u/R - i - back-EMF/R: the current, and so the torque, lags."""

    name: ClassVar[str] = "electrical_pole"
    ordinary: ClassVar[float] = OWN_LAG_S
    family: ClassVar[str] = "lag"
    program_level: ClassVar[int | None] = 1
    relatives: ClassVar[tuple[str, ...]] = ("sensor_lag", "transport_delay")
    rarity: ClassVar[float] = 2 / 6
    always_tried: ClassVar[bool] = True
    says: ClassVar[str] = "the current, and so the torque, lags the voltage by {time_constant_s} (L/R)"
    advice: ClassVar[str] = "Use the model of second order (jaxmotor identify --model second)."
    time_constant_s: Scalar = parameter("s", "positive", neutral=0.0, start=3e-3, scale=2e-3)
    """L/R [s], in addition to the linear motor's, which a diagnosis takes for 0 beside it."""

    @classmethod
    def starts(cls, rig: Rig) -> tuple[AbstractEffect, ...]:
        del rig
        return tuple(cls.of(time_constant_s=value) for value in (1.5e-3, 4e-3))

    def possible(self, rig: Rig) -> bool:
        """A lag as slow as no winding's is another one's."""
        return super().possible(rig) and float(self.time_constant_s) < SLOWEST_CURRENT_S

    def lag(self) -> Scalar:
        return self.time_constant_s
