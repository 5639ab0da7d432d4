"""Laws learned from data: a torque, a voltage or an error of the reading as a series over one coordinate, for what no
known law explains.

They are fitted, simulated, validated and kept like any other effect. What a linear motor or an offset does as well,
they leave to these: over speed and voltage a straight line has no part in them, over speed nor a constant; without a
command the voltage is zero.
"""

import abc
import functools
import math
from typing import Any, ClassVar, Literal

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from jaxmotor.motor.effects._base import (
    AbstractAngleSensorEffect,
    AbstractDriveEffect,
    AbstractEffect,
    AbstractMotionEffect,
    AbstractSensorEffect,
    AbstractSourceEffect,
    AbstractTorqueEffect,
    Rig,
    Scalar,
    Source,
    parameter,
    parameters,
)
from jaxmotor.motor.effects._rare import RARITY
from jaxmotor.motor.effects._sensor import MOST_MISREAD
from jaxmotor.motor.effects._sine import sine

LearnedCoordinate = Literal["speed", "voltage", "angle", "time"]
LearnedUnit = Literal["V", "rad"]
TERMS = 24
"""Of a curve."""
WARP = 10.0
"""How many times closer a curve is resolved about zero than far from it, about."""
GRID = 2001
"""Places by which the straight line is taken out."""
SPREAD_V = 0.3
"""Of the first coefficient, by its prior; of later ones it falls as those of a jump do. A few per cent of a small
supply: next to nothing against rows that show the curve, and what holds it level between places that no row visits."""
SPREAD_rad = 0.1
"""Of the first wave of a reading's error, by its prior; a wave of n per turn has an n-th of it, by which speeds are
misread as much."""
NO_PLACE = 1.0
"""Of the bends of a curve that has none: at the end of its reach."""
NARROWEST = 1e-6
"""Part of the reach beyond a bend, at least."""


def _coefficient(term: int, absent: float | None = None) -> Any:
    spread = SPREAD_V / term
    return parameter("V", "term", neutral=0.0, start=0.0, scale=0.1 / term, spread=spread, absent=absent)


def _place() -> Any:
    return parameter("1", "range", neutral=NO_PLACE, start=NO_PLACE, scale=0.1, absent=NO_PLACE)


def _reach_V() -> Any:
    return parameter("V", "range", neutral=1.0, start=1.0, scale=1.0)


def _wave(cycles: int) -> Any:
    return parameter("rad", "term", neutral=0.0, start=0.0, scale=0.02 / cycles, spread=SPREAD_rad / cycles)


class AbstractLearnedEffect(AbstractEffect):
    """A series over one coordinate."""

    coordinate: ClassVar[LearnedCoordinate]
    """Over which it is a series."""
    unit: ClassVar[LearnedUnit] = "V"
    """Of what it adds, and of its coefficients."""
    sought_last: ClassVar[bool] = True
    advice: ClassVar[str] = "Look for a cause of that shape; until it is known, feed the curve forward."

    @property
    def coefficients(self) -> tuple[Scalar, ...]:
        """In its unit."""
        about = parameters(self)
        return tuple(getattr(self, name) for name in about if about[name]["kind"] == "term")

    @property
    def numbers(self) -> dict[str, float]:
        """`coefficients` as plain numbers, also of a motor whose parameters are numpy's."""
        about = parameters(self)
        return {name: float(getattr(self, name)) for name in about if about[name]["kind"] == "term"}

    def like(self, law: AbstractEffect) -> "AbstractLearnedEffect":
        """It as `law`, which it contains, where a term of its own is that; else as it is."""
        del law
        return self

    @abc.abstractmethod
    def adds(self, at: Scalar) -> Scalar:
        """What it adds, in its unit, at places [rad/s, V, rad, s] of its coordinate: to the commanded voltage, or to
        the angle that is read."""


