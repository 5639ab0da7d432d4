"""An effect as somebody else would write it."""

from typing import ClassVar

from jaxmotor.motor.effects import AbstractEffect, AbstractMotionEffect, AbstractTorqueEffect, Rig, Scalar, parameter


class SteepDrag(AbstractMotionEffect, AbstractTorqueEffect):
    """v (w/50)⁵: a drag that grows with the fifth power of the speed."""

    name: ClassVar[str] = "steep_drag"
    says: ClassVar[str] = "drag that grows with the fifth power of the speed takes {volts_V} at 50 rad/s"
    advice: ClassVar[str] = "Feed it forward, and expect less gain at high speed."
    volts_V: Scalar = parameter("V", "positive", neutral=0.0, start=0.5, scale=0.3)
    """v, at 50 rad/s [V]."""

    @classmethod
    def starts(cls, rig: Rig) -> tuple[AbstractEffect, ...]:
        return (cls.of(volts_V=0.1 * rig.supply_V * (50 / max(rig.speed_rad_s, 1.0)) ** 5),)

    def resists(self, speed: Scalar, angle: Scalar) -> Scalar:
        del angle
        return self.volts_V * (speed / 50) ** 5
