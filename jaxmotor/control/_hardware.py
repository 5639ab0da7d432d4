"""What stands between a controller and its motor: sampling, encoder, bridge."""

import dataclasses
import math

from jaxmotor._errors import JaxmotorError

LONGEST_PERIOD_S = 1.0


@dataclasses.dataclass(frozen=True)
class Hardware:
    """A rig that samples a count, then sets a duty, once in each period.

    **Raises:** `JaxmotorError` where a number is impossible.
    """

    period_s: float
    """From one sample to the next [s]."""
    counts_per_rev: float
    """Encoder counts, all edges, per turn of the output shaft [1]."""
    supply_V: float
    """Of the bridge [V]."""
    full_scale: int = 250
    """The duty that means the whole supply; duties are whole numbers."""
    delay_s: float = 0.0
    """From the sample to the moment at which its duty takes effect [s]."""

    def __post_init__(self) -> None:
        for name in ("period_s", "counts_per_rev", "supply_V"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0):
                raise JaxmotorError(f"{name} = {value:g} is not positive; state it as it is on the rig")
        if self.period_s > LONGEST_PERIOD_S:
            raise JaxmotorError(
                f"period_s = {self.period_s:g} is longer than {LONGEST_PERIOD_S:g} s; is it in seconds?"
            )
        if not 1 <= self.full_scale <= 32767:
            raise JaxmotorError(f"full_scale = {self.full_scale} is not from 1 to 32767; it is the largest duty")
        if not 0 <= self.delay_s < self.period_s:
            raise JaxmotorError(f"delay_s = {self.delay_s:g} is not from 0 to the period of {self.period_s:g} s")

    @property
    def count_rad(self) -> float:
        """One count [rad]."""
        return 2 * math.pi / self.counts_per_rev

    @property
    def step_V(self) -> float:
        """One duty [V]."""
        return self.supply_V / self.full_scale

    @property
    def counts_per_tick(self) -> float:
        """Count difference in a period at 1 rad/s."""
        return self.period_s / self.count_rad

    @property
    def speed_noise_rad_s(self) -> float:
        """Standard deviation of the speed that a count difference shows: sqrt(1/6) count per period [rad/s]."""
        return math.sqrt(1 / 6) / self.counts_per_tick
