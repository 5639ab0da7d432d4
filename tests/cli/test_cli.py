"""The command line as a user meets it: exit codes, one sentence on the error stream, nothing half-written."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from testing.made import recording, sine, step

from jaxmotor.cli import main
from jaxmotor.cli._main import build
from jaxmotor.recording import to_text, write

ROOT = Path(__file__).parent.parent.parent
CONTRACT = ROOT.parent / "shared" / "contract.py"
RUNS = [sine(f) for f in (0.703, 2.009, 6.019)] + [step(5.1), step(-3.0), step(5.1)]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("cli")
    write(recording(0, runs=RUNS), folder / "m1.csv")
    write(recording(1, gain=9.0, runs=RUNS), folder / "m2.csv")
    (folder / "bad.csv").write_text((folder / "m1.csv").read_text()[:-300])
    return folder


def run(capsys, *arguments):
    code = main([str(argument) for argument in arguments])
    streams = capsys.readouterr()
    print(streams.err)
    return code, streams.out, streams.err


def one_sentence(error):
    assert error.startswith("jaxmotor: ") and error.count("\n") == 1 and "Traceback" not in error


def test_identify_for_people(capsys, folder):
    code, out, err = run(capsys, "identify", folder / "m1.csv", "--hold-out", "5")
    assert (code, err) == (0, "")
    assert out.startswith("m1.csv\n  gain    11.0") and "rad/s/V" in out and "held out 5" in out


def test_identify_as_json_keeps_the_contract(capsys, folder):
    code, out, _ = run(capsys, "identify", folder / "m1.csv", folder / "m2.csv", "--json")
    lines = [json.loads(line) for line in out.splitlines()]
    assert code == 0 and [line["recording"] for line in lines] == ["m1.csv", "m2.csv"]
    assert lines[1]["model"]["gain_rad_s_V"] == pytest.approx(9.0, rel=1e-3)
    assert lines[0]["model"].keys() == lines[0]["standard_error"].keys()
    if not CONTRACT.exists():
        pytest.skip("no contract.py beside the checkout: the JSON was only held against this test")
    held = subprocess.run(
        [sys.executable, CONTRACT, "identify"], input=out, text=True, capture_output=True, check=False
    )
    assert (held.returncode, held.stdout) == (0, "2 of 2 lines hold\n")


def test_check_says_what_is_there_and_what_weakens_an_estimate(capsys, folder, tmp_path):
    segments = [(segment.volts, segment.count) for segment in recording(0, runs=RUNS).segments]
    rows = sum(len(volts) for volts, _ in segments)
    code, out, err = run(capsys, "check", folder / "m1.csv")
    assert (code, err) == (0, "")
    assert f"m1.csv: count; {rows} rows in 6 segments (3 sine, 3 step)" in out and "nothing to warn of" in out
    turned = [line.split(",") for line in (folder / "m1.csv").read_text().splitlines() if not line.startswith("#")]
    at = turned[0].index("count")
    back = [[*row[:at], str(-int(row[at])), *row[at + 1 :]] for row in turned[1:]]
    header = [line for line in (folder / "m1.csv").read_text().splitlines() if line.startswith("#")]
    (tmp_path / "back.csv").write_text("\n".join([*header, *map(",".join, [turned[0], *back])]) + "\n")
    code, out, _ = run(capsys, "check", tmp_path / "back.csv", folder / "bad.csv", folder / "m1.csv", "--json")
    first, second = map(json.loads, out.strip().splitlines())
    assert code == 1 and (first["recording"], second["recording"]) == ("back.csv", "m1.csv")
    assert first["rows"] == rows and second["notes"] == [] and len(first["notes"]) == 1
    assert second["volts_V"] == [min(v.min() for v, _ in segments), max(v.max() for v, _ in segments)]


def test_one_bad_file_does_not_stop_the_others(capsys, folder):
    code, out, err = run(capsys, "identify", folder / "bad.csv", folder / "m2.csv", "--json")
    assert code == 1 and json.loads(out)["recording"] == "m2.csv"
    one_sentence(err)
    assert "bad.csv" in err and "line" in err


def test_the_papers_method_says_what_it_lacks(capsys, folder):
    code, out, _ = run(capsys, "identify", folder / "m1.csv", "--method", "paper")
    assert code == 0 and "its model lacks" in out


def test_eq_10_with_a_multimeter(capsys, folder):
    code, out, _ = run(capsys, "identify", folder / "m1.csv", "--resistance", "4.5", "--inductance", "524e-6")
    assert code == 0 and "measured L/R is 0.116 ms" in out
    assert run(capsys, "identify", folder / "m1.csv", "--resistance", "4.5")[0] == 2


def test_model_and_figures_are_written_and_validate(capsys, folder, tmp_path):
    out = tmp_path / "new" / "folder"
    code, text, _ = run(capsys, "identify", folder / "m1.csv", "--hold-out", "4-5", "-o", out)
    assert code == 0
    written = sorted(path.name for path in out.iterdir())
    assert {"m1.json", "m1-bode.png", "m1-models.png", "m1-simulation.png"} <= set(written)
    assert all(f"wrote {out / name}" in text for name in written)
    code, text, err = run(capsys, "validate", out / "m1.json", folder / "m1.csv", "--json")
    assert (code, err) == (0, "")
    assert json.loads(text)["scored_segments"] == [4, 5] and json.loads(text)["fitted_segments"] == [0, 1, 2, 3]
    code, text, _ = run(capsys, "validate", out / "m1.json", folder / "m2.csv")
    assert code == 0 and "m2.csv against m1.json" in text


def test_validating_on_what_was_fitted_is_refused(capsys, folder, tmp_path):
    run(capsys, "identify", folder / "m1.csv", "-o", tmp_path)
    code, _, err = run(capsys, "validate", tmp_path / "m1.json", folder / "m1.csv")
    assert code == 1 and "--hold-out" in err
    one_sentence(err)


SPOILED = {
    "empty": b"",
    "binary": bytes(range(256)) * 20,
    "another table": b"t,u,y\n0,1,2\n",
    "newer": b"# jaxmotor recording 3\n",
    "not text": "# jaxmotor recording 1\n".encode("utf-16"),
    "only a header": b"# jaxmotor recording 1\n# period_s = 0.005\n",
}


@pytest.mark.parametrize("kind", SPOILED)
@pytest.mark.parametrize("command", ["identify", "validate"])
def test_damage_is_one_sentence_and_leaves_nothing(capsys, folder, tmp_path, kind, command):
    path = tmp_path / "spoiled.csv"
    path.write_bytes(SPOILED[kind])
    model = tmp_path / "model.json"
    model.write_text('{"format": 1, "model": {"gain_rad_s_V": 11, "pole_rad_s": 40}, "covariance": [[1, 0], [0, 1]]}')
    arguments = [path, "-o", tmp_path / "out"] if command == "identify" else [model, path]
    code, out, err = run(capsys, command, *arguments)
    assert (code, out) == (1, "")
    one_sentence(err)
    assert "spoiled.csv" in err
    assert not (tmp_path / "out").exists() or not list((tmp_path / "out").iterdir())


def changed(**columns):
    """The recording with columns of every segment replaced."""
    import dataclasses

    made = recording(0, runs=RUNS)
    segments = [
        dataclasses.replace(segment, **{name: change(segment) for name, change in columns.items()})
        for segment in made.segments
    ]
    return dataclasses.replace(made, segments=tuple(segments))


@pytest.mark.parametrize(
    "made, words",
    [
        (lambda: changed(count=lambda s: np.zeros(len(s), np.int64)), "never moved"),
        (lambda: changed(volts=lambda s: np.zeros(len(s))), "input is 0 V throughout"),
        (lambda: changed(count=lambda s: s.count + (np.arange(len(s)) == 50) * 5000), "jump|count"),
        (lambda: changed(parameters=lambda s: {**s.parameters, "frequency_Hz": 150.0}), "Nyquist"),
        (lambda: recording(0, runs=[sine(5.017)]), "one frequency"),
        (lambda: recording(0, runs=[("ramp", {}, np.linspace(0, 5, 4000))]), "pole is not determined"),
    ],
)
def test_data_that_determine_nothing(capsys, tmp_path, made, words):
    path = tmp_path / "odd.csv"
    path.write_text(to_text(made()))
    code, out, err = run(capsys, "identify", path, "-o", tmp_path / "out")
    assert (code, out) == (1, "")
    one_sentence(err)
    import re

    assert re.search(words, err) and "odd.csv" in err
    assert not (tmp_path / "out").exists()


def test_ten_million_rows_are_refused_without_being_parsed(capsys, tmp_path):
    path = tmp_path / "huge.csv"
    text = to_text(recording(0, runs=RUNS[-1:]))
    head, _, _ = text.partition("\n0,0,")
    with path.open("w") as file:
        file.write(head + "\n")
        row = "0,0,0.0,0\n"
        for _ in range(100):
            file.write(row * 100_000)
    code, _, err = run(capsys, "identify", path)
    assert code == 1 and "rows" in err
    one_sentence(err)


def test_an_output_in_the_way_is_a_sentence(capsys, folder, tmp_path):
    (tmp_path / "file").write_text("mine")
    code, _, err = run(capsys, "identify", folder / "m1.csv", "-o", tmp_path / "file")
    assert code == 1 and (tmp_path / "file").read_text() == "mine"
    one_sentence(err)


def test_two_recordings_of_one_name_do_not_overwrite_each_other(capsys, folder, tmp_path):
    (tmp_path / "m1.csv").write_text((folder / "m1.csv").read_text())
    code, _, err = run(capsys, "identify", folder / "m1.csv", tmp_path / "m1.csv", "-o", tmp_path / "out")
    assert code == 1 and "called m1" in err
    one_sentence(err)


@pytest.mark.parametrize("arguments", [["identify"], ["nonsense"], ["identify", "x.csv", "--method", "magic"], []])
def test_wrong_usage_is_two(capsys, arguments):
    code, _, _ = run(capsys, *arguments)
    assert code == 2


def test_a_defect_of_ours_is_no_traceback(capsys, monkeypatch, folder):
    import jaxmotor.recording

    def broken(path):
        raise RuntimeError("unforeseen")

    monkeypatch.setattr(jaxmotor.recording, "read", broken)
    code, _, err = run(capsys, "identify", folder / "m1.csv")
    assert code == 3 and "defect of jaxmotor" in err and "Traceback" not in err


def test_interruption_is_130(capsys, monkeypatch, folder):
    import jaxmotor.recording

    def interrupted(path):
        raise KeyboardInterrupt

    monkeypatch.setattr(jaxmotor.recording, "read", interrupted)
    assert run(capsys, "identify", folder / "m1.csv")[0] == 130


def test_help_waits_for_no_numerics():
    code = (
        "import sys; from jaxmotor.cli import main; main(['--help']);"
        "assert not {'jax', 'numpy', 'matplotlib', 'optimistix'} & set(sys.modules), 'heavy'"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "identify" in done.stdout


def commands():
    return {info.name: info.callback for info in build().registered_commands}


def test_every_command_and_option_is_documented(capsys):
    docs = (ROOT / "docs" / "command-line.md").read_text()
    import re

    for name in commands():
        assert f"jaxmotor {name}" in docs, name
        _, text, _ = run(capsys, name, "--help")
        for option in set(re.findall(r"--[a-z][a-z-]+", text)) - {"--help"}:
            assert f"`{option}" in docs, (name, option)


def test_demo_runs_from_anywhere(capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    code, out, err = run(capsys, "demo", "-o", tmp_path / "pictures")
    assert (code, err) == (0, "")
    figures = list((tmp_path / "pictures").glob("*.png"))
    assert len(figures) >= 12 and f"the models and {len(figures)} figures are in {tmp_path / 'pictures'}\n" in out
    assert out.endswith(f"all of it on one page: {tmp_path / 'pictures' / 'paper.html'}\n")
    page = (tmp_path / "pictures" / "paper.html").read_text(encoding="utf-8")
    assert 'id="verdict">extended' in page and "Coulomb friction" in page and "Closed loop, P 0.4" in page


def test_a_cache_that_cannot_be_used_costs_only_time(tmp_path):
    """No folder to be made, then one whose files are damaged: the answer is the same, and nothing is complained of."""
    write(recording(1, gain=9.0, runs=[step(5.1), step(-3.0)]), tmp_path / "steps.csv")
    command = [sys.executable, "-m", "jaxmotor", "identify", str(tmp_path / "steps.csv"), "--json"]

    def identified(cache):
        environment = os.environ | {"JAXMOTOR_CACHE": str(cache)}
        done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
        # On a slow machine it says every five seconds what it does.
        complaints = [line for line in done.stderr.splitlines() if not re.fullmatch(r"\d+ s: linear fit", line)]
        assert (done.returncode, complaints) == (0, [])
        return json.loads(done.stdout)["model"]

    (tmp_path / "file").write_text("in the way")
    model = identified(tmp_path / "cache")
    kept = list((tmp_path / "cache").glob("*.program"))
    assert len(kept) >= 2
    # Loaded as they are, by another process, LAPACK's part of them too.
    assert identified(tmp_path / "cache") == model
    assert {*(tmp_path / "cache").glob("*.program")} == {*kept}
    for number, path in enumerate(kept):
        path.write_bytes(path.read_bytes()[:-1] if number else os.urandom(5000))
    assert identified(tmp_path / "cache") == model
    assert identified(tmp_path / "file" / "cache") == model


@pytest.mark.parametrize("kind", [("--steady", "1", "--period", "0.1"), ("--from", "sysid")])
def test_an_option_that_is_refused_is_called_as_it_is_stated(capsys, folder, kind):
    """Whatever the argument's name is within."""
    columns = ("--input", "a:V", "--speed", "b:rpm") if "--steady" in kind else ()
    for option, value in [("--speed-pulses", 3), ("--step", 2), ("--gap", 1), ("--supply-column", "u:V"), ("--end", 1)]:
        code, _, err = run(capsys, "import", folder / "m1.csv", "-o", "x.csv", *kind, *columns, option, value)
        assert code == 2 and f"leave {option} out" in err