class AbstractLearnedVoltage(AbstractLearnedEffect):
    """A series of `TERMS` terms, in volts."""

    c1_V: Scalar = _coefficient(1)
    c2_V: Scalar = _coefficient(2)
    c3_V: Scalar = _coefficient(3)
    c4_V: Scalar = _coefficient(4)
    c5_V: Scalar = _coefficient(5)
    c6_V: Scalar = _coefficient(6)
    c7_V: Scalar = _coefficient(7)
    c8_V: Scalar = _coefficient(8)
    c9_V: Scalar = _coefficient(9)
    c10_V: Scalar = _coefficient(10)
    c11_V: Scalar = _coefficient(11)
    c12_V: Scalar = _coefficient(12)
    c13_V: Scalar = _coefficient(13)
    c14_V: Scalar = _coefficient(14)
    c15_V: Scalar = _coefficient(15)
    c16_V: Scalar = _coefficient(16)
    c17_V: Scalar = _coefficient(17)
    c18_V: Scalar = _coefficient(18)
    c19_V: Scalar = _coefficient(19)
    c20_V: Scalar = _coefficient(20)
    c21_V: Scalar = _coefficient(21)
    c22_V: Scalar = _coefficient(22)
    c23_V: Scalar = _coefficient(23)
    c24_V: Scalar = _coefficient(24)

    @property
    def series(self) -> tuple[Scalar, ...]:
        """Its coefficients from the first to the last term [V]."""
        return tuple(getattr(self, f"c{term}_V") for term in range(1, TERMS + 1))

    def possible(self, rig: Rig) -> bool:
        """No effect takes more volts than there are."""
        numbers = self.numbers
        return all(abs(numbers[f"c{term}_V"]) < rig.supply_V for term in range(1, TERMS + 1))


class AbstractBentEffect(AbstractLearnedEffect):
    """Its slope changes at once at two places, ± a share of its reach, of which no derivative tells where they are."""

    bend_terms: ClassVar[tuple[str, ...]]
    """Its parameters that are how much it bends there."""
    bend_share: eqx.AbstractVar[Scalar]
    """The share [1]; `NO_PLACE` before one is known."""


class AbstractBentCurve(AbstractLearnedVoltage, AbstractBentEffect):
    """A series whose slope may change at once at two places x = ±p, as no series of some terms has it:

    Σ c_k (T_k(z) - a_k - m_k x) + b (sgn(x) h - (1 - p)(1 + p/2) x) + e (h - a), h = max(|x| - p, 0)/(1 - p),

    at x from -1 to 1, parts of its reach; beyond it goes on as it is there. T_k are Chebyshev's polynomials of
    z = asinh(10 x)/asinh(10), m_k the slope of T_k from -1 to 1; the factor of b is the slope of what it multiplies.
    """

    bend_terms: ClassVar[tuple[str, ...]] = ("bend_V", "even_bend_V")
    bend_V: Scalar = _coefficient(1, absent=0.0)
    """b, of one sign to either side [V]."""
    even_bend_V: Scalar = _coefficient(1, absent=0.0)
    """e, the same to either side [V]."""
    bend_share: Scalar = _place()
    """p [1]."""

    @property
    def bends(self) -> tuple[Scalar, Scalar, Scalar]:
        """b, e [V] and p [1]."""
        return self.bend_V, self.even_bend_V, self.bend_share

    def possible(self, rig: Rig) -> bool:
        bends = abs(float(self.bend_V)), abs(float(self.even_bend_V))
        return super().possible(rig) and max(bends) < rig.supply_V


class TorqueOverSpeed(AbstractMotionEffect, AbstractTorqueEffect, AbstractBentCurve):
    """A torque that depends on the speed, of any shape (`AbstractBentCurve`): a_k and a are means from -w1 to w1."""

    name: ClassVar[str] = "torque_over_speed"
    over: ClassVar[str] = "speed"
    contains: ClassVar[tuple[str, ...]] = ("quadratic_drag", "cubic_drag")
    says: ClassVar[str] = "a torque depends on the speed by a curve that was learned"
    coordinate: ClassVar[LearnedCoordinate] = "speed"
    reach_rad_s: Scalar = parameter("rad/s", "range", neutral=1.0, start=1.0, scale=1.0)
    """w1 [rad/s]."""

    @classmethod
    def starts(cls, rig: Rig) -> tuple[AbstractEffect, ...]:
        return (cls.start(reach_rad_s=rig.speed_rad_s),) if rig.speed_rad_s > 0 else ()

    def resists(self, speed: Scalar, angle: Scalar) -> Scalar:
        del angle
        place, mean = speed / self.reach_rad_s, 0.5 * (1 - self.bend_share)
        return _level_series(self.series, place, _means()) + _bent(self.bends, place, mean)

    def adds(self, at: Scalar) -> Scalar:
        return -self.resists(at, at)


