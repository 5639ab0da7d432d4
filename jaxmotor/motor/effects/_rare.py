"""Laws of some motors, which are sought only where the usual ones leave something unexplained."""

import math
from typing import ClassVar

import jax.numpy as jnp
import numpy as np

from jaxmotor.motor.effects._base import (
    MOST_DRAG,
    AbstractDriveEffect,
    AbstractEffect,
    AbstractFrictionEffect,
    AbstractMemoryTorqueEffect,
    AbstractMotionEffect,
    AbstractSourceEffect,
    AbstractTorqueEffect,
    AbstractWindingEffect,
    Rig,
    Scalar,
    Source,
    Step,
    Winding,
    parameter,
)

RARITY = 4.0
"""Of effects that no data sheet of a hobby motor speaks of: one of a single parameter is as dear as a learned curve,
since a rare law is no likelier beforehand than one that nobody has listed."""
REFERENCE_rad_s = 50.0
"""At which the size of a drag is stated."""
MOST_TOLD_V = 24.0
"""Volts that a motor may have: a drag that takes more is told at a lower speed."""
EDGE_RAD = 0.1
"""Over which the friction of a sector rises at each of its ends."""


class CubicDrive(AbstractDriveEffect, AbstractSourceEffect):
    """u + c u³: an amplifier or a bridge that is not in proportion."""

    name: ClassVar[str] = "cubic_drive"
    family: ClassVar[str] = "drive"
    program_level: ClassVar[int | None] = 0
    over: ClassVar[str] = "voltage"
    sought_last: ClassVar[bool] = True
    rarity: ClassVar[float] = RARITY
    says: ClassVar[str] = "voltages act stronger than in proportion: 10 V by {cubic_1_V2}, others with their square"
    says_negative: ClassVar[str] = (
        "voltages act weaker than in proportion: 10 V by {cubic_1_V2}, others with their square"
    )
    advice: ClassVar[str] = (
        "Measure the mean voltage at the motor's terminals against the command, and invert that curve in software."
    )
    stage: ClassVar[int] = 5
    cubic_1_V2: Scalar = parameter("1/V²", "signed", neutral=0.0, start=2e-3, scale=1e-3)
    """c [1/V²]."""

    @classmethod
    def starts(cls, rig: Rig) -> tuple[AbstractEffect, ...]:
        return (cls.of(cubic_1_V2=0.1 / rig.supply_V**2),) if rig.has_sizes else ()

    def possible(self, rig: Rig) -> bool:
        """More command gives more voltage, up to the supply, and at most twice as much as in proportion."""
        return super().possible(rig) and -1 / 3 < float(self.cubic_1_V2) * rig.supply_V**2 < 1

    def source(self, source: Source, time: Scalar) -> Source:
        del time
        mean = source.mean
        return source.told(mean * (1 + self.cubic_1_V2 * mean**2))


class DeadTime(AbstractDriveEffect, AbstractWindingEffect):
    """u - sgn(i) v: both switches of a half bridge are off for a moment in each period, and its diodes conduct."""

    name: ClassVar[str] = "dead_time"
    family: ClassVar[str] = "friction"
    sought_last: ClassVar[bool] = True
    rarity: ClassVar[float] = RARITY
    holds_by: ClassVar[str] = "volts_V"
    # A bridge that lets the motor coast has current one way only: a voltage lost to it is lost to the command.
    excludes: ClassVar[tuple[str, ...]] = ("coast_drive",)
    says: ClassVar[str] = "the bridge loses {volts_V} against the direction of the current (dead time, diodes)"
    advice: ClassVar[str] = (
        "Add that voltage to commands that drive and take it from those that brake, shorten the bridge's dead time, or "
        "lower its switching frequency."
    )
    volts_V: Scalar = parameter("V", "positive", neutral=0.0, start=0.2, scale=0.2)
    """v = Vs td/T, with the dead time td in each period T of the switches [V]."""

    @classmethod
    def starts(cls, rig: Rig) -> tuple[AbstractEffect, ...]:
        return (cls.of(volts_V=0.03 * rig.supply_V),)

    def winding(self, winding: Winding, source: Source, memory: Scalar | None) -> Winding:
        del source, memory
        return winding._replace(loss=self.volts_V if winding.loss is None else winding.loss + self.volts_V)


