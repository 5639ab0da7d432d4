"""Each effect against the emulated bench's plant, which is integrated at 10 us."""

import jax.numpy as jnp
import numpy as np
import pytest
from effect_cases import (
    COUNT,
    FULL_SCALE,
    LAG,
    PERIOD,
    POLE,
    SIZES,
    START_ANGLE,
    STEPS,
    SUPPLY,
    fast_turned,
    motor,
    number,
    plan,
    rows,
    volts,
)
from testing.plant import Plant

from jaxmotor.motor import SpeedLaw
from jaxmotor.motor._motor import SpeedLoop, simulate_motor

pytestmark = pytest.mark.usefixtures("x64", "plant_library")

# Fine enough that rounding to counts (0.0001 count of the usual encoder) does not hide a difference.
COUNTS_PER_REV = 2e6
TICK_RMS = {
    # counts of a 617/rev encoder, per 5 ms tick in 5 steps; in the comment what was measured
    "transport_delay": 0.001,  # 0.00013, the rounding alone
    "dead_zone": 0.001,  # 0.00013
    "input_threshold": 0.001,  # 0.00013
    "voltage_offset": 0.001,  # 0.00013
    "voltage_saturation": 0.001,  # 0.00013
    "direction_asymmetry": 0.001,  # 0.00013
    "supply_sag": 0.002,  # 0.00027
    "supply_drift": 0.001,  # 0.00013
    "coast_drive": 0.004,  # 0.0008
    "current_limit": 0.004,  # 0.0007
    "electrical_pole": 0.001,  # 0.00013
    "coulomb_friction": 0.002,  # 0.0003
    "stiction": 0.004,  # 0.0009
    "quadratic_drag": 0.001,  # 0.0002
    "cogging": 0.003,  # 0.0005
    "load_torque": 0.001,  # 0.00013
    "winding_heating": 0.004,  # 0.001
    "shaft_compliance": 0.001,  # 0.00013
    "backlash": 0.01,  # 0.0025
    "encoder_eccentricity": 0.001,  # 0.00013
    "missed_counts": 0.004,  # 0.0009
    "sensor_lag": 0.006,  # 0.0018
}
TOGETHER = {
    "coulomb_friction+transport_delay": 0.003,
    "coulomb_friction+backlash": 0.012,
    "coast_drive+coulomb_friction": 0.004,
    "coast_drive+supply_sag": 0.004,
    "supply_sag+electrical_pole": 0.002,
    "supply_drift+dead_zone+voltage_saturation": 0.001,
    "winding_heating+supply_sag+current_limit": 0.006,
    "stiction+cogging": 0.005,
    "cogging+encoder_eccentricity": 0.003,
    "missed_counts+sensor_lag": 0.008,
    "shaft_compliance+coulomb_friction+direction_asymmetry": 0.004,
}


def plant_file(names, counts_per_rev=COUNTS_PER_REV, inductance=LAG * 4.5):
    tables = {
        "bench": {"pwm_edges": "false"},
        "motor": {"inductance_H": inductance, "pole_rad_s": POLE},
        "encoder": {"counts_per_rev": counts_per_rev, "start_fraction": 0.5, "start_angle_rad": START_ANGLE},
    } | {name: SIZES[name] for name in names}
    return "\n".join(
        f"[{table}]\n" + "".join(f"{k} = {v}\n" for k, v in keys.items()) for table, keys in tables.items()
    )


def reading(names):
    """The plant's reading at each tick [rad]."""
    with Plant(plant_file(names)) as p:
        read = START_ANGLE + p.sequence(plan(), period_s=PERIOD).count * (2 * np.pi / COUNTS_PER_REV)
    if "encoder_eccentricity" in names:
        size = SIZES["encoder_eccentricity"]
        read += size["amplitude_rad"] * np.sin(START_ANGLE * size["cycles_per_rev"] + size["phase_rad"])
    return read


def check(names, tolerance):
    read = reading(names)
    needs_angle = bool({"cogging", "encoder_eccentricity"} & set(names))
    turned = fast_turned(motor(*names), rows(volts(plan()), read if needs_angle else None))
    difference = (np.diff(read) - np.asarray(turned)[:-1]) / COUNT
    assert np.sqrt(np.mean(difference**2)) < tolerance
    assert np.abs(np.cumsum(difference)).max() < 0.5  # never half a count off in position


@pytest.mark.parametrize("name", sorted(TICK_RMS))
def test_effect_is_the_plants(name):
    check([name], TICK_RMS[name])


def test_static_friction_may_fall_like_an_exponential(monkeypatch):
    monkeypatch.setitem(SIZES, "stiction", SIZES["stiction"] | {"exponent": 1.0})
    check(["stiction"], TICK_RMS["stiction"])


@pytest.mark.parametrize("names", sorted(TOGETHER))
def test_effects_together_are_the_plants(names):
    check(names.split("+"), TOGETHER[names])


def test_closed_loop_is_the_plants():
    """The board's own proportional law: whole counts in, whole duties out."""
    kp, ticks = 900, 400
    reference = np.repeat([0, 60, -100, 30], 100).astype(np.int32)  # 16ths of a count per tick
    with Plant(plant_file(["coulomb_friction"], counts_per_rev=617.0)) as p:
        run = p.loop(reference, kp, period_s=PERIOD)
    speed = reference * (COUNT / 16 / PERIOD)
    step = SUPPLY / FULL_SCALE
    loop = SpeedLoop(SpeedLaw.of(kp * 16 / 4096 * step * PERIOD / COUNT, 0.0, SUPPLY, step))
    found = simulate_motor(
        motor("coulomb_friction"),
        rows(speed),
        number(PERIOD),
        number(SUPPLY),
        jnp.asarray(STEPS),
        controller=loop,
        count_rad=number(COUNT),
    )
    assert np.mean(np.round(np.asarray(found.volts) / step) == run.duty) > 0.98
    position = np.concatenate([[0.0], np.cumsum(found.turn)[:-1]]) / COUNT
    assert np.abs(position - (run.angle - START_ANGLE) / COUNT).max() < 0.5
    assert len(run.count) == ticks