class TorqueOverAngle(AbstractMotionEffect, AbstractTorqueEffect, AbstractLearnedVoltage):
    """c_0 + Σ (c_(2n-1) cos nθ + c_(2n) sin nθ), n = 1 to 12: a torque that depends on the shaft's angle, of any
    shape."""

    name: ClassVar[str] = "torque_over_angle"
    contains: ClassVar[tuple[str, ...]] = ("cogging",)
    says: ClassVar[str] = "a torque depends on the shaft's angle by a curve that was learned"

    coordinate: ClassVar[LearnedCoordinate] = "angle"
    c0_V: Scalar = _coefficient(1)

    @classmethod
    def starts(cls, rig: Rig) -> tuple[AbstractEffect, ...]:
        return (cls.start(),) if rig.turns else ()

    def like(self, law: AbstractEffect) -> "AbstractLearnedEffect":
        return _as_wave(self, law, tuple(f"c{term}_V" for term in range(1, TERMS + 1)))

    def resists(self, speed: Scalar, angle: Scalar) -> Scalar:
        del speed
        return _turned(self.series, angle, self.c0_V)

    def adds(self, at: Scalar) -> Scalar:
        return -self.resists(at, at)


class AbstractDriveCurve(AbstractDriveEffect, AbstractSourceEffect, AbstractLearnedEffect):
    """A voltage that is added to the commanded one, by which it is: none where there is no command."""

    over: ClassVar[str] = "voltage"
    coordinate: ClassVar[LearnedCoordinate] = "voltage"
    reach_V: eqx.AbstractVar[Scalar]
    """u1 [V]."""

    @classmethod
    def starts(cls, rig: Rig) -> tuple[AbstractEffect, ...]:
        # Voltages enough to tell how they act.
        enough = rig.supply_known and len(rig.volts_V) > 3
        return (cls.start(reach_V=max(rig.volts_V)),) if enough else ()

    def source(self, source: Source, time: Scalar) -> Source:
        del time
        return source.told(source.mean + self.adds(source.mean))


class VoltageOverCommand(AbstractDriveCurve, AbstractBentCurve):
    """u and a curve beside it: a drive that is not in proportion, of any shape (`AbstractBentCurve`): a_k are T_k(0),
    and a is none, since without a command there is no voltage."""

    name: ClassVar[str] = "voltage_over_command"
    contains: ClassVar[tuple[str, ...]] = (
        "dead_zone",
        "voltage_saturation",
        "direction_asymmetry",
        "cubic_drive",
    )
    says: ClassVar[str] = "the voltage depends on the one commanded by a curve that was learned"
    reach_V: Scalar = _reach_V()

    def adds(self, at: Scalar) -> Scalar:
        place = at / self.reach_V
        return _level_series(self.series, place, AT_ZERO) + _bent(self.bends, place, jnp.zeros_like(place))