class CubicDrag(AbstractMotionEffect, AbstractTorqueEffect):
    """v (w/50)³: a drag that grows faster than with the square of the speed."""

    name: ClassVar[str] = "cubic_drag"
    family: ClassVar[str] = "drag"
    program_level: ClassVar[int | None] = 0
    over: ClassVar[str] = "speed"
    sought_last: ClassVar[bool] = True
    rarity: ClassVar[float] = RARITY
    says: ClassVar[str] = "drag that grows with the cube of the speed takes {volts_V} at 50 rad/s"
    advice: ClassVar[str] = (
        "Look for seals or a liquid around what turns; feed it forward, and expect less gain at high speed."
    )
    volts_V: Scalar = parameter("V", "positive", neutral=0.0, start=0.2, scale=0.2)
    """v, at 50 rad/s [V]."""

    @classmethod
    def starts(cls, rig: Rig) -> tuple[AbstractEffect, ...]:
        return (cls.of(volts_V=0.1 * rig.supply_V * (REFERENCE_rad_s / max(rig.speed_rad_s, 1e-3)) ** 3),)

    def possible(self, rig: Rig) -> bool:
        """The back-EMF takes a part of the voltage, too."""
        return float(self.volts_V) * (rig.speed_rad_s / REFERENCE_rad_s) ** 3 < MOST_DRAG * rig.back_emf_V

    def told(self) -> tuple[str, dict[str, float]]:
        """At a tenth of the reference speed, or less, where there it takes more volts than slow motors have."""
        says, values = super().told()
        volts, tenths = values["volts_V"], 0
        while MOST_TOLD_V < volts < math.inf:
            volts, tenths = volts / 1e3, tenths + 1
        at = f"{REFERENCE_rad_s / 10**tenths:g} rad/s"
        return says.replace(f"{REFERENCE_rad_s:g} rad/s", at), values | {"volts_V": volts}

    def resists(self, speed: Scalar, angle: Scalar) -> Scalar:
        del angle
        return self.volts_V * (speed / REFERENCE_rad_s) ** 3


class SectorFriction(AbstractMotionEffect, AbstractFrictionEffect):
    """sgn(w) v where |θ - θ0| < b/2: friction in one part of each turn."""

    name: ClassVar[str] = "sector_friction"
    family: ClassVar[str] = "friction"
    sought_last: ClassVar[bool] = True
    rarity: ClassVar[float] = RARITY
    holds_by: ClassVar[str] = "volts_V"
    says: ClassVar[str] = (
        "friction takes {volts_V} in one part of each turn: {width_rad} wide, about an angle of {centre_rad}"
    )
    advice: ClassVar[str] = (
        "Look for what rubs at that angle, such as a bent shaft, a damaged tooth or a cable; feed it forward by angle."
    )
    difference: ClassVar[float] = 5e-3
    volts_V: Scalar = parameter("V", "positive", neutral=0.0, start=0.3, scale=0.2)
    """v [V]."""
    # Neither is zero without effect: a factor makes the friction larger, not the sector.
    centre_rad: Scalar = parameter("rad", "signed", neutral=np.pi, start=np.pi, scale=0.3)
    """θ0, from the angle that is called zero [rad]."""
    width_rad: Scalar = parameter("rad", "positive", neutral=1.0, start=1.0, scale=0.3)
    """b, from where half of it rubs to where half of it does [rad]."""

    @classmethod
    def starts(cls, rig: Rig) -> tuple[AbstractEffect, ...]:
        volts, centres = 0.04 * rig.supply_V, np.arange(12) * (np.pi / 6) if rig.turns else []
        return tuple(cls.of(volts_V=volts, centre_rad=at, width_rad=b) for at in centres for b in (0.5, 1.2, 2.5))

    def possible(self, rig: Rig) -> bool:
        """Below its own edge it is no sector, and beyond three quarters of the turn hardly other than friction with a
        gap."""
        return super().possible(rig) and EDGE_RAD < float(self.width_rad) < 1.5 * np.pi

    def friction(self, speed: Scalar, angle: Scalar, time: Scalar) -> Scalar:
        del speed, time
        away = angle - self.centre_rad
        away = jnp.abs(away - 2 * np.pi * jnp.round(away / (2 * np.pi)))
        part = jnp.clip((0.5 * self.width_rad - away) / EDGE_RAD + 0.5, 0.0, 1.0)
        return self.volts_V * part**2 * (3 - 2 * part)


