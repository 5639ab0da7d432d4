"""A DC motor and its encoder integrated in small Euler steps, in plain Python: slow, simple, independent of the fits.

The paper's eq. 5-8 with held bridge voltage V:  L i' = V - R i - K w,  J w' = K i - b w,  θ' = w.
"""

import dataclasses
import math

import numpy as np


@dataclasses.dataclass
class Plant:
    """A motor at rest, seen from its output shaft. Defaults: a Pololu 51.45:1 with 10.6 rad/s/V and 40 rad/s."""

    resistance_ohm: float = 4.5
    inductance_H: float = 524e-6
    torque_constant_V_s: float = 0.0901
    """K of eq. 7 and 8 [V s/rad = N m/A]."""
    friction_N_m_s: float = 8.48e-5
    """Viscous, b of eq. 7."""
    inertia_kg_m2: float = 4.72e-5
    counts_per_rev: float = 617.4
    encoder_offset: float = 0.0
    """Where between two counts the shaft stands at the start [counts]."""
    step_s: float = 1e-5
    current_A: float = 0.0
    speed_rad_s: float = 0.0
    angle_rad: float = 0.0

    @property
    def gain(self) -> float:
        """Steady speed per volt, K/(R b + K²) [rad/s/V]."""
        constant = self.torque_constant_V_s
        return constant / (self.resistance_ohm * self.friction_N_m_s + constant**2)

    @property
    def pole(self) -> float:
        """(R b + K²)/(R J), eq. 11 [rad/s]."""
        damping = self.resistance_ohm * self.friction_N_m_s + self.torque_constant_V_s**2
        return damping / (self.resistance_ohm * self.inertia_kg_m2)

    @property
    def count(self) -> int:
        """What the encoder shows."""
        return math.floor(self.angle_rad * self.counts_per_rev / (2 * math.pi) + self.encoder_offset)

    def hold(self, volts: float, duration_s: float) -> None:
        """Hold `volts` [V] for `duration_s` [s], a whole number of steps."""
        current, speed, angle, step = self.current_A, self.speed_rad_s, self.angle_rad, self.step_s
        resistance, inductance, constant = self.resistance_ohm, self.inductance_H, self.torque_constant_V_s
        friction, inertia = self.friction_N_m_s, self.inertia_kg_m2
        for _ in range(round(duration_s / step)):
            slope = (volts - resistance * current - constant * speed) / inductance
            acceleration = (constant * current - friction * speed) / inertia
            angle += step * speed
            current += step * slope
            speed += step * acceleration
        self.current_A, self.speed_rad_s, self.angle_rad = current, speed, angle

    def stop(self) -> None:
        """Come to rest where the shaft stands."""
        self.current_A = self.speed_rad_s = 0.0


def drive(plant: Plant, duty: np.ndarray, volts_per_duty: float, period_s: float) -> np.ndarray:
    """(n,) counts at each tick: first the count is latched, then the duty is applied until the next tick."""
    counts = np.empty(len(duty), np.int64)
    for k, value in enumerate(duty):
        counts[k] = plant.count
        plant.hold(float(value) * volts_per_duty, period_s)
    return counts


def close_loop(
    plant: Plant, ticks: int, period_s: float, reference_rad_s: float, gain_V_s: float, supply_V: float, full_scale: int
) -> tuple[np.ndarray, np.ndarray]:
    """(n,) duty and (n,) count of a proportional speed loop on the difference to the previous count."""
    counts, duty = np.empty(ticks, np.int64), np.empty(ticks, np.int64)
    before = plant.count
    for k in range(ticks):
        counts[k] = plant.count
        speed = (counts[k] - before) * 2 * math.pi / (plant.counts_per_rev * period_s)
        before = int(counts[k])
        volts = min(max(gain_V_s * (reference_rad_s - speed), -supply_V), supply_V)
        duty[k] = round(volts / supply_V * full_scale)
        plant.hold(float(duty[k]) * supply_V / full_scale, period_s)
    return duty, counts
