"""What a log gets wrong, not the motor: never named as an effect, but fitted as one."""

from typing import ClassVar

from jaxmotor.motor.effects._base import (
    AbstractDelayEffect,
    AbstractEffect,
    AbstractSensorEffect,
    Rig,
    Scalar,
    parameter,
)
from jaxmotor.motor.effects._sensor import SensorLag


class TimingOffset(AbstractSensorEffect, AbstractDelayEffect):
    """y(t + d): each row was read some time after its voltage changed, or before; by less than a row."""

    name: ClassVar[str] = "timing_offset"
    # A log shows the sum of the two.
    excludes: ClassVar[tuple[str, ...]] = ("transport_delay",)
    says: ClassVar[str] = "rows are read {offset_s} after their voltage changes"
    advice: ClassVar[str] = "State it in the header (duty_delay_s), or read the encoder where the duty is set."
    early: ClassVar[bool] = True
    offset_s: Scalar = parameter("s", "signed", neutral=0.0, start=1e-4, scale=1e-3)
    """d, negative where rows are read before [s]."""

    @classmethod
    def starts(cls, rig: Rig) -> tuple[AbstractEffect, ...]:
        return (cls.of(offset_s=0.05 * rig.period_s),)

    def delay(self) -> Scalar:
        """Readings that are late see the voltages early."""
        return -self.offset_s


class LogFilter(SensorLag):
    """τ y' = θ - y, as `SensorLag`, where the header of the log does not state how its speeds were made."""

    name: ClassVar[str] = "log_filter"
    # A log's may be as short as it is.
    ordinary: ClassVar[float] = 0.0


class SpeedWindow(AbstractSensorEffect):
    """Each speed is the mean over a window before its row, where the header of the log does not state how long it is.

    What a sensor would show is as without it; the log's readings are made of that (`prediction.predicted_readings`).
    """

    name: ClassVar[str] = "speed_window"
    # One over the other is a mean that looks nearly the same.
    excludes: ClassVar[tuple[str, ...]] = ("log_filter",)
    says: ClassVar[str] = "the speeds are means over {length_s}"
    advice: ClassVar[str] = "State it in the header (speed_window_s)."
    length_s: Scalar = parameter("s", "positive", neutral=0.0, start=0.02, scale=0.02)
    """W [s]."""

    @classmethod
    def starts(cls, rig: Rig) -> "tuple[SpeedWindow, ...]":
        return tuple(cls.of(length_s=rows * rig.period_s) for rows in (1.5, 5.0, 12.0, 40.0, 120.0))


OF_LOG = (TimingOffset, LogFilter, SpeedWindow)
