"""`jaxmotor export` and `jaxmotor simulate`: files written whole, and bad input as a sentence."""

import dataclasses
import json

import pytest
from cases import made

from jaxmotor import read
from jaxmotor.cli import main
from jaxmotor.estimate import ModelRig, model_to_json

RIG = ["--counts-per-rev", "617.4", "--supply", "7.4"]


@pytest.fixture(autouse=True)
def no_cache(monkeypatch):
    monkeypatch.setenv("JAXMOTOR_CACHE", "")


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "motor.json"
    effects = (("coulomb_friction", {"volts_V": 0.3}), ("backlash", {"gap_rad": 0.03, "inertia_ratio": 0.3}))
    path.write_text(json.dumps(model_to_json(made(*effects, recording="<script>alert(1)</script>"))))
    return path


@pytest.mark.parametrize("to", ["control", "json", "c", "wpilib", "mujoco", "spice"])
def test_every_format_is_written_and_says_what_it_leaves_out(file, tmp_path, capsys, to):
    out = tmp_path / f"out.{to}"
    assert main(["export", str(file), "--to", to, *RIG, "-o", str(out)]) == 0
    assert capsys.readouterr().out == f"wrote {out}\n"
    text = out.read_text()
    assert "backlash" in text and (to != "mujoco" or "<script>" not in text)
    assert main(["export", str(file), "--to", to, *RIG]) == 0
    assert capsys.readouterr().out == text


@pytest.mark.parametrize("to", ["c", "arduino"])
def test_the_rig_of_the_recording_is_taken_where_no_other_is_given(tmp_path, to):
    rig = ModelRig(617.4, 7.4)
    path = tmp_path / "motor.json"
    path.write_text(json.dumps(model_to_json(dataclasses.replace(made(), rig=rig))))
    outputs = [tmp_path / name for name in ("own", "given", "other")]
    given = [[], RIG, ["--counts-per-rev", "360"]]
    for out, options in zip(outputs, given, strict=True):
        assert main(["export", str(path), "--to", to, *options, "-o", str(out)]) == 0
    own, same, other = (texts(out) for out in outputs)
    assert own == same != other


def texts(out):
    files = [out] if out.is_file() else sorted(out.rglob("*.h"))
    assert files
    return [file.read_text() for file in files]


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        (["--to", "c"], "a C header needs --counts-per-rev and --supply"),
        (["--to", "c", *RIG, "--bandwidth", "90"], "would overshoot"),
        (["--to", "c", *RIG, "--position-bandwidth", "90"], "would overshoot"),
        (["--to", "c", *RIG, "--overshoot", "-3"], "from 0 to 60"),
        (["--to", "c", *RIG, "--full-scale", "0"], "full_scale = 0"),
        (["--to", "c", *RIG, "--period", "nan"], "period_s = nan"),
        (["--to", "json", "--counts-per-rev", "-1", "--supply", "7"], "counts_per_rev = -1"),
        (["--to", "wpilib", "--wheel-radius", "0"], "wheel radius"),
        (["--to", "mujoco", "--inertia", "-1"], "inertia = -1"),
        (["--to", "spice", "--resistance", "-1"], "resistance = -1"),
    ],
)
def test_what_cannot_be_is_one_sentence(file, tmp_path, capsys, options, sentence):
    out = tmp_path / "out"
    assert main(["export", str(file), *options, "-o", str(out)]) == 1
    said = capsys.readouterr().err
    assert sentence in said and said.count("\n") == 1 and not out.exists()


def test_a_format_that_does_not_exist_is_wrong_usage(file, capsys):
    assert main(["export", str(file), "--to", "simulink"]) == 2
    capsys.readouterr()


def test_no_model_is_a_sentence(tmp_path, capsys):
    assert main(["export", str(tmp_path / "none.json"), "--to", "json"]) == 1
    assert "cannot be read" in capsys.readouterr().err


def test_simulate_writes_a_recording(file, tmp_path, capsys):
    plan = tmp_path / "mine.toml"
    plan.write_text('period_ms = 5\n[[experiment]]\nkind = "step"\namplitude_V = 4\nduration_s = 0.5\n')
    out = tmp_path / "rec.csv"
    arguments = ["simulate", str(file), "--plan", str(plan), "-o", str(out), *RIG]
    assert main(arguments) == 0
    assert "2 segments, 160 ticks" in capsys.readouterr().out
    recording = read(out)
    assert [segment.kind for segment in recording.segments] == ["rest", "step"]
    assert recording.segments[1].count[-1] > 30
    first = out.read_bytes()
    assert main(arguments) == 0 and out.read_bytes() == first
    assert main([*arguments, "--seed", "7"]) == 0
    capsys.readouterr()


@pytest.mark.parametrize(
    ("plan", "options", "sentence"),
    [
        ('kind = "step"\namplitude_V = 4\nduration_s = 0.5', [], "add --counts-per-rev and --supply"),
        ('kind = "step"\namplitude_V = 9\nduration_s = 0.5', RIG, "more than the supply"),
        ('kind = "prbs"\namplitude_V = 4\norder = 8\nduration_s = 0.5', RIG, "order = 8"),
        ('kind = "dance"', RIG, "is not known"),
    ],
)
def test_a_plan_that_cannot_be_simulated_is_a_sentence(file, tmp_path, capsys, plan, options, sentence):
    (tmp_path / "mine.toml").write_text(f"period_ms = 5\n[[experiment]]\n{plan}\n")
    out = tmp_path / "rec.csv"
    assert main(["simulate", str(file), "--plan", str(tmp_path / "mine.toml"), "-o", str(out), *options]) == 1
    said = capsys.readouterr().err
    assert sentence in said and said.count("\n") == 1 and not out.exists()