class WarmingFriction(AbstractMotionEffect, AbstractFrictionEffect):
    """sgn(w) v (1 + r exp(-t/τ)): friction that falls while the gear warms up."""

    name: ClassVar[str] = "warming_friction"
    family: ClassVar[str] = "friction"
    program_level: ClassVar[int | None] = 1
    sought_last: ClassVar[bool] = True
    rarity: ClassVar[float] = RARITY
    holds_by: ClassVar[str] = "volts_V"
    contains: ClassVar[tuple[str, ...]] = ("coulomb_friction",)
    # Which of two Coulomb frictions a constant part belongs to, nothing shows.
    excludes: ClassVar[tuple[str, ...]] = ("stiction",)
    says: ClassVar[str] = (
        "friction takes {volts_V} once warm, and {rise_ratio} more when the recording begins, which fades with "
        "{time_constant_s}"
    )
    advice: ClassVar[str] = "Let the motor run in before it is recorded, and feed the warm friction forward."
    volts_V: Scalar = parameter("V", "positive", neutral=0.0, start=0.3, scale=0.2)
    """v, once warm [V]."""
    rise_ratio: Scalar = parameter("1", "positive", neutral=1.0, start=1.0, scale=0.5)
    """r, by how much more of it there is when the recording begins [1]."""
    time_constant_s: Scalar = parameter("s", "positive", neutral=20.0, start=20.0, scale=10.0)
    """τ [s]."""

    @classmethod
    def starts(cls, rig: Rig) -> tuple[AbstractEffect, ...]:
        taus = [max(share * rig.duration_s, 1.5) for share in (0.1, 0.3, 1.0)] if rig.duration_s > 3 else []
        return tuple(cls.of(volts_V=0.03 * rig.supply_V, rise_ratio=0.7, time_constant_s=tau) for tau in taus)

    def possible(self, rig: Rig) -> bool:
        """No gear warms up within a second, and none shows what takes three times the recording."""
        warms = 1.0 < float(self.time_constant_s) < 3 * rig.duration_s
        return super().possible(rig) and warms and float(self.rise_ratio) < 5

    def friction(self, speed: Scalar, angle: Scalar, time: Scalar) -> Scalar:
        del speed, angle
        return self.volts_V * (1 + self.rise_ratio * jnp.exp(-time / self.time_constant_s))


class BristleFriction(AbstractMotionEffect, AbstractMemoryTorqueEffect):
    """v y, zs y' = w - |w| y: friction whose contacts bend like bristles before they slide (Dahl).

    Its memory is y, their deflection relative to the largest, zs.
    """

    name: ClassVar[str] = "bristle_friction"
    family: ClassVar[str] = "friction"
    over: ClassVar[str] = "speed"
    sought_last: ClassVar[bool] = True
    rarity: ClassVar[float] = RARITY
    holds_by: ClassVar[str] = "volts_V"
    contains: ClassVar[tuple[str, ...]] = ("coulomb_friction",)
    excludes: ClassVar[tuple[str, ...]] = ("stiction", "warming_friction")
    says: ClassVar[str] = (
        "friction takes {volts_V}, and gives way like a spring over about {deflection_rad} before it slides"
    )
    advice: ClassVar[str] = (
        "Feed its voltage forward only after that angle beyond each reversal; soft seals, grease and belts do that."
    )
    volts_V: Scalar = parameter("V", "positive", neutral=0.0, start=0.3, scale=0.2)
    """v, while sliding [V]."""
    deflection_rad: Scalar = parameter("rad", "positive", neutral=0.02, start=0.02, scale=0.02)
    """zs [rad]."""

    @classmethod
    def starts(cls, rig: Rig) -> tuple[AbstractEffect, ...]:
        return tuple(cls.of(volts_V=0.04 * rig.supply_V, deflection_rad=z) for z in (0.003, 0.01, 0.03, 0.1, 0.3))

    def possible(self, rig: Rig) -> bool:
        """What bends by a radian is a spring; what bends by a tenth of a milliradian is plain dry friction."""
        return super().possible(rig) and 1e-4 < float(self.deflection_rad) < 1.0

    def begin(self, memory: Scalar, speed: Scalar, pause: Scalar) -> Scalar:
        """A motor at rest stands without tension, one that turns slides."""
        del memory, pause
        return jnp.sign(speed)

    def advance(self, memory: Scalar, step: Step) -> Scalar:
        way = jnp.sign(step.mean)
        return way + (memory - way) * jnp.exp(-jnp.abs(step.mean) * step.duration / self.deflection_rad)

    def resists_while(self, memory: Scalar, turn: Scalar, way: Scalar) -> Scalar:
        ratio = turn / self.deflection_rad
        small = ratio < 1e-4
        safe = jnp.where(small, 1.0, ratio)
        kept = jnp.where(small, 1 - ratio / 2, -jnp.expm1(-safe) / safe)
        return self.volts_V * (way + (memory - way) * kept)