class VoltageBend(AbstractDriveCurve, AbstractBentEffect):
    """u + b (sgn(x) h - m x)/q, h = max(|x| - p, 0)/(1 - p), m = (1 - p)(1 + p/2), q = max(m p, 1 - m),

    at x = u/u1 from -1 to 1: a drive that is in proportion below a voltage and above it, but not by one factor. In q is
    the most that b multiplies, and in m its slope. What takes one number tells more than a curve of many, where it is
    all that there is.
    """

    name: ClassVar[str] = "voltage_bend"
    contains: ClassVar[tuple[str, ...]] = ("dead_zone", "voltage_saturation")
    excludes: ClassVar[tuple[str, ...]] = ("voltage_over_command",)
    # Its place is a parameter, too.
    rarity: ClassVar[float] = RARITY + 1
    says: ClassVar[str] = "above some voltage the drive gives more or less of each further volt than below"
    bend_terms: ClassVar[tuple[str, ...]] = ("bend_V",)
    bend_V: Scalar = _coefficient(1)
    """b, the most that it adds [V]."""
    bend_share: Scalar = _place()
    """p [1]."""
    reach_V: Scalar = _reach_V()

    def possible(self, rig: Rig) -> bool:
        """No effect takes more volts than there are; without a place it is none."""
        return abs(float(self.bend_V)) < rig.supply_V and float(self.bend_share) < NO_PLACE

    def adds(self, at: Scalar) -> Scalar:
        share = self.bend_share
        slope = (1 - share) * (1 + 0.5 * share)
        most = jnp.maximum(jnp.maximum(slope * share, 1 - slope), NARROWEST)
        return _bent((self.bend_V / most, jnp.zeros_like(share), share), at / self.reach_V, jnp.zeros_like(at))


class ReadingOverAngle(AbstractSensorEffect, AbstractAngleSensorEffect, AbstractLearnedEffect):
    """y = θ + Σ (a_n cos nθ + b_n sin nθ), n = 1 to 8: an error of the reading that depends on the shaft's angle, of
    any shape."""

    name: ClassVar[str] = "reading_over_angle"
    contains: ClassVar[tuple[str, ...]] = ("encoder_eccentricity",)
    says: ClassVar[str] = "the angle is misread by a curve over the shaft's angle that was learned"
    advice: ClassVar[str] = "Look at how the sensor is mounted; until it is, correct the reading by the curve."
    coordinate: ClassVar[LearnedCoordinate] = "angle"
    unit: ClassVar[LearnedUnit] = "rad"
    cos1_rad: Scalar = _wave(1)
    sin1_rad: Scalar = _wave(1)
    cos2_rad: Scalar = _wave(2)
    sin2_rad: Scalar = _wave(2)
    cos3_rad: Scalar = _wave(3)
    sin3_rad: Scalar = _wave(3)
    cos4_rad: Scalar = _wave(4)
    sin4_rad: Scalar = _wave(4)
    cos5_rad: Scalar = _wave(5)
    sin5_rad: Scalar = _wave(5)
    cos6_rad: Scalar = _wave(6)
    sin6_rad: Scalar = _wave(6)
    cos7_rad: Scalar = _wave(7)
    sin7_rad: Scalar = _wave(7)
    cos8_rad: Scalar = _wave(8)
    sin8_rad: Scalar = _wave(8)

    @classmethod
    def starts(cls, rig: Rig) -> tuple[AbstractEffect, ...]:
        return (cls.start(),) if rig.turns else ()

    def possible(self, rig: Rig) -> bool:
        """As an encoder off its centre, it misreads speeds by a quarter at most."""
        each = list(self.numbers.values())
        misread = [n * math.hypot(*wave) for n, wave in enumerate(zip(each[::2], each[1::2], strict=True), start=1)]
        return super().possible(rig) and max(misread) < MOST_MISREAD

    def like(self, law: AbstractEffect) -> "AbstractLearnedEffect":
        return _as_wave(self, law, tuple(self.numbers))

    def error(self, angle: Scalar) -> Scalar:
        return _turned(self.coefficients, angle, jnp.zeros_like(angle))

    def adds(self, at: Scalar) -> Scalar:
        return self.error(at)


def penalty(effect: AbstractLearnedEffect) -> float:
    """Half the sum of squares of its coefficients over their priors' spreads [1]: of a curve as large as they are, half
    the number of its terms."""
    about = parameters(effect)
    terms = [name for name in about if about[name]["kind"] == "term"]
    return 0.5 * sum((float(getattr(effect, name)) / about[name]["spread"]) ** 2 for name in terms)


LEARNED = {
    effect.name: effect
    for effect in (TorqueOverSpeed, TorqueOverAngle, VoltageOverCommand, VoltageBend, ReadingOverAngle)
}


