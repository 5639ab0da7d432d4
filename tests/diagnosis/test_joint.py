"""How sure a diagnosis is of its parameters together: as free vectors drawn from their covariance show it."""

import json

import numpy as np
import pytest
from diagnosed import of

from jaxmotor._precision import in_float64
from jaxmotor.diagnosis import extended_model
from jaxmotor.diagnosis._free import free_of, linear_of, motor_at
from jaxmotor.diagnosis._joint import joint_covariance
from jaxmotor.diagnosis._solve import Fitted
from jaxmotor.estimate import model_to_json, read_model
from jaxmotor.motor import EFFECTS
from jaxmotor.motor.effects import Rig

RIG = Rig(7.4, (2.0, 5.0, 7.4), 78.0, 0.005, 60.0, True)


@in_float64
def test_it_is_what_drawn_vectors_show():
    effects = (
        EFFECTS["coulomb_friction"].of(volts_V=0.3),
        EFFECTS["load_torque"].of(volts_V=-0.1),
        EFFECTS["cogging"].of(volts_V=0.2, cycles_per_rev=6.0, phase_rad=0.7),
    )
    motor = linear_of(10.6, 40.0, effects=effects)
    free = free_of(motor)
    rng = np.random.default_rng(0)
    mixed = 1e-4 * rng.normal(size=(len(free), len(free)))
    fitted = Fitted(motor, free, np.zeros(0), np.ones(1), np.ones((1, len(free))), True)
    joint = joint_covariance(fitted, mixed @ mixed.T, RIG)
    drawn = [motor_at(motor, free + mixed @ rng.normal(size=len(free))) for _ in range(4000)]
    rows = []
    for one in drawn:
        rows.append(
            {"gain_rad_s_V": one.linear.gain, "pole_rad_s": one.linear.pole, "viscous_share": one.viscous_share}
        )
        rows[-1]["electrical_time_constant_s"] = one.linear.electrical_time_constant
        rows[-1] |= {f"{each.name}.{name}": getattr(each, name) for each in one.effects for name in vars(each)}
    seen = np.cov(np.array([[float(row[name]) for name in joint.names] for row in rows]).T)
    error = np.sqrt(np.diag(joint.covariance))
    assert joint.names[4:] == (
        "coulomb_friction.volts_V",
        "load_torque.volts_V",
        "cogging.volts_V",
        "cogging.cycles_per_rev",
        "cogging.phase_rad",
    )
    scale = np.where(error > 0, error, 1.0)
    np.testing.assert_allclose(seen / np.outer(scale, scale), joint.covariance / np.outer(scale, scale), atol=0.08)


def test_what_is_not_known_is_not_in_it():
    motor = linear_of(10.6, 40.0, effects=(EFFECTS["coulomb_friction"].of(volts_V=0.3),))
    free = free_of(motor)
    fitted = Fitted(motor, free, np.zeros(0), np.ones(1), np.ones((1, len(free))), True)
    spread = np.diag([1e-4, 1e-4, 1e-12, 1e-4, np.inf])
    assert "coulomb_friction.volts_V" not in joint_covariance(fitted, spread, RIG).names


def test_the_extended_model_has_it(tmp_path):
    """Sines of two amplitudes show the friction mostly as a gain that rises with the amplitude."""
    _, found = of("friction")
    model = extended_model(found)
    (tmp_path / "m.json").write_text(json.dumps(model_to_json(model)))
    joint = read_model(tmp_path / "m.json").joint
    assert joint is not None and {"gain_rad_s_V", "coulomb_friction.volts_V"} <= set(joint.names)
    error = dict(zip(joint.names, np.sqrt(np.diag(joint.covariance)), strict=True))
    assert error["gain_rad_s_V"] == pytest.approx(found.standard_error["gain_rad_s_V"])
    assert error["coulomb_friction.volts_V"] == pytest.approx(found.effects[0].standard_error["volts_V"])
    pair = joint.of(["gain_rad_s_V", "coulomb_friction.volts_V"]).covariance
    assert pair[0, 1] / np.sqrt(pair[0, 0] * pair[1, 1]) > 0.5
