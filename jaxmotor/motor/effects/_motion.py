"""Effects on torque and speed. Torques are given as the voltage at the winding that overcomes them."""

import math
from collections.abc import Callable
from typing import ClassVar, NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from jaxmotor.motor._scan import scan_rows
from jaxmotor.motor.effects._base import (
    MOST_DRAG,
    AbstractEffect,
    AbstractFrictionEffect,
    AbstractLoadEffect,
    AbstractMemoryEffect,
    AbstractMotionEffect,
    AbstractTorqueEffect,
    AbstractWindingEffect,
    Load,
    Rig,
    Scalar,
    Source,
    Step,
    Winding,
    parameter,
)
from jaxmotor.motor.effects._sine import sine

FASTEST_RISE_PER_S = 1.0
"""Of a cold winding's resistance across the whole supply, over itself [1/s]. Copper with a current density j that loses
no heat gains a r j²/c, a its coefficient of temperature (0.0039/K), r its resistivity (1.7e-8 Ωm), c its heat capacity
(3.4e6 J/m³K): 1/s asks for 230 A/mm² and warms it by 250 K in a second."""
SLOWEST_Hz, FASTEST_Hz, SPACING = 0.5, 64.0, 1.35
"""At which loads on springs are looked for, and how many times faster each is than the one before."""

MOST_STATIC = 10.0
"""Static friction over the moving one. Dry and lubricated contacts have 1 to 2, rarely 3 [Armstrong-Helouvry, Dupont,
Canudas de Wit 1994]; the teeth of a small rotor are held by its magnets, too, which as it turns averages out: the motor
of a published log starts at 2.6 to 3.3 V and goes on at 0.54 V."""
SHAPED, TUSTIN = 1.5, 0.76
"""Exponent up to which static friction falls like an exponential; and the speed of that over the speed of the bell that
is nearest to it, their heights aside (least squares over speeds)."""
ARM_RAD = 1.0
"""Angle that a shaft must swing for a weight on an arm to differ from a constant load: by 12 % at the ends of it."""


class CoulombFriction(AbstractMotionEffect, AbstractFrictionEffect):
    """sgn(w) v: dry friction of constant size, which holds any torque up to v at rest."""

    name: ClassVar[str] = "coulomb_friction"
    family: ClassVar[str] = "friction"
    program_level: ClassVar[int | None] = 0
    over: ClassVar[str] = "speed"
    relatives: ClassVar[tuple[str, ...]] = ("dead_zone", "voltage_offset", "load_torque")
    rarity: ClassVar[float] = 0.0
    holds_by: ClassVar[str] = "volts_V"
    says: ClassVar[str] = "dry friction takes {volts_V} whichever way the shaft turns, and holds it at rest below that"
    advice: ClassVar[str] = (
        "Add that voltage in the direction of motion (feedforward); look at brushes, bearings and gears."
    )
    volts_V: Scalar = parameter("V", "positive", neutral=0.0, start=0.3, scale=0.2)
    """v [V]."""

    @classmethod
    def starts(cls, rig: Rig) -> tuple[AbstractEffect, ...]:
        return (cls.of(volts_V=0.04 * rig.supply_V),)

    def friction(self, speed: Scalar, angle: Scalar, time: Scalar) -> Scalar:
        del speed, angle, time
        return self.volts_V


