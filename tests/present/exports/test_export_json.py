"""The JSON export against its schema."""

import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest
from cases import HARDWARE, made

from jaxmotor.control import sampled_motor
from jaxmotor.estimate import Joint
from jaxmotor.present.exports import design, to_export_json

SCHEMA = json.loads((Path(__file__).parents[3] / "docs" / "export.schema.json").read_text())
EFFECTS = (("coulomb_friction", {"volts_V": 0.3}), ("backlash", {"gap_rad": 0.03, "inertia_ratio": 0.3}))


@pytest.fixture
def valid():
    jsonschema = pytest.importorskip("jsonschema", reason="jsonschema is not installed; pip install jsonschema")
    jsonschema.Draft202012Validator.check_schema(SCHEMA)
    return jsonschema.Draft202012Validator(SCHEMA)


@pytest.mark.parametrize("lag", [None, 0.003])
@pytest.mark.parametrize("with_rig", [False, True])
@pytest.mark.parametrize("effects", [(), EFFECTS], ids=["linear", "effects"])
def test_it_fits_the_schema(valid, lag, with_rig, effects):
    model = made(*effects, lag=lag, response=True)
    text = to_export_json(model, design(model, HARDWARE) if with_rig else None)
    content = json.loads(text, parse_constant=lambda name: pytest.fail(f"{name} is no JSON"))
    assert list(valid.iter_errors(content)) == []
    assert (content["speed_loop"] is not None) is with_rig
    assert list(valid.iter_errors({**content, "format": 2}))
    assert list(valid.iter_errors({key: value for key, value in content.items() if key != "model"}))


def test_what_a_diagnosis_adds_fits_the_schema(valid):
    joint = Joint(("gain_rad_s_V", "pole_rad_s", "coulomb_friction.volts_V"), np.diag([1e-3, 0.4, 1e-4]))
    model = dataclasses.replace(made(*EFFECTS), joint=joint, viscous_share=0.05)
    content = json.loads(to_export_json(model))
    assert content["joint_covariance"]["names"][2] == "coulomb_friction.volts_V"
    assert list(valid.iter_errors(content)) == []


def test_the_numbers_are_the_designs(valid):
    model = made(*EFFECTS)
    wanted = design(model, HARDWARE)
    content = json.loads(to_export_json(model, wanted))
    assert content["speed_loop"]["gain_V_s_rad"] == wanted.speed.gain_V_s_rad
    np.testing.assert_array_equal(content["sampled"]["transition"], sampled_motor(model.whole, HARDWARE).transition)
    assert content["effects"][1]["parameters"] == {"gap_rad": 0.03, "inertia_ratio": 0.3}
