"""Effects between the shaft and the log."""

from typing import ClassVar

import jax.numpy as jnp
import numpy as np

from jaxmotor.motor.effects._base import (
    OWN_LAG_S,
    AbstractAngleSensorEffect,
    AbstractCountEffect,
    AbstractEffect,
    AbstractLagSensorEffect,
    AbstractSensorEffect,
    Rig,
    Scalar,
    Step,
    parameter,
)
from jaxmotor.motor.effects._sine import sine

MOST_LOST = 0.5
"""Share of the counts that may be lost."""
STARTS = (0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0, 1.1)
"""Speeds above which they are, over the largest that was read: where counts are lost the shaft is faster."""


class MissedCounts(AbstractSensorEffect, AbstractCountEffect):
    """(1 - r) w where |w| > ws: a share of the counts is lost at speed."""

    name: ClassVar[str] = "missed_counts"
    family: ClassVar[str] = "counts"
    program_level: ClassVar[int | None] = 0
    # Lost counts are rounded twice.
    explained_chi2: ClassVar[float] = 2.1
    says: ClassVar[str] = "above {speed_rad_s}, {ratio} of the encoder's counts are lost"
    advice: ClassVar[str] = (
        "Count in interrupts or in hardware, shorten or shield the encoder's wires, or keep below that speed."
    )
    ratio: Scalar = parameter("1", "positive", neutral=0.0, start=0.05, scale=0.04)
    """r [1]."""
    speed_rad_s: Scalar = parameter("rad/s", "positive", neutral=40.0, start=40.0, scale=20.0)
    """ws [rad/s]."""

    @classmethod
    def starts(cls, rig: Rig) -> tuple[AbstractEffect, ...]:
        speeds = [share * rig.speed_rad_s for share in STARTS] if rig.counts else []
        return tuple(cls.of(ratio=0.06, speed_rad_s=speed) for speed in speeds)

    def around(self, rig: Rig) -> tuple[AbstractEffect, ...]:
        """Few rows may lie above the speed, and a share that is too small there leads to no other one."""
        sizes = [factor * float(self.ratio) for factor in (1, 4)]
        speeds = [share * rig.speed_rad_s for share in np.linspace(0.3, 1.5, 25).tolist()]
        return tuple(self.of(ratio=size, speed_rad_s=speed) for speed in speeds for size in sizes if size < MOST_LOST)

    def possible(self, rig: Rig) -> bool:
        """A counter that loses most of them shows no speed."""
        return super().possible(rig) and float(self.ratio) < MOST_LOST

    def counted(self, step: Step) -> Scalar:
        # Within a step the speed is taken as a straight line, which crosses ws once at most.
        sizes = jnp.abs(step.before), jnp.abs(step.after)
        low, high = jnp.minimum(*sizes), jnp.maximum(*sizes)
        above = jnp.clip((high - self.speed_rad_s) / jnp.maximum(high - low, 1e-9), 0.0, 1.0)
        return step.seen * (1 - self.ratio * above)


class SensorLag(AbstractSensorEffect, AbstractLagSensorEffect):
    """τ y' = θ - y: the reading, and so the logged speed, was filtered. Its memory is θ - y."""

    name: ClassVar[str] = "sensor_lag"
    # A shorter one may be the winding's L/R.
    ordinary: ClassVar[float] = OWN_LAG_S
    family: ClassVar[str] = "lag"
    program_level: ClassVar[int | None] = 1
    says: ClassVar[str] = "the log was filtered with a time constant of {time_constant_s}"
    advice: ClassVar[str] = (
        "Log counts instead of a filtered speed, or shorten the filter; a controller must allow for its lag."
    )
    time_constant_s: Scalar = parameter("s", "positive", neutral=0.0, start=5e-3, scale=4e-3)
    """τ [s]."""

    @classmethod
    def starts(cls, rig: Rig) -> tuple[AbstractEffect, ...]:
        return tuple(cls.of(time_constant_s=share * rig.period_s) for share in (0.6, 1.6))

    def begin(self, memory: Scalar, speed: Scalar, pause: Scalar) -> Scalar:
        del memory, pause
        return self.time_constant_s * speed

    def advance(self, memory: Scalar, step: Step) -> Scalar:
        """Exact where the speed is a straight line over the step."""
        tau, duration = self.time_constant_s, jnp.maximum(step.duration, 1e-12)
        shift = step.seen - step.mean
        before, after = step.before + shift, step.after + shift
        bend = tau * (after - before) / duration
        decay = jnp.exp(-duration / jnp.maximum(tau, 1e-3 * duration))
        return tau * (after - bend) + (memory - tau * (before - bend)) * decay

    def speed(self, memory: Scalar, speed: Scalar) -> Scalar:
        lags = self.time_constant_s > 0
        return jnp.where(lags, memory / jnp.where(lags, self.time_constant_s, 1.0), speed)


MOST_MISREAD = 0.25
"""Part of a speed by which an encoder off its centre misreads it at most: what is off by more runs into its reader."""


class EncoderEccentricity(AbstractSensorEffect, AbstractAngleSensorEffect):
    """y = θ + A sin(n θ + φ): a disc or magnet off its centre."""

    name: ClassVar[str] = "encoder_eccentricity"
    family: ClassVar[str] = "angle"
    cheap_alone: ClassVar[bool] = True
    says: ClassVar[str] = "the encoder misreads the angle by up to {amplitude_rad}, {cycles_per_rev} times per turn"
    advice: ClassVar[str] = "Centre the encoder's disc or magnet, or correct the reading by angle."
    amplitude_rad: Scalar = parameter("rad", "amplitude", neutral=0.0, start=0.03, scale=0.02)
    """A [rad]."""
    cycles_per_rev: Scalar = parameter("1", "fixed", neutral=1.0, start=1.0, scale=1.0)
    """n [1]."""
    phase_rad: Scalar = parameter("rad", "phase", neutral=0.0, start=0.0, scale=1.0)
    """φ [rad]."""

    @classmethod
    def starts(cls, rig: Rig) -> tuple[AbstractEffect, ...]:
        waves = [(n, phase) for n in range(1, 9) for phase in (0.0, 0.5 * np.pi)] if rig.turns else []
        return tuple(cls.of(amplitude_rad=0.03, cycles_per_rev=n, phase_rad=phase) for n, phase in waves)

    def possible(self, rig: Rig) -> bool:
        """Less off its centre than a quarter of its radius: that misreads speeds by a quarter."""
        misread = abs(float(self.amplitude_rad) * float(self.cycles_per_rev))
        return super().possible(rig) and misread < MOST_MISREAD

    def error(self, angle: Scalar) -> Scalar:
        return self.amplitude_rad * sine(self.cycles_per_rev * angle + self.phase_rad)
