"""A position loop for a wanted bandwidth or overshoot, designed in discrete time.

    u[k] = kp (r[k] - θ[k]) - kv v[k]

with the counted angle θ and the count difference v. With G(z) from u to v, and θ = T z/(z - 1) v, a pole is where

    1 + (kp T z/(z - 1) + kv) G(z) = 0.

A pair of poles z = exp((-ζ ± j sqrt(1 - ζ²)) ωn T) is two real equations, linear in kp and kv; ζ follows from the
overshoot, ln²s/(π² + ln²s) = ζ², and ωn from the bandwidth. The delays' own poles are then checked, not neglected.
Below the ωn at which kv vanishes (a motor damps itself), kp alone is lowered.
"""

import dataclasses
import math

import numpy as np

from jaxmotor.control._closed import Closed, highest_of, largest
from jaxmotor.control._hardware import Hardware
from jaxmotor.control._sampled import Sampled, sampled_motor
from jaxmotor.control._specifications import (
    OVERSHOOT_PERCENT,
    RIPPLE,
    TINY,
    check_specifications,
    for_bandwidth,
    left_out,
)
from jaxmotor.motor import Motor

LEAST_OVERSHOOT = 1e-3
"""A smaller share is designed for this one: ζ = 0.91."""


@dataclasses.dataclass(frozen=True)
class PositionDesign:
    """Gains of a position loop and what the linear motor does with them."""

    gain_V_rad: float
    """kp [V/rad]."""
    speed_gain_V_s_rad: float
    """kv [V s/rad]."""
    bandwidth_Hz: float
    """-3 dB from reference to angle."""
    overshoot_percent: float
    """Of a small step, which does not saturate."""
    ripple_V: float
    """Standard deviation of the voltage that the encoder's rounding alone makes, about [V]."""
    friction_error_rad: float
    """How far from the reference friction and dead zone may hold the shaft, without compensation [rad]."""
    poles: tuple[complex, ...]
    """Of the closed loop, in the z-plane."""
    notes: tuple[str, ...]
    """Sentences that a user should read."""


def design_position_loop(
    motor: Motor, hardware: Hardware, *, bandwidth_Hz: float | None = None, overshoot_percent: float = OVERSHOOT_PERCENT
) -> PositionDesign:
    """Gains for `bandwidth_Hz`; without it the fastest loop that keeps its overshoot and is quiet with this encoder.

    **Raises:** `JaxmotorError` where the motor and its delays do not allow that bandwidth within that overshoot.
    """
    check_specifications(bandwidth_Hz, overshoot_percent, hardware)
    plant, period = sampled_motor(motor, hardware), hardware.period_s
    damping = _damping(overshoot_percent / 100)

    def placed(natural: float) -> tuple[float, float]:
        return place(plant, complex(-damping, math.sqrt(1 - damping**2)) * natural, period)

    slowest, highest = 1e-4 / period, 1 / period
    undamped = highest_of(lambda natural: placed(natural)[1] * plant.gain < 0, slowest, highest)

    def gains(natural: float) -> tuple[float, float]:
        if natural > undamped:
            return placed(natural)
        return placed(undamped)[0] * natural / undamped, 0.0

    def closed(natural: float) -> Closed:
        return position_loop(plant, *gains(natural), period)

    def possible(natural: float) -> bool:
        loop = closed(natural)
        # The placed pair is the slowest; what other poles add to the overshoot is no more than half as much.
        slowest_pole = math.exp(-damping * natural * period) if natural > undamped else 1.0
        return (
            loop.radius < min(1.0, slowest_pole * (1 + 1e-9))
            and loop.overshoot <= 1.5 * overshoot_percent / 100 + 10 * TINY
        )

    def bandwidth(natural: float) -> float:
        return closed(natural).bandwidth_Hz(period)

    fastest = highest_of(possible, slowest, highest)
    natural, notes = fastest, left_out(motor)
    quiet = RIPPLE * hardware.supply_V
    if bandwidth_Hz is not None:
        natural = for_bandwidth(bandwidth, bandwidth_Hz, slowest, fastest, overshoot_percent, hardware)
    elif _ripple(gains(fastest), hardware) > quiet:
        natural = largest(lambda one: _ripple(gains(one), hardware) <= quiet, slowest, fastest)
        notes.append("the bandwidth is limited by the encoder, whose rounding would shake the voltage too much")
    return _design(plant, gains(natural), motor, hardware, tuple(notes))


def _design(
    plant: Sampled, gains: tuple[float, float], motor: Motor, hardware: Hardware, notes: tuple[str, ...]
) -> PositionDesign:
    loop = position_loop(plant, *gains, hardware.period_s)
    held = sum(float(getattr(effect, effect.holds_by)) for effect in motor.effects if effect.holds_by)
    return PositionDesign(
        gain_V_rad=gains[0],
        speed_gain_V_s_rad=gains[1],
        bandwidth_Hz=loop.bandwidth_Hz(hardware.period_s),
        overshoot_percent=100 * loop.overshoot,
        ripple_V=_ripple(gains, hardware),
        friction_error_rad=held / abs(gains[0]),
        poles=tuple(complex(pole) for pole in loop.poles),
        notes=notes,
    )


def place(plant: Sampled, s: complex, period_s: float) -> tuple[float, float]:
    """(kp, kv) that give the loop poles at z = exp(`s` T) and its conjugate."""
    z = np.exp(s * period_s)
    needed, turn = -1 / plant.at(complex(z)), period_s * z / (z - 1)
    kp = needed.imag / turn.imag
    return float(kp), float(needed.real - kp * turn.real)


def position_loop(plant: Sampled, kp: float, kv: float, period_s: float) -> Closed:
    """The closed loop of `plant` and its angle θ[k] = θ[k-1] + T v[k]."""
    # The state is (s, θ of the tick before), and θ = θ' + T C s.
    size = len(plant.drive)
    seen = np.append(period_s * plant.output, 1.0)
    feedback = kp * seen + kv * np.append(plant.output, 0.0)
    a = np.block([[plant.transition, np.zeros((size, 1))], [period_s * plant.output, np.ones((1, 1))]])
    b = np.append(plant.drive, 0.0)
    return Closed(a - np.outer(b, feedback), kp * b, seen)


def _ripple(gains: tuple[float, float], hardware: Hardware) -> float:
    angle = hardware.count_rad / math.sqrt(12)
    return math.hypot(gains[0] * angle, gains[1] * hardware.speed_noise_rad_s)


def _damping(overshoot: float) -> float:
    log = math.log(max(overshoot, LEAST_OVERSHOOT))
    return -log / math.hypot(math.pi, log)
