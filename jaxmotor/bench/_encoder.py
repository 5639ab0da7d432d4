"""What an encoder can tell of the speed, before anything is measured (the paper's eq. 1-3 and Table 1).

The speed is a count difference over a window of m ticks of T each, with N counts per turn of the output shaft:

    w = 2π n/(N m T)          n counts in the window                                           (eq. 1)
    δw = 2π/(N m T) rad/s = 60/(N m T) rpm          one count more or less                     (eq. 2)
    δw/w                                            the relative error at speed w              (eq. 3)

δw is the step between speeds that can be told apart, and the largest error. The usual error is smaller: a position
read as floor(θ N/2π + c) has a uniform error of variance 1/12 count², so a difference of two has variance 1/6, and the
speed a standard deviation of δw/√6. All of them go as 1/m: a longer window costs delay (m T/2), not accuracy.
"""

import math
from collections.abc import Iterable
from typing import NamedTuple

from jaxmotor._errors import JaxmotorError

Number = float | int


class SpeedResolution(NamedTuple):
    """How finely one encoder shows the speed over one window: a row of the paper's Table 1."""

    period_s: float
    """T, of one tick [s]."""
    ticks: int
    """m, of the window [1]."""
    resolution_rad_s: float
    """δw [rad/s]."""

    @property
    def resolution_rpm(self) -> float:
        """δw [rpm]."""
        return self.resolution_rad_s * 30 / math.pi

    @property
    def standard_deviation_rad_s(self) -> float:
        """Of one speed, δw/√6 [rad/s]."""
        return self.resolution_rad_s / math.sqrt(6)

    @property
    def delay_s(self) -> float:
        """By which the mean over the window lags the speed at its end, m T/2 [s]."""
        return self.ticks * self.period_s / 2

    def relative_error(self, speed_rad_s: Number) -> float:
        """δw/|w| at `speed_rad_s` [1].

        **Raises:** `JaxmotorError` at speed zero, where it has no value.
        """
        speed = abs(speed_rad_s)
        if not (math.isfinite(speed) and speed > 0 and math.isfinite(self.resolution_rad_s / speed)):
            raise JaxmotorError(
                f"speed {speed_rad_s:g} rad/s: a relative error needs a speed that is finite and not zero"
            )
        return self.resolution_rad_s / speed


def speed_resolution(counts_per_rev: Number, period_s: Number, ticks: int = 1) -> SpeedResolution:
    """Eq. 2 for `counts_per_rev` counts (all edges) per turn, ticks of `period_s` [s] and a window of `ticks` of them.

    **Raises:** `JaxmotorError` where a number is not positive and finite.
    """
    counts = _positive("counts per turn", counts_per_rev)
    window = _positive("window", ticks) * _positive("period", period_s)
    if not 1e-300 < counts * window < 1e300:
        raise JaxmotorError(
            f"{counts_per_rev:g} counts per turn and a period of {period_s:g} s are beyond what can be meant; "
            "state the period in seconds"
        )
    return SpeedResolution(float(period_s), int(ticks), 2 * math.pi / (counts * window))


def resolution_table(
    counts_per_rev: Number, periods_s: Iterable[Number], ticks: int = 1
) -> tuple[SpeedResolution, ...]:
    """The paper's Table 1: one row for each of `periods_s` [s], in the order given.

    **Raises:** `JaxmotorError` where a number is not positive and finite.
    """
    return tuple(speed_resolution(counts_per_rev, period, ticks) for period in periods_s)


def _positive(name: str, value: Number) -> float:
    if not (math.isfinite(value) and value > 0):
        raise JaxmotorError(f"{name}: {value:g} is not a positive, finite number")
    return float(value)
