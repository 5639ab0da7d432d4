"""Sizes as hobby motors have them, one voltage plan, and programs that all tests share."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from jaxmotor.motor import FirstOrder, SecondOrder
from jaxmotor.motor._motor import Motor, Rows, simulate_motor
from jaxmotor.motor.effects import EFFECTS

PERIOD, SUPPLY, FULL_SCALE, STEPS = 0.005, 7.4, 250, 5
GAIN, POLE, LAG, VISCOUS_SHARE = 10.6, 40.0, 524e-6 / 4.5, 0.045
COUNT = 2 * np.pi / 617
START_ANGLE = 1.0

SIZES: dict[str, dict[str, float]] = {
    "transport_delay": {"delay_s": 0.0043},
    "dead_zone": {"volts_V": 0.35},
    "input_threshold": {"volts_V": 0.35},
    "voltage_offset": {"volts_V": 0.15},
    "voltage_saturation": {"volts_V": 6.2},
    "direction_asymmetry": {"ratio": 0.05},
    "supply_sag": {"ratio": 0.25},
    "supply_drift": {"rate_per_s": 0.02},
    "coast_drive": {},
    "current_limit": {"volts_V": 3.5},
    "electrical_pole": {"time_constant_s": 0.004},
    "coulomb_friction": {"volts_V": 0.4},
    "stiction": {"volts_V": 0.3, "static_volts_V": 0.55, "stribeck_speed_rad_s": 2.0},
    "quadratic_drag": {"volts_V_s2_rad2": 2e-4},
    "cogging": {"volts_V": 0.3, "cycles_per_rev": 6.0, "phase_rad": 0.7},
    "load_torque": {"volts_V": 0.3},
    "winding_heating": {"rise_ratio": 2.0, "time_constant_s": 5.0},
    "shaft_compliance": {"frequency_Hz": 18.0, "damping_ratio": 0.08, "inertia_ratio": 0.4},
    "backlash": {"gap_rad": 0.04, "inertia_ratio": 0.4},
    "encoder_eccentricity": {"amplitude_rad": 0.03, "cycles_per_rev": 1.0, "phase_rad": 0.4},
    "missed_counts": {"ratio": 0.06, "speed_rad_s": 40.0},
    "sensor_lag": {"time_constant_s": 0.006},
    "cubic_drive": {"cubic_1_V2": 2e-3},
    "dead_time": {"volts_V": 0.3},
    "cubic_drag": {"volts_V": 0.3},
    "sector_friction": {"volts_V": 0.5, "centre_rad": 2.0, "width_rad": 1.2},
    "warming_friction": {"volts_V": 0.3, "rise_ratio": 0.8, "time_constant_s": 4.0},
    "bristle_friction": {"volts_V": 0.4, "deflection_rad": 0.02},
}
LAGLESS = {"electrical_pole", "coast_drive"}


def number(value) -> jax.Array:
    return jnp.asarray(value, jnp.float64)


def linear(first_order: bool) -> FirstOrder | SecondOrder:
    return FirstOrder(*map(number, (GAIN, POLE))) if first_order else SecondOrder(*map(number, (GAIN, POLE, LAG)))


def motor(*names: str, first_order: bool = False, **sizes: float) -> Motor:
    """A motor with effects of hobby size; `electrical_pole` and `coast_drive` bring the lag they need."""
    effects = tuple(EFFECTS[name].of(**SIZES[name] | sizes) for name in names)
    return Motor(linear(first_order or bool(LAGLESS & set(names))), effects, number(VISCOUS_SHARE))


def plan() -> np.ndarray:
    """Duties: a small and a large sine, steps both ways, a slow ramp, a random staircase."""
    time = np.arange(200) * PERIOD
    rng = np.random.default_rng(0)
    parts = (
        np.zeros(10),
        60 * np.sin(2 * np.pi * 2.03 * time),
        200 * np.sin(2 * np.pi * 5.03 * time),
        np.repeat([0, 150, -150, 60, -30, 250], 25),
        np.linspace(-80, 80, 120),
        np.repeat(rng.integers(-250, 251, 24), 5),
    )
    return np.concatenate(parts).astype(np.int32)


def volts(duty) -> np.ndarray:
    return np.asarray(duty) * (SUPPLY / FULL_SCALE)


def rows(volts, angle=None) -> Rows:
    """From rest, in one piece."""
    size = len(volts)
    reset = np.zeros(size, bool)
    reset[0] = True
    angle = None if angle is None else number(angle)
    return Rows(number(volts), jnp.asarray(reset), number(np.zeros(size)), number(np.arange(size) * PERIOD), angle)


def angle_of(volts) -> np.ndarray:
    """About where the shaft is [rad]: angle-locked laws need some angle."""
    speed = np.zeros(len(volts))
    for k in range(1, len(speed)):
        speed[k] = speed[k - 1] + 0.18 * (GAIN * volts[k - 1] - speed[k - 1])
    return START_ANGLE + np.cumsum(speed) * PERIOD


def turned(motor: Motor, rows: Rows) -> jax.Array:
    """What the encoder shows of each tick [rad]."""
    return simulate_motor(motor, rows, number(PERIOD), number(SUPPLY), jnp.asarray(STEPS)).sensed_turn


def values(motor: Motor) -> jax.Array:
    return jnp.stack(jax.tree.leaves(motor))


def with_values(motor: Motor, values: jax.Array) -> Motor:
    return jax.tree.unflatten(jax.tree.structure(motor), list(values))


fast_turned = eqx.filter_jit(turned)
jacobian = eqx.filter_jit(lambda motor, rows: jax.jacfwd(lambda x: turned(with_values(motor, x), rows))(values(motor)))
