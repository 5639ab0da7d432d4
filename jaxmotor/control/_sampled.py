"""The motor as a controller meets it: exact in discrete time, with the hold, the count difference and every delay.

At tick k the count is latched, then u[k] is set. With the state s = (x, u[k-1], ..., u[k-1-m], v) of the motor's own x,
the voltages still on their way (a delay of m whole ticks and a part of one) and v, the mean speed over the last tick,
which is what the count difference shows,

    s[k+1] = A s[k] + B u[k]        v[k] = C s[k].

Nothing is approximated: the old voltage acts for the part of the tick that the delay says, the new one for the rest.
"""

import math
from typing import NamedTuple

import numpy as np

from jaxmotor._errors import JaxmotorError
from jaxmotor._precision import in_float64, to_jax, to_numpy
from jaxmotor.control._hardware import Hardware
from jaxmotor.motor import AbstractLinearMotor, Hold, Motor, SecondOrder, hold_switched, linear_motor
from jaxmotor.motor.effects import AbstractEffect

LINEAR = {"electrical_pole", "transport_delay", "sensor_lag"}
"""Effects that a linear design takes along."""
LONGEST_DELAY = 32
"""[ticks]"""


class Sampled(NamedTuple):
    """s[k+1] = A s[k] + B u[k], v[k] = C s[k]; u in volts, v in rad/s."""

    transition: np.ndarray
    """A (n, n)."""
    drive: np.ndarray
    """B (n,)."""
    output: np.ndarray
    """C (n,)."""

    def at(self, z: complex) -> complex:
        """C (z - A)⁻¹ B, from u[k] to v[k] [rad/s/V]."""
        return complex(self.output @ np.linalg.solve(z * np.eye(len(self.drive)) - self.transition, self.drive))

    @property
    def gain(self) -> float:
        """At frequency zero [rad/s/V]."""
        return self.at(1.0 + 0j).real


def linear_numbers(motor: Motor) -> tuple[float, float, float]:
    """Gain [rad/s/V], pole [rad/s] and L/R [s], 0 where there is none, with what `electrical_pole` adds to it."""
    lag = parameter_of(motor, "electrical_pole", "time_constant_s")
    own = float(motor.linear.electrical_time_constant) if isinstance(motor.linear, SecondOrder) else 0.0
    return float(motor.linear.gain), float(motor.linear.pole), own + lag


def linear_of(motor: Motor) -> AbstractLinearMotor:
    """The linear motor of these numbers."""
    gain, pole, lag = linear_numbers(motor)
    return linear_motor([gain, pole, lag] if lag > 0 else [gain, pole])


def transfer_function(motor: Motor) -> tuple[list[float], list[float]]:
    """Numerator and denominator of its G(s) [rad/s/V], the highest power first."""
    gain, pole, lag = linear_numbers(motor)
    return [gain * pole], [*([lag] if lag else []), 1.0, pole]


def delay_of(motor: Motor, hardware: Hardware) -> float:
    """All that is late [s]: the duty, the effect `transport_delay`, and `sensor_lag` counted as a delay."""
    late = parameter_of(motor, "transport_delay", "delay_s") + parameter_of(motor, "sensor_lag", "time_constant_s")
    return hardware.delay_s + late


def late_holds(motor: Motor, hardware: Hardware) -> tuple[int, Hold, Hold]:
    """Whole ticks that voltages are late, and what the old and the new one do to the linear part in a tick."""
    ticks = delay_of(motor, hardware) / hardware.period_s
    whole = math.floor(ticks + 1e-9)
    part, period = max(ticks - whole, 0.0) * hardware.period_s, hardware.period_s
    return whole, *to_numpy(hold_switched(*to_jax((linear_of(motor), part, period))))


@in_float64
def sampled_motor(motor: Motor, hardware: Hardware) -> Sampled:
    """The linear part of `motor` with its delays, sampled as `hardware` does.

    **Raises:** `JaxmotorError` where the delay is longer than 32 ticks.
    """
    whole, old, new = late_holds(motor, hardware)
    if whole > LONGEST_DELAY:
        ticks = delay_of(motor, hardware) / hardware.period_s
        raise JaxmotorError(f"the motor's delay is {ticks:.3g} ticks; a loop needs at most {LONGEST_DELAY}")
    order = len(new.drive)
    # s = (x, u[k-1], ..., u[k-1-whole], v)
    size = order + whole + 2
    a, b = np.zeros((size, size)), np.zeros(size)
    a[:order, :order], a[-1, :order] = new.transition, new.turn / hardware.period_s
    for hold, late in ((old, whole + 1), (new, whole)):
        column = np.concatenate([hold.drive, np.zeros(whole + 1), [hold.turn_drive / hardware.period_s]])
        if late == 0:
            b += column
        else:
            a[:, order + late - 1] += column
    b[order] = 1.0
    for late in range(1, whole + 1):
        a[order + late, order + late - 1] = 1.0
    output = np.zeros(size)
    output[-1] = 1.0
    return Sampled(a, b, output)


def effect_of(motor: Motor, name: str) -> AbstractEffect | None:
    """The effect of that `name`, None where the motor has none."""
    return next((effect for effect in motor.effects if effect.name == name), None)


def parameter_of(motor: Motor, name: str, key: str) -> float:
    """The parameter `key` of the effect `name`; 0 where the motor has none."""
    effect = effect_of(motor, name)
    return 0.0 if effect is None else float(getattr(effect, key))