class Stiction(AbstractMotionEffect, AbstractFrictionEffect):
    """sgn(w) (v + (vs - v) exp(-|w/ws|ⁿ)): static friction, larger than the friction in motion (Stribeck).

    It falls to that like an exponential (n = 1, Tustin) or a bell (n = 2); both are in use [Armstrong-Hélouvry, Dupont,
    Canudas de Wit 1994].
    """

    name: ClassVar[str] = "stiction"
    family: ClassVar[str] = "friction"
    program_level: ClassVar[int | None] = 0
    over: ClassVar[str] = "speed"
    holds_by: ClassVar[str] = "static_volts_V"
    contains: ClassVar[tuple[str, ...]] = ("coulomb_friction",)
    says: ClassVar[str] = (
        "friction takes {volts_V} while turning, {static_volts_V} near rest (below about {stribeck_speed_rad_s})"
    )
    advice: ClassVar[str] = "Keep faster than that, or start with a short push; feed the friction's voltage forward."
    volts_V: Scalar = parameter("V", "positive", neutral=0.0, start=0.3, scale=0.2)
    """v, while turning [V]."""
    static_volts_V: Scalar = parameter("V", "positive", neutral=0.0, start=0.5, scale=0.3, least="volts_V")
    """vs, at rest [V]."""
    stribeck_speed_rad_s: Scalar = parameter("rad/s", "positive", neutral=1.0, start=2.0, scale=1.5)
    """ws [rad/s]."""
    exponent: Scalar = parameter("1", "fixed", neutral=2.0, start=2.0, scale=1.0, absent=2.0, choices=(1.0, 2.0))
    """n, 1 or 2."""

    @classmethod
    def starts(cls, rig: Rig) -> tuple[AbstractEffect, ...]:
        volts, static = 0.03 * rig.supply_V, 0.06 * rig.supply_V
        widths = [share * rig.speed_rad_s for share in (0.015, 0.04, 0.1)]
        return tuple(cls.of(volts_V=volts, static_volts_V=static, stribeck_speed_rad_s=width) for width in widths)

    def possible(self, rig: Rig) -> bool:
        """Static friction below moving friction would be another law, and so would many times that."""
        moving, static = float(self.volts_V), float(self.static_volts_V)
        return super().possible(rig) and moving <= static <= MOST_STATIC * moving

    def told(self) -> tuple[str, dict[str, float]]:
        """Of one size it is dry friction by another name."""
        says, values = super().told()
        return CoulombFriction.says if self.is_special else says, values

    def around(self, rig: Rig) -> tuple[AbstractEffect, ...]:
        """With the other exponent, over about the same speeds."""
        del rig
        exponent, wider = (2.0, 1 / TUSTIN) if float(self.exponent) < SHAPED else (1.0, TUSTIN)
        width = float(self.stribeck_speed_rad_s) * wider
        return tuple(self.but(exponent=exponent, stribeck_speed_rad_s=factor * width) for factor in (0.7, 1.0, 1.4))

    def friction(self, speed: Scalar, angle: Scalar, time: Scalar) -> Scalar:
        del angle, time
        ratio = jnp.abs(speed / self.stribeck_speed_rad_s)
        near_rest = jnp.exp(-jnp.where(self.exponent < SHAPED, ratio, ratio**2))
        return self.volts_V + (self.static_volts_V - self.volts_V) * near_rest


class QuadraticDrag(AbstractMotionEffect, AbstractTorqueEffect):
    """c w |w|: a fan, a propeller, a stirred liquid."""

    name: ClassVar[str] = "quadratic_drag"
    family: ClassVar[str] = "drag"
    program_level: ClassVar[int | None] = 0
    over: ClassVar[str] = "speed"
    says: ClassVar[str] = "drag that grows with the square of the speed takes {volts_V_s2_rad2} at 10 rad/s"
    advice: ClassVar[str] = (
        "A fan, a propeller or a stirred liquid does that; feed it forward, and expect less gain at high speed."
    )
    volts_V_s2_rad2: Scalar = parameter("V s²/rad²", "positive", neutral=0.0, start=1e-4, scale=1e-4)
    """c [V s²/rad²]."""

    @classmethod
    def starts(cls, rig: Rig) -> tuple[AbstractEffect, ...]:
        return (cls.of(volts_V_s2_rad2=0.1 * rig.supply_V / max(rig.speed_rad_s, 1e-3) ** 2),)

    def possible(self, rig: Rig) -> bool:
        """The back-EMF takes a part of the voltage, too."""
        return float(self.volts_V_s2_rad2) * rig.speed_rad_s**2 < MOST_DRAG * rig.back_emf_V

    def resists(self, speed: Scalar, angle: Scalar) -> Scalar:
        del angle
        return self.volts_V_s2_rad2 * speed * jnp.abs(speed)


