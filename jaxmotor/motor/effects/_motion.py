"""Effects on torque and speed. Torques are given as the voltage at the winding that overcomes them."""

from typing import ClassVar

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from jaxmotor.motor.effects._base import (
    AbstractFrictionEffect,
    AbstractLoadEffect,
    AbstractMemoryEffect,
    AbstractMotionEffect,
    AbstractTorqueEffect,
    AbstractWindingEffect,
    Load,
    Scalar,
    Source,
    Step,
    Winding,
    parameter,
)


class CoulombFriction(AbstractMotionEffect, AbstractFrictionEffect):
    """sgn(w) v: dry friction of constant size, which holds any torque up to v at rest."""

    name: ClassVar[str] = "coulomb_friction"
    volts_V: Scalar = parameter("V", "positive", neutral=0.0, start=0.3, scale=0.2)
    """v [V]."""

    def rubs(self, speed: Scalar) -> Scalar:
        del speed
        return self.volts_V


class Stiction(AbstractMotionEffect, AbstractFrictionEffect):
    """sgn(w) (v + (vs - v) exp(-(w/ws)²)): dry friction that is larger near rest (Stribeck)."""

    name: ClassVar[str] = "stiction"
    volts_V: Scalar = parameter("V", "positive", neutral=0.0, start=0.3, scale=0.2)
    """v, while turning [V]."""
    static_volts_V: Scalar = parameter("V", "positive", neutral=0.0, start=0.5, scale=0.3)
    """vs, at rest [V]."""
    stribeck_speed_rad_s: Scalar = parameter("rad/s", "positive", neutral=1.0, start=2.0, scale=1.5)
    """ws [rad/s]."""

    def rubs(self, speed: Scalar) -> Scalar:
        near_rest = jnp.exp(-((speed / self.stribeck_speed_rad_s) ** 2))
        return self.volts_V + (self.static_volts_V - self.volts_V) * near_rest


class QuadraticDrag(AbstractMotionEffect, AbstractTorqueEffect):
    """c w |w|: a fan, a propeller, a stirred liquid."""

    name: ClassVar[str] = "quadratic_drag"
    volts_V_s2_rad2: Scalar = parameter("V s²/rad²", "positive", neutral=0.0, start=1e-4, scale=1e-4)
    """c [V s²/rad²]."""

    def resists(self, speed: Scalar, angle: Scalar) -> Scalar:
        del angle
        return self.volts_V_s2_rad2 * speed * jnp.abs(speed)


class Cogging(AbstractMotionEffect, AbstractTorqueEffect):
    """A sin(n θ + φ): a torque locked to the angle, from magnets and slots or from an eccentric gear."""

    name: ClassVar[str] = "cogging"
    volts_V: Scalar = parameter("V", "amplitude", neutral=0.0, start=0.2, scale=0.2)
    """A [V]."""
    cycles_per_rev: Scalar = parameter("1", "fixed", neutral=1.0, start=6.0, scale=1.0)
    """n, cycles in one turn of the output shaft [1]."""
    phase_rad: Scalar = parameter("rad", "phase", neutral=0.0, start=0.0, scale=1.0)
    """φ [rad]."""

    def resists(self, speed: Scalar, angle: Scalar) -> Scalar:
        del speed
        return self.volts_V * jnp.sin(self.cycles_per_rev * angle + self.phase_rad)


class LoadTorque(AbstractMotionEffect, AbstractTorqueEffect):
    """A constant torque, such as a weight on a drum."""

    name: ClassVar[str] = "load_torque"
    volts_V: Scalar = parameter("V", "signed", neutral=0.0, start=0.1, scale=0.1)
    """Positive against positive motion [V]."""

    def resists(self, speed: Scalar, angle: Scalar) -> Scalar:
        del speed, angle
        return self.volts_V


