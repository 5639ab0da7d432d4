"""kS, kV, kA as WPILib's own feed-forward uses them."""

import itertools
import json
import math

import numpy as np
import pytest
from cases import made, simulated

from jaxmotor import JaxmotorError
from jaxmotor.present.exports import to_wpilib

FRICTION = ("coulomb_friction", {"volts_V": 0.3})


def test_wpilibs_feed_forward_drives_our_motor():
    controller = pytest.importorskip("wpimath.controller", reason="robotpy-wpimath is not installed")
    gains = json.loads(to_wpilib(made(FRICTION)))["radians"]
    law = controller.SimpleMotorFeedforwardRadians(gains["kS"], gains["kV"], gains["kA"], 0.005)
    wanted = 30 + 10 * np.sin(2 * np.pi * 1.5 * np.arange(300) * 0.005)
    wanted[:40] *= np.arange(40) / 40
    volts = [law.calculate(now, after) for now, after in itertools.pairwise(wanted)]
    speed, _ = simulated(made(FRICTION), volts)
    # From the third tick on: at the first the motor breaks away.
    assert np.abs(speed[3:] - wanted[3:-1]).max() < 0.45
    assert np.abs(speed[60:] - wanted[60:-1]).max() < 0.05


def test_units_and_errors():
    content = json.loads(to_wpilib(made(FRICTION, ("dead_zone", {"volts_V": 0.1})), wheel_radius_m=0.05))
    radians, rotations, meters = (content[unit] for unit in ("radians", "rotations", "meters"))
    assert radians["kS"] == rotations["kS"] == pytest.approx(0.4)
    assert radians["kV"] == pytest.approx(1 / 10.6) and radians["kA"] == pytest.approx(1 / 10.6 / 40)
    assert rotations["kV"] == pytest.approx(2 * math.pi / 10.6) and meters["kV"] == pytest.approx(20 / 10.6)
    errors = radians["standard_error"]
    assert errors["kS"] == pytest.approx(math.hypot(0.006, 0.002))
    assert errors["kV"] / radians["kV"] == pytest.approx(0.03 / 10.6)
    assert errors["kA"] / radians["kA"] == pytest.approx(math.hypot(0.03 / 10.6, 0.6 / 40))


def test_what_is_left_out_and_what_is_wrong_is_said():
    content = json.loads(to_wpilib(made(("backlash", {"gap_rad": 0.03, "inertia_ratio": 0.3}))))
    assert content["not_carried"][0].startswith("backlash")
    with pytest.raises(JaxmotorError, match="not positive"):
        to_wpilib(made(), wheel_radius_m=0.0)
