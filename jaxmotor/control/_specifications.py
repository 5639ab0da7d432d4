"""What is asked of a loop, and whether a motor on a rig allows it: the same for speed and position."""

from collections.abc import Callable

from jaxmotor._arguments import check_number
from jaxmotor._errors import JaxmotorError
from jaxmotor.control._closed import largest
from jaxmotor.control._feed_forward import COMPENSATED
from jaxmotor.control._hardware import Hardware
from jaxmotor.control._sampled import LINEAR
from jaxmotor.motor import Motor

RIPPLE = 0.05
"""Share of the supply by which the encoder's rounding may shake the voltage (standard deviation), by default."""
OVERSHOOT_PERCENT = 5.0
"""That a loop may have, unless told."""
TINY = 1e-3
"""Overshoot [share] that counts as none."""


def check_specifications(bandwidth_Hz: float | None, overshoot_percent: float, hardware: Hardware) -> None:
    """**Raises:** `JaxmotorError` for a bandwidth or an overshoot that no loop has."""
    for name, value in (("the bandwidth", bandwidth_Hz), ("the overshoot", overshoot_percent)):
        if value is not None or name == "the overshoot":
            check_number(name, value)
    if bandwidth_Hz is not None and not 0 < bandwidth_Hz < 0.5 / hardware.period_s:
        raise JaxmotorError(
            f"a bandwidth of {bandwidth_Hz:g} Hz is not between 0 and half the sampling rate of "
            f"{1 / hardware.period_s:g} Hz; ask for a lower one"
        )
    if not 0 <= overshoot_percent <= 60:
        raise JaxmotorError(f"an overshoot of {overshoot_percent:g} % is not from 0 to 60; 5 is usual")


def left_out(motor: Motor) -> list[str]:
    """What a linear design does not see of `motor`."""
    names = [effect.name for effect in motor.effects if effect.name not in LINEAR | COMPENSATED]
    notes = [f"the gains are designed without {', '.join(names)}; the predicted response has it"] if names else []
    if any(effect.name == "sensor_lag" for effect in motor.effects):
        notes.append("sensor_lag is taken as a delay of its time constant in the design of the gains")
    return notes


def for_bandwidth(
    bandwidth: Callable[[float], float],
    wanted: float,
    slowest: float,
    fastest: float,
    allowed_percent: float,
    hardware: Hardware,
) -> float:
    """The number from `slowest` to `fastest`, which makes a loop the faster the larger it is, for `wanted` [Hz].

    `bandwidth` of a number is the loop's [Hz]; `fastest` is where it overshoots by `allowed_percent`.

    **Raises:** `JaxmotorError` where `wanted` is faster than that.
    """
    most = bandwidth(fastest)
    if most < wanted:
        raise JaxmotorError(
            f"a bandwidth of {wanted:g} Hz would overshoot by more than {allowed_percent:g} % with this motor and a "
            f"period of {1e3 * hardware.period_s:g} ms; at most {most:.3g} Hz are possible: ask for less, allow more "
            "overshoot, or sample faster"
        )
    return largest(lambda number: bandwidth(number) <= wanted, slowest, fastest)
