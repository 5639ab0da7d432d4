"""What feed-forward asks for is what the finely integrated plant needs."""

import jax.numpy as jnp
import numpy as np
import pytest
from models import model
from testing.plant import Plant

from jaxmotor.control import feed_forward, reachable_rad_s

EFFECTS = {
    "coulomb_friction": {"volts_V": 0.4},
    "dead_zone": {"volts_V": 0.3},
    "voltage_offset": {"volts_V": 0.15},
    "direction_asymmetry": {"ratio": 0.05},
    "quadratic_drag": {"volts_V_s2_rad2": 4e-4},
    "load_torque": {"volts_V": 0.2},
}


def toml(effects):
    tables = [f"[{name}]\n" + "\n".join(f"{k} = {v}" for k, v in values.items()) for name, values in effects.items()]
    return "\n".join(["[motor]\ninductance_H = 0", "[bench]\npwm_edges = false", *tables])


@pytest.mark.parametrize("speed", [35.0, -35.0, 8.0])
@pytest.mark.parametrize("names", [*([name] for name in EFFECTS), list(EFFECTS)], ids="+".join)
def test_the_plant_runs_at_the_speed_asked_for(plant_library, x64, names, speed):
    chosen = {name: EFFECTS[name] for name in names}
    law = feed_forward(model(*chosen.items()).whole)
    volts = float(law.volts(jnp.asarray(speed), jnp.asarray(0.0)))
    with Plant(toml(chosen)) as plant:
        for _ in range(200):
            plant.hold(volts / 7.4, 0.005)
        assert plant.speed == pytest.approx(speed, rel=2e-4)


def test_a_profile_is_followed(plant_library, x64):
    """Speed sin(2 pi 1.5 t): with friction at every reversal the plant stays within 4 % of the amplitude."""
    chosen = {name: EFFECTS[name] for name in ("coulomb_friction", "dead_zone")}
    law = feed_forward(model(*chosen.items()).whole)
    time = (np.arange(400) + 0.5) * 0.005
    speed, w = 40 * np.sin(2 * np.pi * 1.5 * time), 2 * np.pi * 1.5
    volts = [
        float(law.volts(jnp.asarray(v), jnp.asarray(40 * w * np.cos(w * t)))) for v, t in zip(speed, time, strict=True)
    ]
    with Plant(toml(chosen)) as plant:
        seen = []
        for u in volts:
            plant.hold(u / 7.4, 0.005)
            seen.append(plant.speed)
    assert np.sqrt(np.mean((np.array(seen) - 40 * np.sin(w * (time + 0.0025))) ** 2)) < 0.04 * 40


def test_a_motor_that_turns_against_the_voltage_is_its_mirror_image(x64):
    ahead = feed_forward(model(*EFFECTS.items()).whole)
    mirrored = EFFECTS | {"load_torque": {"volts_V": -EFFECTS["load_torque"]["volts_V"]}}
    back = feed_forward(model(*mirrored.items(), gain=-10.6).whole)
    for speed in (-30.0, -2.0, 15.0, 40.0):
        wanted = float(ahead.volts(jnp.asarray(speed), jnp.asarray(100.0)))
        assert float(back.volts(jnp.asarray(-speed), jnp.asarray(-100.0))) == pytest.approx(wanted, rel=1e-12)
    [one, other] = (
        reachable_rad_s(model(*chosen.items(), gain=gain).whole, 7.4)
        for chosen, gain in ((EFFECTS, 10.6), (mirrored, -10.6))
    )
    assert other == pytest.approx(one, rel=1e-12)
