"""The speed controller that a header describes, and whether it is the one that ran.

At tick k, with y[k] the mean speed over the tick before (the count difference), R the reference, T the period:

    e[k] = R - y[k]
    u[k] = gain e[k] + A[k] + now Ki T e[k]
    applied = the nearest duty to u[k], within the supply
    A[k+1] = A[k] + Ki T e[k], unless u[k] is beyond the supply on the side to which e[k] pushes

`now` is 1 where the integral includes the error of the same tick, and 0 where an error enters one tick later; rigs do
either, so the one that agrees better with the log is taken.
"""

import dataclasses
import math
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxmotor.prediction import bucket
from jaxmotor.recording import Recording, Segment

OFF_TOGETHER = 3
GAIN_KEYS = ("gain", "gain_V_s_rad")


class Law(NamedTuple):
    """The controller's numbers."""

    reference: Float[Array, ""]
    """[rad/s]"""
    gain: Float[Array, ""]
    """[V s/rad]"""
    integral_step: Float[Array, ""]
    """Ki T [V s/rad]."""
    now: Float[Array, ""]
    """The integral includes the error of the same tick: 1 or 0."""
    limit: Float[Array, ""]
    """Supply [V]; infinite where it is not known."""
    step: Float[Array, ""]
    """One duty [V]; 0 where the command is not quantised."""


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

    def law(self, period_s: float, now: float) -> Law:
        """For a period of `period_s` [s]."""
        step = self.integral_gain_V_rad * period_s
        values = (self.reference_rad_s, self.gain_V_s_rad, step, now, self.limit_V, self.step_V)
        return Law(*(jnp.asarray(value) for value in values))


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


def command(law: Law, integral: Float[Array, ""], speed: Float[Array, ""]) -> tuple[Float[Array, ""], Float[Array, ""]]:
    """The voltage for a measured `speed` [rad/s], and the integral [V] after it."""
    error = law.reference - speed
    wanted = law.gain * error + integral + law.now * law.integral_step * error
    applied = jnp.clip(wanted, -law.limit, law.limit)
    duty = jnp.where(law.step > 0, law.step, 1.0)
    applied = jnp.where(law.step > 0, duty * jnp.rint(applied / duty), applied)
    winding_up = (jnp.abs(wanted) > law.limit) & (wanted * law.integral_step * error > 0)
    return applied, integral + jnp.where(winding_up, 0.0, law.integral_step * error)


@eqx.filter_jit
def replay(law: Law, speed: Float[Array, " n"]) -> Float[Array, " n"]:
    """Voltages [V] that the controller makes of the speeds it saw."""

    def tick(integral, speed):
        volts, integral = command(law, integral, speed)
        return integral, volts

    return jax.lax.scan(tick, jnp.zeros_like(law.gain), speed)[1]


def on_ticks(recording: Recording, segment: Segment, before: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(n,) speed [rad/s] as the controller saw it at every tick, (n,) voltage, (n,) the speed was really seen.

    The speed of lost ticks is the mean over the gap, which leaves a controller's integral right; their voltage is
    NaN. `before` [rad/s] is the speed before the first tick, which counts do not show.
    """
    assert segment.tick is not None and recording.period_s is not None
    ticks = segment.tick - segment.tick[0]
    grid = np.arange(ticks[-1] + 1)
    volts = np.full(len(grid), np.nan)
    volts[ticks] = segment.volts
    seen = np.isin(grid - 1, ticks) & np.isin(grid, ticks)
    if segment.speed_rad_s is not None:
        seen = np.isin(grid, ticks)
        return np.interp(grid, ticks, segment.speed_rad_s), volts, seen
    angle = segment.angle_rad
    if segment.count is not None:
        assert recording.counts_per_rev is not None
        angle = (segment.count - segment.count[0]) * (2 * np.pi / recording.counts_per_rev)
    assert angle is not None
    speed = np.diff(np.interp(grid, ticks, angle)) / recording.period_s
    seen[0] = segment.at_rest
    return np.concatenate([[before], speed]), volts, seen


def compare_with_log(
    controller: Controller, recording: Recording, speed: np.ndarray, volts: np.ndarray, seen: np.ndarray
) -> tuple[float, float]:
    """Share of ticks [%] whose voltage is more than one duty off the law's, and which `now` that is for.

    Where volts were logged, a hundredth of the largest takes the place of one duty.
    """
    assert recording.period_s is not None
    judged = seen & np.isfinite(volts)
    shares = []
    for now in (1.0, 0.0):
        off = _off(controller.law(recording.period_s, now), controller, speed, volts)[judged]
        shares.append((100 * float(off.mean()) if len(off) else 0.0, now))
    return min(shares, key=lambda share: share[0])


def agreeing_ticks(
    controller: Controller, recording: Recording, speed: np.ndarray, volts: np.ndarray, now: float
) -> int:
    """The first ticks of a run, in which the header's law with this `now` is the one that ran.

    Until three ticks together are off: the header has one reference, but a rig may have gone on to another.
    """
    assert recording.period_s is not None
    off = _off(controller.law(recording.period_s, now), controller, speed, volts)
    together = np.convolve(off, np.ones(OFF_TOGETHER), "valid") == OFF_TOGETHER
    return int(np.argmax(together)) if together.any() else len(speed)


def _off(law: Law, controller: Controller, speed: np.ndarray, volts: np.ndarray) -> np.ndarray:
    """(n,) the law makes another voltage of the speeds than the one that was applied; never where that is lost."""
    tolerance = controller.step_V or 0.01 * float(np.nanmax(np.abs(volts)))
    padded = np.concatenate([speed, np.zeros(bucket(len(speed)) - len(speed))])
    made = np.asarray(replay(law, jnp.asarray(padded)))[: len(speed)]
    return np.nan_to_num(np.abs(made - volts), nan=0.0) > tolerance * (1 + 1e-6)