class Cogging(AbstractMotionEffect, AbstractTorqueEffect):
    """A sin(n θ + φ): a torque locked to the angle, from magnets and slots or from an eccentric gear. Once per turn
    it is gravity on an arm, or something unbalanced."""

    name: ClassVar[str] = "cogging"
    family: ClassVar[str] = "angle"
    cheap_alone: ClassVar[bool] = True
    says: ClassVar[str] = "a torque locked to the shaft's angle takes up to {volts_V}, {cycles_per_rev} times per turn"
    says_once: ClassVar[str] = (
        "gravity on an arm, or something unbalanced: a torque of one cycle in a turn takes up to {volts_V}"
    )
    advice: ClassVar[str] = (
        "Look for magnets and slots, or a gear out of true, of that number per turn, or for a weight on an arm if it "
        "is one; feed it forward by angle."
    )
    volts_V: Scalar = parameter("V", "amplitude", neutral=0.0, start=0.2, scale=0.2)
    """A [V]."""
    cycles_per_rev: Scalar = parameter("1", "fixed", neutral=1.0, start=6.0, scale=1.0)
    """n, cycles in one turn of the output shaft [1]."""
    phase_rad: Scalar = parameter("rad", "phase", neutral=0.0, start=0.0, scale=1.0)
    """φ [rad]."""

    @classmethod
    def starts(cls, rig: Rig) -> tuple[AbstractEffect, ...]:
        # A whole cycle at least; of an arm less will do.
        seen = [n for n in range(1, 13) if rig.turns or n * rig.swing_rad >= (ARM_RAD if n == 1 else 2 * np.pi)]
        waves = [(n, phase) for n in seen for phase in (0.0, 0.5 * np.pi)]
        return tuple(cls.of(volts_V=0.04 * rig.supply_V, cycles_per_rev=n, phase_rad=phase) for n, phase in waves)

    def told(self) -> tuple[str, dict[str, float]]:
        says, values = super().told()
        return self.says_once if float(self.cycles_per_rev) == 1 else says, values

    def resists(self, speed: Scalar, angle: Scalar) -> Scalar:
        del speed
        return self.volts_V * sine(self.cycles_per_rev * angle + self.phase_rad)


class LoadTorque(AbstractMotionEffect, AbstractTorqueEffect):
    """A constant torque, such as a weight on a drum."""

    name: ClassVar[str] = "load_torque"
    family: ClassVar[str] = "direction"
    program_level: ClassVar[int | None] = 0
    rarity: ClassVar[float] = 5 / 6
    says: ClassVar[str] = "a constant load takes {volts_V} from forward motion and gives as much to backward motion"
    says_negative: ClassVar[str] = (
        "a constant load takes {volts_V} from backward motion and gives as much to forward motion"
    )
    advice: ClassVar[str] = (
        "Look for a weight or a spring on the shaft; balance it, or add that voltage to every command."
    )
    volts_V: Scalar = parameter("V", "signed", neutral=0.0, start=0.1, scale=0.1)
    """Positive against positive motion [V]."""

    @classmethod
    def starts(cls, rig: Rig) -> tuple[AbstractEffect, ...]:
        return (cls.of(volts_V=0.02 * rig.supply_V),)

    def resists(self, speed: Scalar, angle: Scalar) -> Scalar:
        del speed, angle
        return self.volts_V


