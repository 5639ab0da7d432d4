"""Disturbances: what acts on the motor from outside in the course of one recording. They are fitted beside a motor's
effects so that those come out right; the motor goes without them into the next recording.

Torques are given as the voltage at the winding that overcomes them.
"""

from typing import ClassVar

import jax.numpy as jnp

from jaxmotor.motor.effects._base import (
    AbstractDriveEffect,
    AbstractEffect,
    AbstractMotionEffect,
    AbstractSourceEffect,
    Rig,
    Scalar,
    Source,
    parameter,
)
from jaxmotor.motor.effects._learned import TERMS, AbstractLearnedVoltage, LearnedCoordinate
from jaxmotor.motor.effects._sine import sine

SLOW_S = 2.0
"""Half a wave of the fastest term of a torque that wanders: what is faster is no wandering, and could be anything."""
ADVICE = "Record again without it, or leave that part of the recording out."


class AbstractDisturbance(AbstractSourceEffect):
    """It is no part of the motor."""

    sought_last: ClassVar[bool] = True
    rarity: ClassVar[float] = 3.0
    advice: ClassVar[str] = ADVICE


class AbstractStepInTime(AbstractDisturbance):
    """Something changes at one moment."""

    moment_s: Scalar = parameter("s", "fixed", neutral=0.0, start=0.0, scale=1.0)
    """Since the recording began [s]."""

    def since(self, time: Scalar) -> Scalar:
        """1 from the moment on, 0 before."""
        return jnp.where(time >= self.moment_s, 1.0, 0.0)


class LoadStep(AbstractMotionEffect, AbstractStepInTime):
    """From one moment on a constant load is there that was not."""

    name: ClassVar[str] = "load_step"
    program_level: ClassVar[int | None] = 0
    says: ClassVar[str] = "a change at t = {moment_s}: from then on a constant load takes {volts_V} more"
    says_negative: ClassVar[str] = "a change at t = {moment_s}: from then on a constant load takes {volts_V} less"
    volts_V: Scalar = parameter("V", "signed", neutral=0.0, start=0.1, scale=0.1)
    """[V]"""

    @classmethod
    def starts(cls, rig: Rig) -> tuple[AbstractEffect, ...]:
        return (cls.start(volts_V=0.02 * rig.supply_V),)

    def source(self, source: Source, time: Scalar) -> Source:
        return source._replace(offset=source.offset - self.volts_V * self.since(time))


class DriveStep(AbstractDriveEffect, AbstractStepInTime):
    """From one moment on any voltage is larger, or smaller, by one factor."""

    name: ClassVar[str] = "drive_step"
    program_level: ClassVar[int | None] = 0
    says: ClassVar[str] = "a change at t = {moment_s}: from then on any voltage is larger by {change_ratio}"
    says_negative: ClassVar[str] = "a change at t = {moment_s}: from then on any voltage is smaller by {change_ratio}"
    change_ratio: Scalar = parameter("1", "signed", neutral=0.0, start=0.05, scale=0.05)
    """[1]"""

    @classmethod
    def starts(cls, rig: Rig) -> tuple[AbstractEffect, ...]:
        del rig
        return (cls.start(),)

    def possible(self, rig: Rig) -> bool:
        """Less than nothing is another polarity; a drive that gives three times as much is another one."""
        return super().possible(rig) and -0.9 < float(self.change_ratio) < 2

    def source(self, source: Source, time: Scalar) -> Source:
        return source._replace(factor=source.factor * (1 + self.change_ratio * self.since(time)))


class PeriodicTorque(AbstractMotionEffect, AbstractDisturbance):
    """A sin(2π f t + φ): a torque that goes on at its own frequency, whatever the shaft does."""

    name: ClassVar[str] = "periodic_torque"
    says: ClassVar[str] = (
        "something periodic at {frequency_Hz}: a torque that the shaft's angle does not explain takes up to {volts_V}"
    )
    advice: ClassVar[str] = "Look for another machine, a fan or a swinging cable; " + ADVICE[:1].lower() + ADVICE[1:]
    volts_V: Scalar = parameter("V", "amplitude", neutral=0.0, start=0.1, scale=0.1)
    """A [V]."""
    frequency_Hz: Scalar = parameter("Hz", "positive", neutral=1.0, start=1.0, scale=0.1)
    """f [Hz]."""
    phase_rad: Scalar = parameter("rad", "phase", neutral=0.0, start=0.0, scale=1.0)
    """φ [rad]."""

    @classmethod
    def starts(cls, rig: Rig) -> tuple[AbstractEffect, ...]:
        return (cls.start(volts_V=0.01 * rig.supply_V),)

    def source(self, source: Source, time: Scalar) -> Source:
        torque = self.volts_V * sine(2 * jnp.pi * self.frequency_Hz * time + self.phase_rad)
        return source._replace(offset=source.offset - torque)


class WanderingTorque(AbstractMotionEffect, AbstractDisturbance, AbstractLearnedVoltage):
    """Σ c_k cos(k π t/t1): a torque that changes slowly in the course of the recording, of any shape."""

    name: ClassVar[str] = "wandering_torque"
    says: ClassVar[str] = "a torque changes slowly in the course of the recording"
    advice: ClassVar[str] = "Look for what warms up, creeps or is pulled; let the motor run in before it is recorded."
    coordinate: ClassVar[LearnedCoordinate] = "time"
    reach_s: Scalar = parameter("s", "range", neutral=1.0, start=1.0, scale=1.0)
    """t1 [s]."""

    @classmethod
    def starts(cls, rig: Rig) -> tuple[AbstractEffect, ...]:
        return (cls.start(reach_s=rig.duration_s),) if rig.duration_s > TERMS * SLOW_S else ()

    def source(self, source: Source, time: Scalar) -> Source:
        return source._replace(offset=source.offset + self.adds(time))

    def adds(self, at: Scalar) -> Scalar:
        z = sine(jnp.pi * (0.5 - jnp.clip(at / self.reach_s, 0.0, 1.0)))
        before, now, total = jnp.ones_like(z), z, jnp.zeros_like(z)
        for c in self.series:
            total = total + c * now
            before, now = now, 2 * z * now - before
        return -total


DISTURBANCES = {effect.name: effect for effect in (LoadStep, DriveStep, PeriodicTorque, WanderingTorque)}
