"""The model file: what is written is read, and anything else is a sentence."""

import dataclasses
import itertools
import json
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from testing.made import COUNTS, SUPPLY, recording

from jaxmotor import JaxmotorError, identify, read_model
from jaxmotor.estimate import ModelRig, fingerprint, to_json

DUTIES = (255.0, 4e-5)
"""Full scale, and delay [s]."""


@pytest.fixture(scope="module")
def fit():
    full_scale, delay = DUTIES
    stated = dataclasses.replace(recording(0), duty_full_scale=full_scale, duty_delay_s=delay)
    return identify(stated, hold_out=[3])


def stored(folder: Path, text: str) -> Path:
    path = folder / "model.json"
    path.write_text(text)
    return path


def test_round_trip(fit, tmp_path):
    model = read_model(stored(tmp_path, json.dumps(to_json(fit))))
    assert float(model.motor.gain) == float(fit.motor.gain) and float(model.motor.pole) == float(fit.motor.pole)
    np.testing.assert_array_equal(model.covariance, fit.covariance)
    assert model.offset_V == fit.offset_V and model.period_s == 0.005
    assert model.rig == fit.rig == ModelRig(COUNTS, SUPPLY, *DUTIES)
    made = recording(0)
    assert fingerprint(made, 0) in model.fitted and fingerprint(made, 3) not in model.fitted


def test_a_segment_is_known_again_wherever_its_counter_stood(fit):
    made = recording(0)
    moved = dataclasses.replace(made.segments[0], count=made.segments[0].count + 12345)
    again = dataclasses.replace(made, segments=(moved,))
    assert fingerprint(again, 0) == fit.fingerprints[0]


def test_a_file_without_a_rig_is_read(fit, tmp_path):
    """As earlier versions wrote it: without duties, or with nothing."""
    content = to_json(fit)
    assert tuple(content.pop(key) for key in ModelRig._fields[2:]) == DUTIES
    assert read_model(stored(tmp_path, json.dumps(content))).rig == ModelRig(COUNTS, SUPPLY)
    assert (content.pop("counts_per_rev"), content.pop("supply_V")) == (COUNTS, SUPPLY)
    assert read_model(stored(tmp_path, json.dumps(content))).rig == ModelRig()


@pytest.mark.parametrize(
    ("key", "value"),
    [
        *itertools.product(ModelRig._fields, [-617.4, float("nan"), 1e13, "617.4", [617.4], True]),
        *itertools.product(["counts_per_rev", "supply_V"], [0.0, 1e12]),
        ("duty_full_scale", 0.0),
        ("duty_delay_s", 1e5),
    ],
)
def test_no_rig_has_that(fit, tmp_path, key, value):
    path = stored(tmp_path, json.dumps(to_json(fit) | {key: value}))
    with pytest.raises(JaxmotorError, match=f"model.json: {key} is "):
        read_model(path)


@pytest.mark.parametrize(
    "text",
    [
        "",
        "{",
        "[]",
        "null",
        '{"format": 2}',
        '{"format": 1}',
        '{"format": 1, "model": 7}',
        '{"format": 1, "model": {"gain_rad_s_V": "11", "pole_rad_s": 40}}',
        '{"format": 1, "model": {"gain_rad_s_V": 11, "pole_rad_s": -40}, "covariance": [[1, 0], [0, 1]]}',
        '{"format": 1, "model": {"gain_rad_s_V": 11, "pole_rad_s": NaN}, "covariance": [[1, 0], [0, 1]]}',
        '{"format": 1, "model": {"gain_rad_s_V": 11, "pole_rad_s": 40}, "covariance": [[1, 0]]}',
        '{"format": 1, "model": {"gain_rad_s_V": 11, "pole_rad_s": 40}, "covariance": "x"}',
        "[" * 100_000,
    ],
)
def test_anything_else_is_a_sentence(tmp_path, text):
    with pytest.raises(JaxmotorError, match=r"model\.json: ") as caught:
        read_model(stored(tmp_path, text))
    assert "\n" not in str(caught.value)


def test_no_file_is_a_sentence(tmp_path):
    with pytest.raises(JaxmotorError, match="cannot be read"):
        read_model(tmp_path / "none.json")


@given(st.data())
@settings(max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_damage_never_escapes(fit, tmp_path, data):
    text = json.dumps(to_json(fit))
    place = data.draw(st.integers(0, len(text) - 1))
    kind = data.draw(st.sampled_from(["cut", "swap", "double"]))
    damaged = {
        "cut": text[:place],
        "swap": text[:place] + data.draw(st.characters()) + text[place + 1 :],
        "double": text[:place] + text[place:] + text[place:],
    }[kind]
    try:
        read_model(stored(tmp_path, damaged))
    except JaxmotorError as error:
        assert "\n" not in str(error)


@pytest.mark.parametrize("error", [10**400, float("inf"), float("nan"), -1.0, "0.1", None, True, [0.1]])
def test_an_offset_error_that_is_none_is_not_known(fit, tmp_path, error):
    content = to_json(fit)
    path = tmp_path / "m.json"
    path.write_text(json.dumps(content))
    assert read_model(path).offset_error_V == fit.offset_standard_error_V
    content["standard_error"]["voltage_offset_V"] = error
    path.write_text(json.dumps(content))
    assert math.isnan(read_model(path).offset_error_V)
