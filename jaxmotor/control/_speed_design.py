"""P and PI speed loops for a wanted bandwidth or overshoot, designed in discrete time.

With the mean speed v[k] over the last tick, which the count difference shows, and e = r - v,

    P     u[k] = k e[k]                          leaves r/(1 + k K)  (the paper's eq. 21); with r/K fed forward, nothing
    PI    u[k] = k e[k] + I[k],   I[k+1] = I[k] + Ki T e[k]

The zero of the PI controller, 1 - Ki T/k, is put on the motor's slower pole exp(-a T). Then one number is left, k, and
for a first-order motor without delay the loop's poles are the zeros of z (z - 1) + k K ((1 - g) z + g - p): the delay
of hold and count difference is in it, so there is a fastest loop for each overshoot. The pole that was
cancelled is left in the response to a load.
"""

import dataclasses
import math
from collections.abc import Callable

import numpy as np

from jaxmotor._errors import JaxmotorError
from jaxmotor.control._closed import Closed, largest
from jaxmotor.control._hardware import Hardware
from jaxmotor.control._sampled import Sampled, linear_numbers, sampled_motor
from jaxmotor.control._specifications import (
    OVERSHOOT_PERCENT,
    RIPPLE,
    TINY,
    check_specifications,
    for_bandwidth,
    left_out,
)
from jaxmotor.motor import Motor

SMALLEST = 1e-4
"""Loop gain k K [1]."""


@dataclasses.dataclass(frozen=True)
class SpeedDesign:
    """Gains of a speed loop and what the linear motor does with them."""

    kind: str
    """`P` or `PI`."""
    gain_V_s_rad: float
    """k [V s/rad]."""
    integral_gain_V_rad: float
    """Ki [V/rad]."""
    feeds_forward: bool
    """r/K is added to the voltage."""
    bandwidth_Hz: float
    """-3 dB from reference to speed."""
    overshoot_percent: float
    """Of a small step, which does not saturate."""
    gain_margin: float
    """Factor on k at which the loop begins to oscillate."""
    ripple_V: float
    """Standard deviation of the voltage that the encoder's rounding alone makes at a steady speed, about [V]."""
    poles: tuple[complex, ...]
    """Of the closed loop, in the z-plane."""
    notes: tuple[str, ...]
    """Sentences that a user should read."""


def design_speed_loop(
    motor: Motor,
    hardware: Hardware,
    *,
    kind: str = "PI",
    bandwidth_Hz: float | None = None,
    overshoot_percent: float = OVERSHOOT_PERCENT,
    feeds_forward: bool | None = None,
) -> SpeedDesign:
    """Gains for `bandwidth_Hz`; without it the fastest loop that overshoots by at most `overshoot_percent`.

    The fastest is also limited to what the encoder allows: its rounding must not shake the voltage by more than 5 % of
    the supply. `feeds_forward` adds r/K to the voltage: by default where there is no integral.

    **Raises:** `JaxmotorError` where the motor and its delays do not allow that bandwidth within that overshoot.
    """
    if kind not in ("P", "PI"):
        raise JaxmotorError(f"a loop of kind {kind!r} is not known; it is P or PI")
    check_specifications(bandwidth_Hz, overshoot_percent, hardware)
    ahead = kind == "P" if feeds_forward is None else feeds_forward
    plant = sampled_motor(motor, hardware)
    zero = math.exp(-slow_pole(motor) * hardware.period_s) if kind == "PI" else None

    def closed(loop_gain: float) -> Closed:
        return speed_loop(plant, loop_gain / plant.gain, zero, ahead)

    def calm(loop_gain: float) -> bool:
        loop = closed(loop_gain)
        return loop.radius < 1 and loop.overshoot <= overshoot_percent / 100 + TINY

    limit = largest(lambda loop_gain: closed(loop_gain).radius < 1, SMALLEST, 1e6)
    fastest = largest(calm, SMALLEST, limit / 2)
    gain, notes = fastest, [*left_out(motor)]
    ripple = abs(hardware.speed_noise_rad_s / plant.gain)
    if bandwidth_Hz is not None:
        gain = _for_bandwidth(closed, bandwidth_Hz, fastest, overshoot_percent, hardware)
    elif gain * ripple > RIPPLE * hardware.supply_V:
        gain = RIPPLE * hardware.supply_V / ripple
        notes.append(
            "the gain is limited by the encoder: a higher one would shake the voltage with its rounding "
            f"by more than {100 * RIPPLE:g} % of the supply"
        )
    if gain * ripple > 2 * RIPPLE * hardware.supply_V:
        notes.append(
            f"the encoder's rounding shakes the voltage by {gain * ripple:.2g} V; a lower bandwidth, or a speed "
            "from the estimator, is quieter"
        )
    loop = closed(gain)
    kp = gain / plant.gain
    return SpeedDesign(
        kind=kind,
        gain_V_s_rad=kp,
        integral_gain_V_rad=0.0 if zero is None else kp * (1 - zero) / hardware.period_s,
        feeds_forward=ahead,
        bandwidth_Hz=loop.bandwidth_Hz(hardware.period_s),
        overshoot_percent=100 * loop.overshoot,
        gain_margin=limit / gain,
        ripple_V=gain * ripple,
        poles=tuple(complex(pole) for pole in loop.poles),
        notes=tuple(notes),
    )


def speed_loop(plant: Sampled, gain: float, zero: float | None, feeds_forward: bool) -> Closed:
    """The closed loop of `plant`: P, or PI with its `zero` in the z-plane."""
    ahead = 1 / plant.gain if feeds_forward else 0.0
    a = plant.transition - gain * np.outer(plant.drive, plant.output)
    b = (gain + ahead) * plant.drive
    if zero is None:
        return Closed(a, b, plant.output)
    step = gain * (1 - zero)
    a = np.block([[a, plant.drive[:, None]], [-step * plant.output, np.ones((1, 1))]])
    return Closed(a, np.append(b, step), np.append(plant.output, 0.0))


def slow_pole(motor: Motor) -> float:
    """The slowest pole of the motor [rad/s]; of a swinging pair, its real part."""
    _, pole, lag = linear_numbers(motor)
    if lag == 0:
        return pole
    root = 1 - 4 * pole * lag
    # (1 - sqrt(root))/(2 lag), without the difference of nearly equal numbers
    return 2 * pole / (1 + math.sqrt(root)) if root > 0 else 0.5 / lag


def _for_bandwidth(
    closed: Callable[[float], Closed], wanted: float, fastest: float, allowed_percent: float, hardware: Hardware
) -> float:
    def bandwidth(loop_gain: float) -> float:
        return closed(loop_gain).bandwidth_Hz(hardware.period_s)

    gain = for_bandwidth(bandwidth, wanted, SMALLEST, fastest, allowed_percent, hardware)
    least = bandwidth(SMALLEST)
    if wanted < least:
        raise JaxmotorError(
            f"the motor alone has a bandwidth of {least:.3g} Hz; a loop does not lower it to {wanted:g} Hz"
        )
    return gain