class WindingHeating(AbstractMotionEffect, AbstractWindingEffect, AbstractMemoryEffect):
    """R = R0 (1 + x), τ x' = r i² R/(Vs²/R0) - x: heat raises the resistance; the pole falls, the gain hardly moves."""

    name: ClassVar[str] = "winding_heating"
    family: ClassVar[str] = "drive"
    cheap_alone: ClassVar[bool] = True
    says: ClassVar[str] = (
        "heat raises the winding's resistance: in the end by {rise_ratio} if held still at full supply, "
        "within {time_constant_s}"
    )
    advice: ClassVar[str] = "Let the motor rest between runs or cool it; identify it as warm as it will run."
    stage: ClassVar[int] = 2
    rise_ratio: Scalar = parameter("1", "positive", neutral=0.0, start=1.0, scale=0.7)
    """r, the rise that the heat of a cold winding across the whole supply would bring in the end [1]."""
    time_constant_s: Scalar = parameter("s", "positive", neutral=20.0, start=20.0, scale=15.0)
    """τ [s]."""

    @classmethod
    def starts(cls, rig: Rig) -> tuple[AbstractEffect, ...]:
        del rig
        return tuple(cls.of(rise_ratio=1.5, time_constant_s=tau) for tau in (6.0, 15.0, 40.0))

    def winding(self, winding: Winding, source: Source, memory: Scalar | None) -> Winding:
        del source
        assert memory is not None
        return winding.more_resistance(memory)

    def possible(self, rig: Rig) -> bool:
        """Copper has 1.4 times the resistance at 120 °C: a motor that would reach six times would not last a run."""
        heats_up = float(self.rise_ratio) < FASTEST_RISE_PER_S * float(self.time_constant_s)
        return super().possible(rig) and heats_up and float(self.rise_ratio) < 5

    def begin(self, memory: Scalar, speed: Scalar, pause: Scalar) -> Scalar:
        del speed
        return memory * jnp.exp(-pause / self.time_constant_s)

    def advance(self, memory: Scalar, step: Step) -> Scalar:
        return self._heated(memory, step.current**2 / step.supply**2, step.duration)

    def _heated(self, memory: Scalar, square: Scalar, duration: Scalar) -> Scalar:
        """x after `duration` with a mean (q/Vs)² of `square`."""
        final = self.rise_ratio * square * (1 + memory)
        return memory - (final - memory) * jnp.expm1(-duration / self.time_constant_s)

    def history(self, log: "MeasuredLog", back: Scalar, pole: Scalar, current: "CurrentLaw") -> Float[Array, " n"]:
        """x at each row of a whole recording, in the order in which it was measured.

        `back` is the back-EMF per speed [V s/rad], `pole` the motor's [rad/s]. In the pauses between experiments the
        bridge brakes: what turned when the last one ended, heats the winding by (r/τ) (back w/Vs)²/(2 a).
        """

        def row(carry: tuple[Scalar, Scalar], now: tuple[Scalar, ...]) -> tuple[tuple[Scalar, Scalar], Scalar]:
            x, before = carry
            volts, speed, time, pause = now
            braked = self.rise_ratio / self.time_constant_s * (back * before / log.supply) ** 2 / (2 * pole)
            x = self.begin(x + jnp.where(pause > 0, braked, 0.0), speed, pause)
            q, slope = current(volts, speed, time, x)
            # Rounding adds to the mean square of a measured speed what it is known to add.
            square = q**2 - slope**2 * log.speed_variance
            return (self._heated(x, square / log.supply**2, log.duration), speed), x

        pause = jnp.diff(log.time, prepend=log.time[:1] - log.duration) - log.duration
        pause = jnp.where(pause > 0.5 * log.duration, pause, 0.0)
        none = jnp.zeros_like(log.supply)
        return scan_rows(row, (none, none), (log.volts, log.speed, log.time, pause), log.used)[1]


CurrentLaw = Callable[[Scalar, Scalar, Scalar, Scalar], tuple[Scalar, Scalar]]
"""Of voltage [V], speed [rad/s], time [s] and rise of resistance x: i R0 [V] and its slope over the speed [V s/rad]."""


class MeasuredLog(NamedTuple):
    """What was measured of a whole recording, row by row in its order."""

    volts: Float[Array, " n"]
    """[V]"""
    speed: Float[Array, " n"]
    """Mean over the row [rad/s]."""
    time: Float[Array, " n"]
    """Since the recording began [s]."""
    used: Int[Array, ""] | None
    """Rows there are, where the arrays are longer."""
    duration: Scalar
    """Of a row [s]."""
    supply: Scalar
    """[V]"""
    speed_variance: Scalar
    """Of the measured speeds [rad²/s²]."""


