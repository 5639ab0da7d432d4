"""The scores of the linear and of the extended motor on the same data."""

import dataclasses

from jaxmotor.estimate import Trace, angle_fit_percent
from jaxmotor.validation import Interval, Score


@dataclasses.dataclass(frozen=True)
class Intervals:
    """Scores, and where 95 % of them would be if other segments of their kind had been drawn."""

    chi2_per_sample: Interval
    rmse_rad_s: Interval
    fit_percent: Interval


@dataclasses.dataclass(frozen=True, eq=False)
class BeforeAfter:
    """The linear and the extended motor on the same data."""

    segments: tuple[int, ...]
    in_part: tuple[int, ...]
    """Those of which only a part was scored."""
    before: Score
    after: Score
    before_intervals: Intervals
    after_intervals: Intervals
    drift_before: float
    """chi2 per sample of residuals that add up over twenty ticks."""
    drift_after: float
    traces_before: tuple[Trace, ...]
    traces_after: tuple[Trace, ...]

    @property
    def angle_fit_percent_before(self) -> float:
        """As the fit of the speed, of the angle turned since each segment began: to compare with logs of angles."""
        return angle_fit_percent(self.traces_before)

    @property
    def angle_fit_percent_after(self) -> float:
        return angle_fit_percent(self.traces_after)
