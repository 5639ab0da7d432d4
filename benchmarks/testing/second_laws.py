"""Sizes of what is wrong with a motor, in physical units: the 22 effects, and laws that are none of them."""

import dataclasses
import itertools
from collections.abc import Callable

import numpy as np

from testing.second_motors import Rig
from testing.second_plant import STEP_S, Plant

Draw = Callable[[Rig, float, np.random.Generator], dict[str, float]]
"""Of a rig and the seconds that its recording lasts: fields of `Plant`."""


def _sign(rng: np.random.Generator) -> float:
    return float(rng.choice([-1.0, 1.0]))


def _log(rng: np.random.Generator, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def _friction(rig: Rig, rng: np.random.Generator) -> float:
    """Brushes and gears: about what the motor needs without load, 1 to 8 % of stall [N m]."""
    return float(np.clip(rig.no_load_N_m * _log(rng, 0.5, 2.0), 0.01 * rig.stall_N_m, 0.08 * rig.stall_N_m))


def _stiction(rig: Rig, seconds: float, rng: np.random.Generator) -> dict[str, float]:
    moving = _friction(rig, rng)
    return {
        "friction_N_m": moving,
        "static_N_m": moving * rng.uniform(1.3, 2.2),
        "stribeck_rad_s": rig.top_rad_s * rng.uniform(0.03, 0.15),
    }


def _heating(rig: Rig, seconds: float, rng: np.random.Generator) -> dict[str, float]:
    """Winding to air 6 to 40 K/W, of a motor that survives a stall of a minute: at most 300 K."""
    stall_W = rig.supply_V**2 / rig.plant.resistance_ohm
    return {"heat_K_W": min(_log(rng, 6, 40), 600 / stall_W), "heat_s": _log(rng, 10, 60)}


def _compliance(rig: Rig, seconds: float, rng: np.random.Generator) -> dict[str, float]:
    load = rig.plant.inertia_kg_m2 * _log(rng, 0.15, 1.0)
    swing = 2 * np.pi * _log(rng, 4, min(25.0, 0.2 / rig.period_s))
    damping = rng.uniform(0.02, 0.2)
    return {"load_kg_m2": load, "spring_N_m_rad": swing**2 * load, "damper_N_m_s": 2 * damping * swing * load}


def _backlash(rig: Rig, seconds: float, rng: np.random.Generator) -> dict[str, float]:
    """Gears that meet hard (100 to 200 Hz of the load alone)."""
    load = rig.plant.inertia_kg_m2 * _log(rng, 0.1, 0.8)
    swing, damping = 2 * np.pi * rng.uniform(100, 200), rng.uniform(0.2, 0.5)
    spring = {"load_kg_m2": load, "spring_N_m_rad": swing**2 * load, "damper_N_m_s": 2 * damping * swing * load}
    return spring | {"gap_rad": _log(rng, 0.01, 0.1)}


def _bristle(rig: Rig, seconds: float, rng: np.random.Generator) -> dict[str, float]:
    deflection = _log(rng, 5e-4, 8e-3)
    return _stiction(rig, seconds, rng) | {
        "bristle_rad": deflection,
        "bristle_damping_s": 0.3 * np.sqrt(deflection * rig.plant.inertia_kg_m2 / rig.no_load_N_m),
    }


VOCABULARY: dict[str, Draw] = {
    "transport_delay": lambda rig, seconds, rng: {"delay_s": STEP_S * round(_log(rng, 2e-3, 25e-3) / STEP_S)},
    "supply_drift": lambda rig, seconds, rng: {"fall_per_s": rng.uniform(0.02, 0.1) / seconds},
    "dead_zone": lambda rig, seconds, rng: {"dead_zone_V": rng.uniform(0.1, 0.8)},
    "input_threshold": lambda rig, seconds, rng: {"threshold_V": rig.supply_V * rng.uniform(0.04, 0.15)},
    "voltage_saturation": lambda rig, seconds, rng: {"clip_V": rig.supply_V * rng.uniform(0.55, 0.85)},
    "direction_asymmetry": lambda rig, seconds, rng: {"asymmetry": _sign(rng) * rng.uniform(0.01, 0.06)},
    "voltage_offset": lambda rig, seconds, rng: {"offset_V": _sign(rng) * rng.uniform(0.03, 0.25)},
    "coast_drive": lambda rig, seconds, rng: {"coast": 1.0},
    "supply_sag": lambda rig, seconds, rng: {"source_ohm": min(_log(rng, 0.2, 3.0), 0.4 * rig.plant.resistance_ohm)},
    "current_limit": lambda rig, seconds, rng: {
        "limit_A": rig.supply_V / rig.plant.resistance_ohm * rng.uniform(0.3, 0.7)
    },
    "electrical_pole": lambda rig, seconds, rng: {"inductance_H": rig.plant.resistance_ohm * _log(rng, 8e-4, 5e-3)},
    "coulomb_friction": lambda rig, seconds, rng: {"friction_N_m": _friction(rig, rng)},
    "stiction": _stiction,
    "quadratic_drag": lambda rig, seconds, rng: {
        "drag_N_m_s2": rig.stall_N_m * rng.uniform(0.03, 0.2) / rig.top_rad_s**2
    },
    "cogging": lambda rig, seconds, rng: {
        "detent_N_m": rig.stall_N_m * rng.uniform(0.01, 0.05),
        "detent_cycles": float(rng.integers(1, 11)),
        "detent_rad": rng.uniform(0, 2 * np.pi),
    },
    "load_torque": lambda rig, seconds, rng: {"load_N_m": _sign(rng) * rig.stall_N_m * rng.uniform(0.005, 0.03)},
    "winding_heating": _heating,
    "shaft_compliance": _compliance,
    "backlash": _backlash,
    "missed_counts": lambda rig, seconds, rng: {
        "lost_share": rng.uniform(0.03, 0.15),
        "lost_above_rad_s": rig.top_rad_s * rng.uniform(0.35, 0.7),
    },
    "sensor_lag": lambda rig, seconds, rng: {"filter_s": _log(rng, 2e-3, 15e-3)},
    "encoder_eccentricity": lambda rig, seconds, rng: {
        "eccentric_rad": _log(rng, 5e-3, 4e-2),
        "eccentric_cycles": float(rng.integers(1, 3)),
        "eccentric_phase_rad": rng.uniform(0, 2 * np.pi),
    },
}
"""The project's effects, by name."""

OUTSIDE: dict[str, Draw] = {
    "bristle_friction": _bristle,
    "friction_sector": lambda rig, seconds, rng: {
        "sector_N_m": _friction(rig, rng),
        "sector_rad": rng.uniform(0, 2 * np.pi),
        "sector_width_rad": rng.uniform(0.3, 1.6),
    },
    "gain_jump": lambda rig, seconds, rng: {
        "jump_s": seconds * rng.uniform(0.35, 0.7),
        "jump_gain": 1 + _sign(rng) * rng.uniform(0.04, 0.12),
    },
    "inertia_jump": lambda rig, seconds, rng: {
        "inertia_jump_s": seconds * rng.uniform(0.35, 0.7),
        "inertia_jump": rng.uniform(1.2, 1.6) ** _sign(rng),
    },
    "cubic_drive": lambda rig, seconds, rng: {"cubic_per_V2": _sign(rng) * rng.uniform(0.05, 0.15) / rig.supply_V**2},
    "cubic_drag": lambda rig, seconds, rng: {
        "cubic_drag_N_m_s3": rig.stall_N_m * rng.uniform(0.05, 0.2) / rig.top_rad_s**3
    },
    "friction_warming": lambda rig, seconds, rng: {
        "friction_N_m": _friction(rig, rng),
        "warming": rng.uniform(0.3, 0.6),
        "warming_s": rng.uniform(10, 30),
        "warming_rad_s": 0.3 * rig.top_rad_s,
    },
    "pwm_dead_time": lambda rig, seconds, rng: {
        "dead_time_V": rng.uniform(0.1, 0.5),
        "ripple_A": 0.03 * rig.supply_V / rig.plant.resistance_ohm,
    },
    "gravity_arm": lambda rig, seconds, rng: {"arm_N_m": rig.stall_N_m * rng.uniform(0.02, 0.1)},
}
"""Laws that no effect states."""

SAME = (
    {"voltage_offset", "load_torque"},
    {"coulomb_friction", "stiction"},
    {"shaft_compliance", "backlash"},
    {"electrical_pole", "sensor_lag", "transport_delay", "coast_drive"},
    {"dead_zone", "input_threshold"},
    {"current_limit", "coast_drive"},
    {"encoder_eccentricity", "missed_counts", "sensor_lag"},
)
"""Of each set no two are hidden together: one equation, nearly so, or not in this plant side by side."""


def with_laws(rig: Rig, kinds: tuple[str, ...], seconds: float, rng: np.random.Generator) -> Plant:
    """The rig's motor with `kinds` in it."""
    fields: dict[str, float] = {}
    for kind in kinds:
        fields |= (VOCABULARY | OUTSIDE)[kind](rig, seconds, rng)
    return dataclasses.replace(rig.plant, **{name: float(value) for name, value in fields.items()})


def several(number: int, rng: np.random.Generator) -> tuple[str, ...]:
    """Names of `number` different effects that may stand together."""
    while True:
        kinds = tuple(sorted(rng.choice(list(VOCABULARY), number, replace=False).tolist()))
        if not any(set(pair) <= same for pair in itertools.combinations(kinds, 2) for same in SAME):
            return kinds


def physical(plant: Plant) -> str:
    """What differs from a linear motor, for people."""
    neutral = {field.name: field.default for field in dataclasses.fields(Plant)}
    own = {name: value for name, value in dataclasses.asdict(plant).items() if neutral[name] is not dataclasses.MISSING}
    return ", ".join(f"{name} {value:.4g}" for name, value in own.items() if value != neutral[name])
