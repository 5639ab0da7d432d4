"""`jaxmotor export` and `jaxmotor simulate`: files written whole, and bad input as a sentence."""

import dataclasses
import json

import pytest
from cases import made

from jaxmotor import read
from jaxmotor._errors import JaxmotorError
from jaxmotor.cli import main
from jaxmotor.control import Hardware, hardware_of
from jaxmotor.estimate import ModelRig, model_to_json

RIG = ["--counts-per-rev", "617.4", "--supply", "7.4"]
DUTIES = ["--full-scale", "400", "--delay", "1e-3"]


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
    said = capsys.readouterr()
    assert said.out == f"wrote {out}\n" and ("is a guess" in said.err) == (to in ("mujoco", "spice"))
    text = out.read_text()
    assert "backlash" in text and (to != "mujoco" or "<script>" not in text)
    assert main(["export", str(file), "--to", to, *RIG]) == 0
    assert capsys.readouterr().out == text


def kept(folder, rig, **about):
    """A model file of a recording that stated `rig`."""
    path = folder / "rigged.json"
    path.write_text(json.dumps(model_to_json(dataclasses.replace(made(), rig=rig, **about))))
    return path


def exported(path, out, to, options=()):
    """The text that is written."""
    assert main(["export", str(path), "--to", to, *options, "-o", str(out)]) == 0
    files = [out] if out.is_file() else sorted(out.rglob("*.h"))
    assert files
    return [file.read_text() for file in files]


@pytest.mark.parametrize(
    ("to", "others"),
    [
        *((to, ("--counts-per-rev 360", "--supply 9", "--full-scale 255", "--delay 0")) for to in ("c", "arduino")),
        ("json", ("--counts-per-rev 360", "--supply 9", "--full-scale 255", "--delay 0", "--period 0.01")),
        ("control", ("--delay 0", "--period 0.01")),
        ("mujoco", ("--supply 9",)),
    ],
)
def test_the_rig_of_the_recording_is_taken_where_no_other_is_given(tmp_path, to, others):
    known, empty = kept(tmp_path, ModelRig(617.4, 7.4, 400.0, 1e-3)), tmp_path / "bare.json"
    own = exported(known, tmp_path / "own", to)
    assert exported(known, tmp_path / "same", to, [*RIG, *DUTIES]) == own
    for number, other in enumerate(others):
        assert exported(known, tmp_path / f"other{number}", to, other.split()) != own, other
    if to != "json":
        # A file of the earlier format, which has nothing but a period.
        content = json.loads(known.read_text())
        for key in ModelRig._fields:
            del content[key]
        empty.write_text(json.dumps(content))
        assert exported(empty, tmp_path / "stated", to, [*RIG, *DUTIES]) == own


def test_json_has_the_controllers_of_the_rig_that_it_knows(tmp_path, capsys):
    known = kept(tmp_path, ModelRig(617.4, 7.4, 400.0, 1e-3))
    content = json.loads(exported(known, tmp_path / "known", "json")[0])
    rig = {"period_s": 0.005, "counts_per_rev": 617.4, "supply_V": 7.4, "full_scale": 400, "delay_s": 1e-3}
    assert content["rig"] == rig and content["speed_loop"]["bandwidth_Hz"] > 0
    part = kept(tmp_path, ModelRig(counts_per_rev=617.4))
    assert json.loads(exported(part, tmp_path / "part", "json")[0])["rig"] is None
    assert not capsys.readouterr().err


def test_json_does_without_controllers_that_nobody_asked_for(tmp_path, capsys):
    slow = kept(tmp_path, ModelRig(617.4, 7.4), period_s=3.0)
    assert json.loads(exported(slow, tmp_path / "slow", "json")[0])["speed_loop"] is None
    said = capsys.readouterr().err
    assert said.startswith("jaxmotor: without controllers: period_s = 3 is longer") and said.count("\n") == 1
    assert main(["export", str(slow), "--to", "json", *RIG]) == 1


def test_duties_that_are_no_whole_numbers_are_not_a_controllers():
    model = dataclasses.replace(made(), rig=ModelRig(617.4, 7.4, 1.5))
    assert hardware_of(model) == Hardware(0.005, 617.4, 7.4)
    assert hardware_of(model, full_scale=100, delay_s=1e-4) == Hardware(0.005, 617.4, 7.4, 100, 1e-4)
    with pytest.raises(JaxmotorError, match="did not state counts_per_rev, supply_V; give"):
        hardware_of(made())


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
    known = json.loads(file.read_text()) | ModelRig(617.4, 7.4, 400.0, 1e-3)._asdict()
    file.write_text(json.dumps(known))
    assert main(arguments[: -len(RIG)]) == 0
    again = read(out)
    assert (again.counts_per_rev, again.supply_V, again.duty_full_scale, again.duty_delay_s) == (617.4, 7.4, 400, 1e-3)


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
