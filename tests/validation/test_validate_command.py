"""`jaxmotor validate`: readable text, one line of JSON, sentences for what cannot be used."""

import json

import pytest
from rigs import Rig, closed_loop, open_loop, recording, step, write_model

from jaxmotor.cli import main
from jaxmotor.recording import write


@pytest.fixture(autouse=True)
def no_cache(monkeypatch):
    monkeypatch.setenv("JAXMOTOR_CACHE", "")


@pytest.fixture
def files(tmp_path):
    segments = [open_loop(Rig(encoder=c), step(5.1)) for c in (0.1, 0.3, 0.6, 0.8)]
    log = tmp_path / "rec.csv"
    write(recording(*segments, closed_loop(Rig(), 150, 37.7, 0.4)), log)
    return str(write_model(tmp_path / "model.json")), str(log)


def test_the_summary_names_what_was_scored(files, capsys):
    assert main(["validate", *files]) == 0
    text = capsys.readouterr().out
    assert text.startswith("rec.csv against model.json\n  segments scored: 0-4; fitted, so not scored: none\n")
    assert "mean of 4 trials (segments 0-3)" in text
    assert "closed loop, segment 4: P 0.4 V s/rad, reference 37.7 rad/s" in text
    assert "theory (eq. 21) gives a steady error of 6.981" in text
    assert max(map(len, text.splitlines())) <= 120


def test_json_is_one_line(files, capsys):
    assert main(["validate", *files, "--json", "--seed", "3"]) == 0
    (line,) = capsys.readouterr().out.splitlines()
    content = json.loads(line)
    assert content["recording"] == "rec.csv"
    assert content["seed"] == 3


@pytest.mark.parametrize(
    ("changes", "what"),
    [
        ({"format": 2}, "format 2"),
        ({"model": None}, "gain_rad_s_V and pole_rad_s"),
        ({"model": {"gain_rad_s_V": "fast", "pole_rad_s": 40.0}}, "not a number"),
        ({"model": {"gain_rad_s_V": 11.0, "pole_rad_s": -40.0}}, "positive"),
        ({"model": {"gain_rad_s_V": 11.0, "pole_rad_s": 40.0, "viscous_share": 1.5}}, "viscous_share"),
        ({"covariance": [[1.0]]}, "covariance"),
        ({"covariance": [[1.0, 0.0], [0.0, -1.0]]}, "covariance"),
    ],
)
def test_a_damaged_model_is_a_sentence(files, tmp_path, capsys, changes, what):
    bad = write_model(tmp_path / "bad.json", **changes)
    assert main(["validate", str(bad), files[1]]) == 1
    error = capsys.readouterr().err
    assert error.startswith("jaxmotor: ") and error.count("\n") == 1
    assert "bad.json" in error and what in error


@pytest.mark.parametrize("content", [b"", b"\x00\xff\x10", b"[1, 2]", b'{"format": 1'])
def test_rubbish_is_a_sentence(files, tmp_path, capsys, content):
    bad = tmp_path / "bad.json"
    bad.write_bytes(content)
    assert main(["validate", str(bad), files[1]]) == 1
    assert capsys.readouterr().err.count("\n") == 1


def test_a_missing_recording_is_a_sentence(files, tmp_path, capsys):
    assert main(["validate", files[0], str(tmp_path / "none.csv")]) == 1
    assert capsys.readouterr().err.count("\n") == 1
