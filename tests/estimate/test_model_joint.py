"""How sure parameters are together, in the model file: what is written is read, and anything else is a sentence."""

import json

import numpy as np
import pytest

from jaxmotor import JaxmotorError, read_model
from jaxmotor.estimate import model_to_json
from jaxmotor.present.exports import to_export_json

NAMES = ["gain_rad_s_V", "pole_rad_s", "viscous_share", "coulomb_friction.volts_V"]
ERRORS = np.array([0.03, 0.3, 0.02, 0.01])
CORRELATION = np.array([[1, -0.5, 0.2, 0.98], [-0.5, 1, 0, -0.5], [0.2, 0, 1, 0.2], [0.98, -0.5, 0.2, 1]])
TABLE = (CORRELATION * np.outer(ERRORS, ERRORS)).tolist()


def model(folder, joint):
    path = folder / "model.json"
    content = {
        "format": 1,
        "model": {"gain_rad_s_V": 10.6, "pole_rad_s": 40, "viscous_share": 0.04},
        "covariance": [[9e-4, 0], [0, 0.09]],
        "effects": [{"name": "coulomb_friction", "parameters": {"volts_V": 0.3}}],
        "joint_covariance": joint,
    }
    path.write_text(json.dumps(content))
    return read_model(path)


def test_it_comes_back(tmp_path):
    first = model(tmp_path, {"names": NAMES, "covariance": TABLE})
    (tmp_path / "again.json").write_text(json.dumps(model_to_json(first)))
    again = read_model(tmp_path / "again.json")
    assert again.joint is not None and again.joint.names == tuple(NAMES)
    np.testing.assert_allclose(again.joint.covariance, TABLE, rtol=1e-12)
    assert json.loads(to_export_json(again))["joint_covariance"]["names"] == NAMES


def test_it_may_be_absent_and_hold_a_part(tmp_path):
    assert model(tmp_path, None).joint is None
    assert "joint_covariance" not in model_to_json(model(tmp_path, None))
    part = model(tmp_path, {"names": NAMES[:2], "covariance": [row[:2] for row in TABLE[:2]]}).joint
    assert part is not None and part.of(["pole_rad_s", "dead_zone.volts_V"]).covariance == pytest.approx(0.09)


def with_number(value, *places):
    table = np.array(TABLE)
    for place in places:
        table[place] = value
    return table.tolist()


@pytest.mark.parametrize(
    ("damage", "says"),
    [
        (7, "no list of names"),
        ({"covariance": TABLE}, "no list of names"),
        ({"names": "gain_rad_s_V", "covariance": TABLE}, "no list of names"),
        ({"names": [*NAMES[:3], 4], "covariance": TABLE}, "no list of names"),
        ({"names": [*NAMES[:3], "stiction.volts_V"], "covariance": TABLE}, "no parameter of this model"),
        ({"names": [*NAMES[:3], NAMES[0]], "covariance": TABLE}, "once at most"),
        ({"names": NAMES[1:], "covariance": [row[1:] for row in TABLE[1:]]}, "once at most"),
        ({"names": NAMES}, "4 x 4 numbers"),
        ({"names": NAMES, "covariance": TABLE[:3]}, "4 x 4 numbers"),
        ({"names": NAMES, "covariance": [[1, 2], [3]]}, "4 x 4 numbers"),
        ({"names": NAMES, "covariance": "x"}, "4 x 4 numbers"),
        ({"names": NAMES, "covariance": with_number(float("nan"), (0, 0))}, "4 x 4 numbers"),
        ({"names": NAMES, "covariance": with_number(float("inf"), (2, 2))}, "4 x 4 numbers"),
        ({"names": NAMES, "covariance": with_number(0.5, (0, 1))}, "not symmetric"),
        ({"names": NAMES, "covariance": with_number(-1.0, (3, 3))}, "negative variance|not symmetric"),
        ({"names": NAMES, "covariance": with_number(0.02, (0, 1), (1, 0))}, "negative variance"),
    ],
)
def test_damage_is_a_sentence(tmp_path, damage, says):
    with pytest.raises(JaxmotorError, match=rf"model\.json: joint_covariance.*({says})") as caught:
        model(tmp_path, damage)
    assert "\n" not in str(caught.value)