AT_ZERO = tuple(float(round(math.cos(0.5 * math.pi * term))) for term in range(1, TERMS + 1))
"""T_k(0)"""


def _as_wave(curve: AbstractLearnedEffect, law: AbstractEffect, waves: tuple[str, ...]) -> AbstractLearnedEffect:
    """`curve`, whose terms over the angle are `waves` (cos θ, sin θ, cos 2θ, ...), as `law`, A sin(nθ + φ), if that is
    one of them."""
    sizes = [name for name, about in parameters(law).items() if about["kind"] == "amplitude"]
    cycles = round(float(getattr(law, "cycles_per_rev", 0.0)))
    if len(sizes) != 1 or not 0 < 2 * cycles <= len(waves):
        return curve
    size, phase_rad = float(getattr(law, sizes[0])), float(getattr(law, "phase_rad", 0.0))
    along, across = waves[2 * cycles - 2 : 2 * cycles]
    return curve.but(**{along: size * math.sin(phase_rad), across: size * math.cos(phase_rad)})


def _turned(waves: tuple[Scalar, ...], angle: Scalar, total: Scalar) -> Scalar:
    """`total` and Σ (a_n cos nθ + b_n sin nθ) at θ = `angle`, a_n and b_n in turn in `waves`."""
    along, across = sine(angle + 0.5 * jnp.pi), sine(angle)
    cos_n, sin_n = jnp.ones_like(angle), jnp.zeros_like(angle)
    for a, b in zip(waves[::2], waves[1::2], strict=True):
        cos_n, sin_n = cos_n * along - sin_n * across, sin_n * along + cos_n * across
        total = total + a * cos_n + b * sin_n
    return total


def _level_series(coefficients: tuple[Scalar, ...], place: Scalar, levels: tuple[float, ...]) -> Scalar:
    """Σ c_k (T_k(z) - a_k - m_k x) at x = `place` within -1 and 1, a_k being `levels`."""
    place = jnp.clip(place, -1.0, 1.0)
    # JAX's own, which is as exact about zero as for large numbers, takes three times as long.
    z = jnp.log(WARP * place + jnp.sqrt(1 + jnp.square(WARP * place))) / math.asinh(WARP)
    before, now = jnp.ones_like(z), z
    total, level, slope = jnp.zeros_like(z), jnp.zeros_like(z), jnp.zeros_like(z)
    for c, a, m in zip(coefficients, levels, _slopes(), strict=True):
        total, level, slope = total + c * now, level + c * a, slope + c * m
        before, now = now, 2 * z * now - before
    return total - level - slope * place


def _bent(bends: tuple[Scalar, Scalar, Scalar], place: Scalar, level: Scalar) -> Scalar:
    """b (sgn(x) h - (1 - p)(1 + p/2) x) + e (h - a) at x = `place` within -1 and 1, a being `level`."""
    odd, even, share = bends
    place = jnp.clip(place, -1.0, 1.0)
    above = jnp.maximum(jnp.abs(place) - share, 0.0) / jnp.maximum(1 - share, NARROWEST)
    return odd * (jnp.sign(place) * above - (1 - share) * (1 + 0.5 * share) * place) + even * (above - level)


@functools.cache
def _means() -> tuple[float, ...]:
    """Of T_1 to T_`TERMS` from -1 to 1."""
    return tuple(float(term.mean()) for term in _polynomials()[1])


@functools.cache
def _slopes() -> tuple[float, ...]:
    """m_k of T_1 to T_`TERMS`: of the straight line through the origin that is nearest to each from -1 to 1."""
    place, terms = _polynomials()
    return tuple(float(term @ place / (place @ place)) for term in terms)


def _polynomials() -> tuple[np.ndarray, np.ndarray]:
    """Places (n,) from -1 to 1, and T_1 to T_`TERMS` there (k, n)."""
    place = np.linspace(-1, 1, GRID)
    angle = np.arccos(np.clip(np.arcsinh(WARP * place) / math.asinh(WARP), -1, 1))
    return place, np.cos(np.arange(1, TERMS + 1)[:, None] * angle)