class ShaftCompliance(AbstractMotionEffect, AbstractLoadEffect):
    """J2 w2' = k (θ - θ2) + d (w - w2): a load behind a spring, which takes the same torque from the rotor."""

    name: ClassVar[str] = "shaft_compliance"
    family: ClassVar[str] = "inertia"
    says: ClassVar[str] = (
        "a load of {inertia_ratio} of the rotor's inertia oscillates on a spring at {frequency_Hz}, damped by "
        "{damping_ratio}"
    )
    advice: ClassVar[str] = (
        "Stiffen coupling, belt or gears, or keep a controller's bandwidth well below that frequency."
    )
    frequency_Hz: Scalar = parameter("Hz", "positive", neutral=20.0, start=20.0, scale=10.0)
    """At which the load alone swings while the rotor is held [Hz]: (2π f)² = k/J2."""
    damping_ratio: Scalar = parameter("1", "positive", neutral=0.1, start=0.1, scale=0.08)
    """Of that resonance [1]: d/J2 = 2 ζ 2π f."""
    inertia_ratio: Scalar = parameter("1", "positive", neutral=0.0, start=0.3, scale=0.2)
    """J2/J; J, and so the pole, is the rotor's [1]."""

    @classmethod
    def starts(cls, rig: Rig) -> tuple[AbstractEffect, ...]:
        lowest, highest = max(3 / max(rig.duration_s, 1e-3), SLOWEST_Hz), min(0.4 / rig.period_s, FASTEST_Hz)
        number = 1 + round(math.log(max(highest / lowest, 1.0)) / math.log(SPACING))
        frequencies = np.geomspace(lowest, highest, number) if highest > lowest else []
        return tuple(cls.of(frequency_Hz=f, damping_ratio=0.08, inertia_ratio=0.35) for f in frequencies)

    def possible(self, rig: Rig) -> bool:
        """From a damping of 1/√2 there is no resonance; the least damped of steel structures have about 0.001. A load
        of a hundred rotors turns no motor that a hobby supply drives. Ends of a shaft whose speeds differ by v wind up
        by v/ω: more than five turns are no shaft."""
        rings = 1e-3 <= float(self.damping_ratio) < math.sqrt(0.5)
        wound = rig.speed_rad_s / (2 * math.pi * float(self.frequency_Hz))
        return super().possible(rig) and rings and float(self.inertia_ratio) < 100 and wound < 10 * math.pi

    def load(self) -> Load:
        return Load(self.inertia_ratio, 2 * jnp.pi * self.frequency_Hz, self.damping_ratio, None)


class Backlash(AbstractMotionEffect, AbstractLoadEffect):
    """A load that turns freely within a gap; at its edges the surfaces push like a stiff damped spring."""

    name: ClassVar[str] = "backlash"
    family: ClassVar[str] = "inertia"
    says: ClassVar[str] = "a load of {inertia_ratio} of the rotor's inertia turns freely within a gap of {gap_rad}"
    advice: ClassVar[str] = (
        "Look for play in gears, coupling or set screw; preload it, or come to positions from one side."
    )
    # A small change moves contacts from one tick to another: only a wide difference sees that.
    difference: ClassVar[float] = 0.06
    # Gears meet harder or softer than the law says: of the second world in `benchmarks/contact_errors.py`.
    roughness: ClassVar[float] = 0.06
    unlikeness: ClassVar[float] = 2.5
    unlikeness_beside: ClassVar[float] = 12.0
    explained_chi2: ClassVar[float] = 1.5
    longest_step_s: ClassVar[float] = 1.8e-3
    has_gap: ClassVar[bool] = True
    contact_frequency_Hz: ClassVar[float] = 90.0
    contact_damping_ratio: ClassVar[float] = 0.3
    gap_rad: Scalar = parameter("rad", "positive", neutral=0.0, start=0.03, scale=0.02)
    """From one edge to the other [rad]."""
    inertia_ratio: Scalar = parameter("1", "positive", neutral=0.0, start=0.3, scale=0.2)
    """J2/J; J, and so the pole, is the rotor's [1]."""

    @classmethod
    def starts(cls, rig: Rig) -> tuple[AbstractEffect, ...]:
        del rig
        sizes = [(gap, ratio) for gap in (0.015, 0.03, 0.06, 0.1) for ratio in (0.25, 0.5)]
        return tuple(cls.of(gap_rad=gap, inertia_ratio=ratio) for gap, ratio in sizes)

    def scaled(self, factor: float) -> AbstractEffect:
        return type(self)(self.gap_rad, self.inertia_ratio * factor)

    def load(self) -> Load:
        frequency = jnp.full_like(self.gap_rad, 2 * jnp.pi * self.contact_frequency_Hz)
        return Load(
            self.inertia_ratio, frequency, jnp.full_like(self.gap_rad, self.contact_damping_ratio), self.gap_rad
        )
