"""What people get wrong, in Python and on the command line: each is answered in one sentence, without a traceback."""

import json
import subprocess
import sys

import pytest

from jaxmotor.cli import main

SETUP = """
import json, sys
import numpy as np
import jaxmotor as jm
from jaxmotor.control import Hardware
from jaxmotor.estimate import Model
from jaxmotor.present.exports import design, to_c
from jaxmotor.recording import bundled
recording, t = bundled("linear"), np.arange(20) * 0.005
model = Model(jm.FirstOrder(np.array(10.0), np.array(40.0)), np.eye(2), 0.0, None, "m", frozenset(), "m.json")
def answer(code):
    try:
        eval(code)
    except Exception as error:
        return [isinstance(error, jm.JaxmotorError), str(error)]
    return [False, "nothing was wrong"]
print(json.dumps([answer(code) for code in json.load(sys.stdin)]))
"""
PYTHON = {
    'jm.identify("missing.csv")': "missing.csv: cannot be read",
    'jm.identify("")': "is not a file",
    "jm.identify(5)": "int is not a recording (a Recording, or the path of its file)",
    "jm.identify(None)": "NoneType is not a recording",
    "jm.identify(np.zeros(5))": "ndarray is not a recording",
    "jm.identify([recording])": "list is not a recording",
    "jm.identify(model)": "Model is not a recording",
    'jm.identify(recording, model="third")': "model is 'third', which is not known; it is one of first, second",
    'jm.identify(recording, method="nonsense")': "method is 'nonsense', which is not known; it is one of exact, paper",
    'jm.identify(recording, hold_out="jump")': "'jump' names no segments of linear.csv",
    "jm.identify(jm.from_arrays(time_s=t, volts=t + 1, speed_rad_s=t + 5, speed_window_s=20))": "window of 20 s lies",
    'jm.identify(recording, hold_out="ramp")': "has no segment of kind 'ramp'",
    "jm.identify(recording, hold_out=[99])": "there is no segment 99 to hold out; they are 0 to 25",
    "jm.identify(recording, hold_out=3.5)": "3.5 names no segments",
    "jm.identify(recording, hold_out=range(26))": "no segment is left to fit",
    'jm.identify(recording, seed="lucky")': "seed is 'lucky'; give a whole number",
    "jm.identify(recording, seed=-1)": "seed is -1; give a whole number, 0 or more",
    "jm.diagnose(t)": "ndarray is not a recording",
    'jm.diagnose(recording, effects=["frition"])': "the effect is 'frition', which is not known; it is one of",
    'jm.diagnose(recording, exclude="cogs")': "the effect is 'cogs', which is not known",
    "jm.diagnose(recording, on_progress=5)": "on_progress is 5; give a function",
    "jm.validate(recording, model)": "Recording is not a model (a Model, a Fit, a Diagnosis, or the path of a",
    "jm.validate(model, model)": "Model is not a recording",
    'jm.validate("missing.json", recording)': "missing.json: cannot be read",
    'jm.validate(model, recording, simulations="many")': "simulations is 'many'; give a whole number",
    "jm.to_control(recording)": "Recording is not a model",
    "jm.to_control(model, 0.005)": "float is not a Hardware",
    "jm.to_spice(None)": "NoneType is not a model",
    'jm.to_wpilib(recording.source)': "not a JSON file",
    "jm.to_python(t)": "ndarray is not a model",
    "to_c(model, Hardware(0.005, 617.4, 7.4))": "Hardware is not a Design",
    "design(model, model)": "Model is not a Hardware",
    "design(model)": "did not state period_s, counts_per_rev, supply_V; give hardware_of what is missing",
    "jm.from_arrays(time_s=t, volts=t, counts=t)": "counts need the counts per turn",
    'jm.from_dataframe({"t": t}, time_s="t")': "dict is no data frame",
    'jm.read_model("missing.json")': "missing.json: cannot be read",
}  # fmt: skip
COMMANDS = {
    "identify missing.csv": (1, "missing.csv: cannot be read"),
    "identify .": (1, "is not a file"),
    "diagnose linear.csv --effects friktion": (1, "the effect is 'friktion'"),
    "identify linear.csv --hold-out jump": (2, "'jump' names no segments"),
    "identify linear.csv --hold-out 99": (1, "there is no segment 99"),
    "identify linear.csv --method nonsense": (2, "nonsense"),
    "identify": (2, "Missing argument"),
    "identify linear.csv --resistance 4.5": (2, "belong together"),
    "diagnose model.json": (1, "not a recording"),
    "diagnose linear.csv --seed -1": (2, "--seed"),
    "validate linear.csv linear.csv": (1, "not a JSON file"),
    "validate missing.json linear.csv": (1, "missing.json: cannot be read"),
    "validate model.json": (2, "Missing argument"),
    "export model.json": (2, "--to"),
    "export model.json --to c": (1, "a C header needs --counts-per-rev"),
    "export linear.csv --to spice": (1, "not a JSON file"),
    "report missing.csv -o out": (1, "missing.csv: cannot be read"),
    "report linear.csv": (2, "--output"),
    "simulate missing.json": (2, "--plan"),
    "nonsense": (2, "No such command 'nonsense'"),
}
MODEL = '{"format": 1, "model": {"gain_rad_s_V": 10, "pole_rad_s": 40}, "covariance": [[1, 0], [0, 1]]}'


@pytest.fixture(scope="module")
def answers():
    """In a process of its own: types are not checked there as tests check them."""
    done = subprocess.run(
        [sys.executable, "-c", SETUP], input=json.dumps(list(PYTHON)), capture_output=True, text=True, check=False
    )
    assert (done.returncode, done.stderr) == (0, "")
    return dict(zip(PYTHON, json.loads(done.stdout), strict=True))


@pytest.mark.parametrize("code", PYTHON)
def test_python_answers_in_a_sentence(answers, code):
    is_ours, said = answers[code]
    assert is_ours and PYTHON[code] in said and said.isprintable(), said


@pytest.fixture
def folder(tmp_path, monkeypatch):
    from jaxmotor.recording import bundled, write

    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("JAXMOTOR_CACHE", "")
    write(bundled("linear"), "linear.csv")
    (tmp_path / "model.json").write_text(MODEL)
    return tmp_path


@pytest.mark.parametrize("command", COMMANDS)
def test_the_command_line_answers_in_a_sentence(folder, capsys, command):
    before = {path.name for path in folder.iterdir()}
    code, says = COMMANDS[command]
    assert main(command.split()) == code
    output, errors = capsys.readouterr()
    assert says in errors and "Traceback" not in errors and output == ""
    assert code == 2 or (errors.startswith("jaxmotor: ") and errors.count("\n") == 1)
    assert {path.name for path in folder.iterdir()} - before <= {"out"}
