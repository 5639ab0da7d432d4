"""When the rows of a log were read, where its header does not say."""

import dataclasses

MOST_ROWS = 0.53
"""Largest timing offset, with what its estimate may be wrong: a reading that is further off belongs to another row, or
the voltage acts late."""


@dataclasses.dataclass(frozen=True)
class Timing:
    """A property of the log, not of the motor: by how much each row was read after its voltage changed."""

    offset_s: float
    """Negative where rows are read before [s]."""
    standard_error_s: float
    """1.96 of them each way hold the truth 95 times of 100 [s]."""

    @property
    def shows(self) -> bool:
        """It is more than its error."""
        return abs(self.offset_s) > 1.96 * self.standard_error_s

    @property
    def sentence(self) -> str:
        """For people."""
        if not self.shows:
            half = 1.96 * self.standard_error_s
            early, late = (f"{1e3 * (half + sign * self.offset_s):.2g} ms" for sign in (-1, 1))
            return (
                f"rows are read between {early} before and {late} after the voltage changes, this log shows no more: "
                "a property of it, which its header does not state (duty_delay_s)"
            )
        when = "after" if self.offset_s > 0 else "before"
        read = (
            f"{1e3 * abs(self.offset_s):.4g} ± {1e3 * 1.96 * self.standard_error_s:.2g} ms {when} the voltage changes"
        )
        alike = "" if self.offset_s > 0 else "; a voltage that acts as much later looks the same"
        return f"rows are read {read}: a property of the log, which its header does not state (duty_delay_s){alike}"
