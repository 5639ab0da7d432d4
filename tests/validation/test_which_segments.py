"""Held-out data only: what was fitted is never the score, and what was not scored has a reason."""

import dataclasses
import json

import numpy as np
import pytest
from rigs import Rig, closed_loop, model, open_loop, recording, step, without, write_model

from jaxmotor._errors import JaxmotorError
from jaxmotor.estimate import fingerprint, identify, read_model
from jaxmotor.estimate import to_json as fit_to_json
from jaxmotor.validation import to_json, validate


def four_steps():
    return [open_loop(Rig(encoder=c), step(5.1)) for c in (0.1, 0.3, 0.6, 0.8)]


def of(rec, *indices):
    return tuple(fingerprint(rec, index) for index in indices)


def test_fitted_segments_are_listed_and_never_scored():
    rec = recording(*four_steps(), closed_loop(Rig(), 150, 37.7, 0.4), closed_loop(Rig(encoder=0.9), 150, 37.7, 0.4))
    v = validate(model(fitted=of(rec, 0, 2, 4)), rec)
    assert v.fitted == (0, 2, 4)
    assert v.scored == (1, 3, 5)
    assert v.open_loop is not None and set(v.open_loop.segments) == {1, 3}
    assert [s.segments for s in v.steps] == [(1, 3)]
    assert [c.segment for c in v.closed_loop] == [5]


def test_a_fitted_segment_is_known_again_in_another_recording():
    rec = recording(*four_steps())
    other = recording(rec.segments[3], rec.segments[0], source="other.csv")
    v = validate(model(fitted=of(rec, 0)), other)
    assert v.fitted == (1,)
    assert v.scored == (0,)


def test_the_score_does_not_depend_on_what_was_fitted():
    rec = recording(open_loop(Rig(encoder=0.2), step(5.1)), *four_steps())
    spoilt = dataclasses.replace(rec.segments[0], count=rec.segments[0].count * 3)
    both = [recording(first, *rec.segments[1:]) for first in (rec.segments[0], spoilt)]
    scores = [validate(model(fitted=of(one, 0)), one).open_loop.pooled for one in both]
    assert scores[0] == scores[1]


def test_nothing_left_is_a_sentence_that_says_how_to_hold_out():
    rec = recording(*four_steps())
    with pytest.raises(JaxmotorError, match=r"every segment .* was fitted.*--hold-out.*another recording"):
        validate(model(fitted=of(rec, 0, 1, 2, 3)), rec)


def test_what_identify_held_out_is_what_is_scored(tmp_path):
    rig = {"gain": 11.0, "pole": 40.0}
    heights = (3.0, 5.1, -4.0, 5.1)
    rec = recording(
        *(open_loop(Rig(**rig, encoder=c), step(u)) for c, u in zip((0.1, 0.4, 0.5, 0.8), heights, strict=True))
    )
    fit = identify(rec, hold_out=(3,))
    path = tmp_path / "model.json"
    path.write_text(json.dumps(fit_to_json(fit)))
    v = validate(read_model(path), rec)
    assert v.fitted == fit.fitted == (0, 1, 2)
    assert v.scored == (3,)
    assert v.open_loop.pooled.chi2_per_sample < 1.6


def test_rests_and_single_rows_have_a_reason():
    rest = dataclasses.replace(open_loop(Rig(), np.zeros(30)), kind="rest")
    row = open_loop(Rig(), np.array([100]))
    scattered = without(open_loop(Rig(), step(5.1, ticks=31, before=0)), list(range(1, 31, 2)))
    v = validate(model(), recording(*four_steps(), rest, row, scattered))
    assert {s.segment: s.reason for s in v.skipped} == {
        4: "the motor rests",
        5: "it has one row only",
        6: "it is too short, or lost too many ticks, to show a speed",
    }
    assert v.scored == (0, 1, 2, 3)


def test_only_rests_is_a_sentence():
    moved = open_loop(Rig(), step(5.1))
    with pytest.raises(JaxmotorError, match=r"no segment can be scored .segment 0: the motor rests"):
        validate(model(), recording(dataclasses.replace(moved, kind="rest")))


def test_a_motor_that_never_moved_is_a_sentence():
    still = dataclasses.replace(four_steps()[0], count=np.zeros(150, dtype=np.int64))
    with pytest.raises(JaxmotorError, match="never moved"):
        validate(model(), recording(still))


def test_a_jump_of_the_count_is_a_sentence():
    segment = four_steps()[0]
    count = segment.count.copy()
    count[100:] += 5000
    with pytest.raises(JaxmotorError, match="the count jumps by"):
        validate(model(), recording(dataclasses.replace(segment, count=count)))


def test_a_covariance_that_is_none_is_a_sentence():
    bad = dataclasses.replace(model(), covariance=np.array([[1e-4, 0.0], [0.0, -1.0]]))
    with pytest.raises(JaxmotorError, match=r"model\.json: covariance"):
        validate(bad, recording(*four_steps()))


def test_too_few_simulations_is_a_sentence():
    with pytest.raises(JaxmotorError, match="ask for 64"):
        validate(model(), recording(*four_steps()), simulations=10)


def test_an_unknown_origin_is_said():
    rec = recording(*four_steps())
    assert any("does not say which data" in note for note in validate(model(), rec).notes)
    same = recording(*rec.segments, source="fit.csv")
    assert any("of this name" in note for note in validate(model(fitted=("0" * 16,)), same).notes)
    assert not validate(model(fitted=("0" * 16,)), rec).notes


def test_the_rigs_offset_is_said_to_be_included():
    notes = validate(model(offset_V=0.02, fitted=("0" * 16,)), recording(*four_steps())).notes
    assert len(notes) == 1 and "20 mV" in notes[0]


def test_json_is_finite_or_null_and_has_units(tmp_path):
    rec = recording(*four_steps(), closed_loop(Rig(), 150, 37.7, 0.05, 2.0), closed_loop(Rig(), 150, 500.0, 0.4))
    content = to_json(validate(read_model(write_model(tmp_path / "m.json")), rec))
    assert json.loads(json.dumps(content, allow_nan=False)) == content
    assert content["format"] == 1
    assert content["model"] == {"gain_rad_s_V": 11.0, "pole_rad_s": 40.0, "voltage_offset_V": 0.0}
    assert content["open_loop"]["chi2_floor"] == "encoder"
    assert content["steps"][0]["trials"] == 4
    assert [loop["controller"] for loop in content["closed_loop"]] == ["PI", "P"]
    assert set(content["closed_loop"][1]["steady_error_rad_s"]) == {
        "measured",
        "predicted",
        "inside",
        "theory",
        "theory_with_offset",
    }


def test_the_seed_decides():
    rec = recording(*four_steps(), closed_loop(Rig(), 150, 37.7, 0.4))
    first, again, other = (to_json(validate(model(), rec, seed=seed)) for seed in (0, 0, 1))
    assert first == again
    assert first["steps"] != other["steps"]
    assert first["open_loop"] == other["open_loop"]
