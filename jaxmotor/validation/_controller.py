"""The speed controller that a header describes, and whether it is the one that ran (`SpeedLaw`).

Its error is the reference minus the mean speed over the tick before, the count difference. Rigs include the error of
the same tick in the integral, or not; so the law that agrees better with the log is taken.
"""

import dataclasses
import math
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxmotor.motor import SpeedLaw, command
from jaxmotor.prediction import bucket
from jaxmotor.recording import Recording, Segment, angle_of

OFF_TOGETHER = 3
"""Ticks in a row from which the controller is said to be off."""
GAIN_KEYS = ("gain", "gain_V_s_rad")


class Logged(NamedTuple):
    """The motor's own run, at every tick."""

    speed: np.ndarray
    """(n,) as the controller saw it [rad/s]; over a gap the mean."""
    volts: np.ndarray
    """(n,) [V], NaN where the tick was lost."""
    seen: np.ndarray
    """(n,) `speed` was measured at this tick."""


@dataclasses.dataclass(frozen=True)
class Controller:
    """What the header says of a closed loop."""

    reference_rad_s: float
    gain_V_s_rad: float
    integral_gain_V_rad: float
    limit_V: float
    """Infinite where the supply is not known."""
    step_V: float
    """One duty [V]; 0 where volts were logged."""

    @property
    def kind(self) -> str:
        """`P` or `PI`."""
        return "PI" if self.integral_gain_V_rad else "P"

    def law(self, now: float) -> SpeedLaw:
        """With the error of the same tick in the integral where `now` is 1; the integral itself has no limit."""
        return SpeedLaw.of(self.gain_V_s_rad, self.integral_gain_V_rad, self.limit_V, self.step_V, math.inf, now)


def controller_of(recording: Recording, index: int) -> Controller | str:
    """The controller of a `closed_loop` segment, or the reason why it cannot be simulated."""
    segment = recording.segments[index]
    if recording.period_s is None:
        return "its rows have time stamps instead of ticks, so the controller's period is not known"
    assert segment.tick is not None
    if len(segment) < 4:
        return f"it has {len(segment)} rows only"
    if segment.tick[-1] - segment.tick[0] + 1 > 2 * len(segment):
        return "more than half of its ticks are lost"
    reference = _number(segment.parameters.get("reference_rad_s"))
    if reference is None:
        return "its header has no number reference_rad_s [rad/s]"
    gain = next((g for key in GAIN_KEYS if (g := _number(segment.parameters.get(key))) is not None), None)
    if gain is None:
        return "its header has no number gain [V s/rad]"
    integral = 0.0
    if "integral_gain" in segment.parameters:
        integral = _number(segment.parameters["integral_gain"])
        if integral is None:
            return "integral_gain in its header is not a number [V/rad]"
    if gain == 0 and integral == 0:
        return "its header gives a controller whose gains are zero"
    supply, full = recording.supply_V, recording.duty_full_scale
    step = supply / full if segment.duty is not None and supply is not None and full is not None else 0.0
    return Controller(reference, gain, integral, math.inf if supply is None else supply, step)


def _number(value: Any) -> float | None:
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        return None
    return float(value)


@eqx.filter_jit
def replay(law: SpeedLaw, error: Float[Array, " n"], period: Float[Array, ""]) -> Float[Array, " n"]:
    """Voltages [V] that the controller makes of the errors it saw."""

    def tick(integral: Float[Array, ""], error: Float[Array, ""]) -> tuple[Float[Array, ""], Float[Array, ""]]:
        volts, integral = command(law, error, integral, period)
        return integral, volts

    return jax.lax.scan(tick, jnp.zeros_like(law.gain), error)[1]


def on_ticks(recording: Recording, segment: Segment, before: float) -> Logged:
    """What `segment` shows at every tick, also at lost ones; a mean over a gap leaves a controller's integral right.

    `before` [rad/s] is the speed before the first tick, which counts do not show.
    """
    assert segment.tick is not None and recording.period_s is not None
    ticks = segment.tick - segment.tick[0]
    grid = np.arange(ticks[-1] + 1)
    volts = np.full(len(grid), np.nan)
    volts[ticks] = segment.volts
    read = ticks[segment.read]
    seen = np.isin(grid - 1, read) & np.isin(grid, read)
    if segment.speed_rad_s is not None:
        seen = np.isin(grid, read)
        return Logged(np.interp(grid, ticks, segment.speed_rad_s), volts, seen)
    speed = np.diff(np.interp(grid, ticks, angle_of(recording, segment))) / recording.period_s
    seen[0] = segment.at_rest
    return Logged(np.concatenate([[before], speed]), volts, seen)


def compare_with_log(controller: Controller, period_s: float, logged: Logged) -> tuple[float, float]:
    """Share of ticks [%] whose voltage is more than one duty off the law's, and which `now` that is for.

    Where volts were logged, a hundredth of the largest takes the place of one duty.
    """
    compared = logged.seen & np.isfinite(logged.volts)
    shares = []
    for now in (1.0, 0.0):
        off = _off(controller, period_s, logged, now)[compared]
        shares.append((100 * float(off.mean()) if len(off) else 0.0, now))
    return min(shares, key=lambda share: share[0])


def agreeing_ticks(controller: Controller, period_s: float, logged: Logged, now: float) -> int:
    """The first ticks of a run, in which the header's law with this `now` is the one that ran.

    Until three ticks together are off: the header has one reference, but a rig may have gone on to another.
    """
    off = _off(controller, period_s, logged, now)
    together = np.convolve(off, np.ones(OFF_TOGETHER), "valid") == OFF_TOGETHER
    return int(np.argmax(together)) if together.any() else len(off)


def _off(controller: Controller, period_s: float, logged: Logged, now: float) -> np.ndarray:
    """(n,) the law makes another voltage of the speeds than the one that was applied; never where that is lost."""
    number = len(logged.speed)
    tolerance = controller.step_V or 0.01 * float(np.nanmax(np.abs(logged.volts)))
    error = controller.reference_rad_s - np.concatenate([logged.speed, np.zeros(bucket(number) - number)])
    made = np.asarray(replay(controller.law(now), jnp.asarray(error), jnp.asarray(period_s)))[:number]
    return np.nan_to_num(np.abs(made - logged.volts), nan=0.0) > tolerance * (1 + 1e-6)
