"""Effects in the model file: what is written is read, and anything else is a sentence."""

import json
import math

import numpy as np
import pytest

from jaxmotor import EFFECTS, JaxmotorError, read_model
from jaxmotor.estimate import model_to_json
from jaxmotor.motor.effects import LEARNED, NO_PLACE, parameters

LINEAR = {"format": 1, "model": {"gain_rad_s_V": 10.6, "pole_rad_s": 40}, "covariance": [[1e-3, 0], [0, 0.1]]}


def model(folder, effects, **others):
    path = folder / "model.json"
    path.write_text(json.dumps({**LINEAR, **others, "effects": effects}))
    return read_model(path)


@pytest.mark.parametrize("name", EFFECTS)
def test_every_effect_comes_back(tmp_path, name):
    about = parameters(EFFECTS[name])
    values = {key: one.get("choices", (0.1 * (index + 1),))[0] for index, (key, one) in enumerate(about.items())}
    entry = {
        "name": name,
        "parameters": values,
        "standard_error": dict.fromkeys(about, 0.01),
        "held_out_gain_percent": 12.0,
        "rivals": [],
    }
    first = model(tmp_path, [entry], period_s=0.005)
    (tmp_path / "again.json").write_text(json.dumps(model_to_json(first)))
    again = read_model(tmp_path / "again.json")
    [effect] = again.effects
    assert effect.name == name
    for key, value in values.items():
        assert float(getattr(effect, key)) == value
        assert again.effect_errors[0][key] == 0.01
    assert again.whole.effects == first.whole.effects or about
    assert float(again.motor.gain) == 10.6 and again.period_s == 0.005
    np.testing.assert_array_equal(again.covariance, first.covariance)


def test_errors_may_be_unknown_and_effects_absent(tmp_path):
    found = model(
        tmp_path, [{"name": "dead_zone", "parameters": {"volts_V": 0.2}, "standard_error": {"volts_V": None}}]
    )
    assert math.isnan(found.effect_errors[0]["volts_V"])
    assert model_to_json(found)["effects"][0]["standard_error"] == {"volts_V": None}
    (tmp_path / "linear.json").write_text(json.dumps(LINEAR))
    assert read_model(tmp_path / "linear.json").effects == ()


def test_static_friction_of_before_it_had_an_exponent_falls_like_a_bell(tmp_path):
    sizes = {"volts_V": 0.3, "static_volts_V": 0.5, "stribeck_speed_rad_s": 2.0}
    [effect] = model(tmp_path, [{"name": "stiction", "parameters": sizes}]).effects
    assert float(effect.exponent) == 2.0


@pytest.mark.parametrize("curve", ["torque_over_speed", "voltage_over_command"])
def test_a_curve_of_before_it_could_have_bends_has_none(tmp_path, curve):
    bends = {"bend_V": 0.0, "even_bend_V": 0.0, "bend_share": NO_PLACE}
    before = {key: 0.1 for key in parameters(LEARNED[curve]) if key not in bends}
    [effect] = model(tmp_path, [{"name": curve, "parameters": before}]).effects
    assert {key: float(getattr(effect, key)) for key in bends} == bends
    assert float(effect.c24_V) == 0.1


def test_the_rigs_offset_is_part_of_the_whole(tmp_path):
    entry = {"name": "coulomb_friction", "parameters": {"volts_V": 0.3}}
    rig = {"gain_rad_s_V": 10.6, "pole_rad_s": 40, "voltage_offset_V": 0.05}
    whole = model(tmp_path, [entry], model=rig).whole
    assert [effect.name for effect in whole.effects] == ["coulomb_friction", "voltage_offset"]
    named = {"name": "voltage_offset", "parameters": {"volts_V": 0.07}}
    assert [effect.name for effect in model(tmp_path, [named], model=rig).whole.effects] == ["voltage_offset"]


GOOD = {"name": "coulomb_friction", "parameters": {"volts_V": 0.3}}


@pytest.mark.parametrize(
    "effects",
    [
        7,
        "coulomb_friction",
        [7],
        [{}],
        [{"name": "magic", "parameters": {}}],
        [{"name": ["x"], "parameters": {}}],
        [{"name": "coulomb_friction"}],
        [{"name": "coulomb_friction", "parameters": 3}],
        [{"name": "coulomb_friction", "parameters": {"volts_V": "0.3"}}],
        [{"name": "coulomb_friction", "parameters": {"volts_V": True}}],
        [{"name": "torque_over_speed", "parameters": {f"c{k}_V": 0.1 for k in range(25)} | {"reach_rad_s": 0.0}}],
        [{"name": "coulomb_friction", "parameters": {"volts_V": -0.3}}],
        [{"name": "coulomb_friction", "parameters": {"volts_V": float("nan")}}],
        [{"name": "coulomb_friction", "parameters": {"volts_V": 0.3, "volt": 1}}],
        [
            {
                "name": "stiction",
                "parameters": {"volts_V": 0.3, "static_volts_V": 0.5, "stribeck_speed_rad_s": 2, "exponent": 1.7},
            }
        ],
        [{**GOOD, "standard_error": {"volts_V": -1}}],
        [{**GOOD, "standard_error": {"volts_V": "x"}}],
        [{**GOOD, "standard_error": []}, GOOD],
        [GOOD, GOOD],
        [GOOD] * 100,
        [
            {"name": "backlash", "parameters": {"gap_rad": 0.1, "inertia_ratio": 0.3}},
            {
                "name": "shaft_compliance",
                "parameters": {"frequency_Hz": 20, "damping_ratio": 0.1, "inertia_ratio": 0.3},
            },
        ],
    ],
)
def test_anything_else_is_a_sentence(tmp_path, effects):
    with pytest.raises(JaxmotorError, match=r"model\.json: effect") as caught:
        model(tmp_path, effects)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "damage",
    [
        {"real": [1.0]},
        {"real": "x"},
        {"covariance": [[1.0]]},
        {"speed_window_s": "y"},
        {"frequency_Hz": [[1.0], [2.0]]},
    ],
)
def test_a_damaged_response_is_a_sentence(tmp_path, damage):
    table = {
        "frequency_Hz": [1.0, 2.0],
        "real": [1.0, 2.0],
        "imag": [0.0, 1.0],
        "covariance": [[[1.0, 0.0], [0.0, 1.0]]] * 2,
        "amplitude_V": [5.0, 5.0],
        "speed_window_s": None,
    }
    good = model(tmp_path, [], frequency_response=table, period_s=0.005)
    assert good.response is not None and good.response.window_s is None
    with pytest.raises(JaxmotorError, match=r"model\.json: "):
        model(tmp_path, [], frequency_response=table | damage, period_s=0.005)
