"""What stands between a controller and its motor: sampling, encoder, bridge."""

import dataclasses
import math

from jaxmotor._arguments import check_number, check_positive, check_whole
from jaxmotor._errors import JaxmotorError
from jaxmotor.estimate import AnyModel, ModelRig, model_of

LONGEST_PERIOD_S = 1.0
"""Longer ones are likely given in milliseconds."""
FULL_SCALE, MOST_FULL_SCALE = 250, 32767
"""Duty at full voltage, unless told, and at most."""


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
    full_scale: int = FULL_SCALE
    """The duty that means the whole supply; duties are whole numbers."""
    delay_s: float = 0.0
    """From the sample to the moment at which its duty takes effect [s]."""

    def __post_init__(self) -> None:
        for name in ("period_s", "counts_per_rev", "supply_V"):
            check_positive(name, getattr(self, name), "; state it as it is on the rig")
        if self.period_s > LONGEST_PERIOD_S:
            raise JaxmotorError(
                f"period_s = {self.period_s:g} is longer than {LONGEST_PERIOD_S:g} s; is it in seconds?"
            )
        check_whole("full_scale", self.full_scale)
        check_number("delay_s", self.delay_s)
        if not 1 <= self.full_scale <= MOST_FULL_SCALE:
            raise JaxmotorError(
                f"full_scale = {self.full_scale} is not from 1 to {MOST_FULL_SCALE}; it is the largest duty"
            )
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


def hardware_of(
    model: AnyModel,
    *,
    period_s: float | None = None,
    counts_per_rev: float | None = None,
    supply_V: float | None = None,
    full_scale: int | None = None,
    delay_s: float | None = None,
) -> Hardware:
    """The rig that `model` was identified on, as its recording stated it, with what is given here in its place.

    Without a statement the full scale of the duty is 250 and the delay 0.

    **Raises:** `JaxmotorError` where period, counts per turn or supply are neither stated nor given, or impossible.
    """
    model = model_of(model)
    rig = model.rig
    known = {
        "period_s": model.period_s if period_s is None else period_s,
        "counts_per_rev": rig.counts_per_rev if counts_per_rev is None else counts_per_rev,
        "supply_V": rig.supply_V if supply_V is None else supply_V,
    }
    stated = {name: value for name, value in known.items() if value is not None}
    if len(stated) < len(known):
        missing = ", ".join(name for name in known if name not in stated)
        raise JaxmotorError(f"{model.source}: its recording did not state {missing}; give hardware_of what is missing")
    full_scale = _full_scale(rig) if full_scale is None else full_scale
    return Hardware(**stated, full_scale=full_scale, delay_s=(rig.duty_delay_s or 0.0) if delay_s is None else delay_s)


def _full_scale(rig: ModelRig) -> int:
    """Of duties that are whole numbers, as a controller's are; a log may have others."""
    full = rig.duty_full_scale
    return int(full) if full is not None and 1 <= full <= MOST_FULL_SCALE and full == int(full) else FULL_SCALE