class WindingHeating(AbstractMotionEffect, AbstractWindingEffect, AbstractMemoryEffect):
    """R = R0 (1 + x), τ x' = r i² R/(Vs²/R0) - x: heat raises the resistance; the pole falls, the gain hardly moves."""

    name: ClassVar[str] = "winding_heating"
    stage: ClassVar[int] = 2
    rise_ratio: Scalar = parameter("1", "positive", neutral=0.0, start=1.0, scale=0.7)
    """r, the rise that the heat of a cold winding across the whole supply would bring in the end [1]."""
    time_constant_s: Scalar = parameter("s", "positive", neutral=20.0, start=20.0, scale=15.0)
    """τ [s]."""

    def winding(self, winding: Winding, source: Source, memory: Scalar | None) -> Winding:
        del source
        assert memory is not None
        return winding.more_resistance(memory)

    def begin(self, memory: Scalar, speed: Scalar, pause: Scalar) -> Scalar:
        del speed
        return memory * jnp.exp(-pause / self.time_constant_s)

    def advance(self, memory: Scalar, step: Step) -> Scalar:
        final = self.rise_ratio * (step.current / step.supply) ** 2 * (1 + memory)
        return memory - (final - memory) * jnp.expm1(-step.duration / self.time_constant_s)

    def history(
        self,
        volts: Float[Array, " n"],
        speed: Float[Array, " n"],
        time: Float[Array, " n"],
        duration: Scalar,
        supply: Scalar,
        back: Scalar,
    ) -> Float[Array, " n"]:
        """x at each row of a whole recording, in the order in which it was measured.

        `volts` [V] and the measured mean `speed` [rad/s] over each row of `duration` [s] give the current, `time` [s]
        the pauses. `back` is the back-EMF per speed [V s/rad].
        """

        def row(x: Scalar, now: tuple[Scalar, ...]) -> tuple[Scalar, Scalar]:
            volts, speed, pause = now
            x = self.begin(x, speed, pause)
            current = (volts - back * speed) / (1 + x)
            return self.advance(x, Step(duration, speed, speed, speed, current, speed, supply)), x

        pause = jnp.maximum(jnp.diff(time, prepend=time[:1] - duration) - duration, 0.0)
        return jax.lax.scan(row, jnp.zeros_like(supply), (volts, speed, pause))[1]


class ShaftCompliance(AbstractMotionEffect, AbstractLoadEffect):
    """J2 w2' = k (θ - θ2) + d (w - w2): a load behind a spring, which takes the same torque from the rotor."""

    name: ClassVar[str] = "shaft_compliance"
    frequency_Hz: Scalar = parameter("Hz", "positive", neutral=20.0, start=20.0, scale=10.0)
    """At which the load alone swings while the rotor is held [Hz]: (2π f)² = k/J2."""
    damping_ratio: Scalar = parameter("1", "positive", neutral=0.1, start=0.1, scale=0.08)
    """Of that swing [1]: d/J2 = 2 ζ 2π f."""
    inertia_ratio: Scalar = parameter("1", "positive", neutral=0.0, start=0.3, scale=0.2)
    """J2/J; J, and so the pole, is the rotor's [1]."""

    def load(self) -> Load:
        return Load(self.inertia_ratio, 2 * jnp.pi * self.frequency_Hz, self.damping_ratio, None)


class Backlash(AbstractMotionEffect, AbstractLoadEffect):
    """A load that turns freely within a gap; at its edges the surfaces push like a stiff damped spring."""

    name: ClassVar[str] = "backlash"
    longest_step_s: ClassVar[float] = 1.8e-3
    contact_frequency_Hz: ClassVar[float] = 90.0
    contact_damping_ratio: ClassVar[float] = 0.3
    gap_rad: Scalar = parameter("rad", "positive", neutral=0.0, start=0.03, scale=0.02)
    """From one edge to the other [rad]."""
    inertia_ratio: Scalar = parameter("1", "positive", neutral=0.0, start=0.3, scale=0.2)
    """J2/J; J, and so the pole, is the rotor's [1]."""

    def load(self) -> Load:
        frequency = jnp.full_like(self.gap_rad, 2 * jnp.pi * self.contact_frequency_Hz)
        return Load(
            self.inertia_ratio, frequency, jnp.full_like(self.gap_rad, self.contact_damping_ratio), self.gap_rad
        )
