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
from jaxmotor import present
from jaxmotor.control import Hardware
from jaxmotor.estimate import Model
from jaxmotor.motor.effects import vocabulary
from jaxmotor.present.exports import design, to_c, write_library
from jaxmotor.recording import bundled
recording, t = bundled("linear"), np.arange(20) * 0.005
rig = Hardware(0.005, 617.4, 7.4)
class Frame(dict):
    columns, index = ["u"], t
def made(**given):
    return jm.from_arrays(**{"time_s": t, "volts": t, "speed_rad_s": t} | given)
def duties(**given):
    return made(volts=None, duty=t, **given)
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
    "jm.read(5)": "int is not the path of a recording",
    "jm.read(None)": "NoneType is not the path of a recording",
    "jm.read_model(5)": "int is not the path of a model file",
    "jm.write(recording, 5)": "int is not a path to write to",
    'jm.write("x", "y.csv")': "str is not a Recording",
    "jm.join(recording)": "Recording is not a list of recordings",
    'jm.join("missing.csv")': "missing.csv: cannot be read",
    "jm.join([recording, 5])": "int is not a recording",
    'jm.join([recording, "missing.csv"])': "missing.csv: cannot be read",
    "jm.check(5)": "int is not a recording",
    'jm.check("missing.csv")': "missing.csv: cannot be read",
    "jm.fit_response(5)": "int is not a FrequencyResponse",
    "jm.fit_response(None)": "NoneType is not a FrequencyResponse",
    "made(name=5)": "name is 5; give a text",
    'made(name="")': "name is ''; give a text",
    'made(speed_rad_s=None, counts=t, counts_per_rev="617")': "counts_per_rev is '617'; it is a positive number",
    'made(speed_window_s="a")': "speed_window_s is 'a'; give seconds",
    'made(input_acts="later")': "input_acts is 'later', which is not known; it is one of after, before",
    'made(drive="slow")': "drive = 'slow' is not known",
    "made(time_s=np.zeros((20, 20)))": "arrays: time_s has 2 dimensions; give arrays (n,) of one length",
    "made(time_s=5)": "arrays: time_s has one number only; give arrays",
    "made(time_s=[])": "arrays: time_s has no rows; give arrays",
    "made(volts=[[1, 2], [[3], 2]])": "volts holds object, not numbers",
    'duties(duty_full_scale="255", supply_V=7)': "duty_full_scale is '255'; it is a positive number",
    "duties(duty_full_scale=255, supply_V=True)": "supply_V holds bool, not numbers",
    "duties(duty_full_scale=255)": "(supply_V); where nobody knows it, supply_unknown",
    'jm.from_dataframe(Frame(u=t), volts="u", nonsense="x")': "'nonsense' is not known; name a column as volts, duty,",
    "jm.import_log(5)": "int is not the path of a log",
    'jm.import_log("missing.csv")': "exactly one of speed, angle, count and pulses is needed",
    'jm.import_log("missing.csv", speed=5)': "speed is 5; give a text",
    'jm.import_log("missing.csv", speed="n:rpm")': "missing.csv: cannot be read",
    'jm.import_log("missing.csv", speed="n:rpm", input_acts="later")': "input_acts is 'later', which is not known",
    'jm.import_log("missing.csv", speed="n:rpm", drive="slow")': "drive is 'slow', which is not known",
    'jm.import_log("missing.csv", speed="n:rpm", supply_V=-1)': "supply_V is -1; it is a positive number",
    'jm.import_log("missing.csv", speed="n:rpm", speed_window_s=-1)': "speed_window_s is -1; give seconds",
    'jm.import_log("missing.csv", speed="n:rpm", drop_first="a")': "drop_first is 'a'; give a whole number",
    'jm.import_log("missing.csv", count="n", wrap="a")': "wrap is 'a'; it is the width of the counter",
    "jm.import_sysid(5)": "int is not the path of a SysId log",
    'jm.import_sysid("missing.csv", units="meters", wheel_radius_m="a")': "wheel_radius_m is 'a'; it is a positive",
    'jm.import_steady(5, input="u:V", speed="n:rpm", period_s=0.005)': "int is not the path of a log",
    'jm.import_steady("missing.csv", input="u:V", speed="n:rpm", period_s="a")': "period_s is 'a'; it is a positive",
    'jm.identify(recording, hold_out={"step": 1})': "a table names no segments of linear.csv",
    'jm.identify(recording, hold_out=",")': "',' names no segments of linear.csv",
    'jm.identify(recording, model="second", method="paper")': "the paper's method is of first order",
    "jm.diagnose(recording, exclude=list(vocabulary()))": "no effect is left to look for",
    'jm.diagnose(recording, effects="stiction", exclude="stiction")': "no effect is left to look for",
    "jm.validate(jm.identify(recording), recording)": "hold some out (hold_out of identify, --hold-out)",
    'jm.to_spice(model, resistance_ohm="a")': "resistance is 'a'; give a number",
    'jm.to_mujoco(model, inertia_kgm2="a")': "inertia is 'a'; give a number",
    'jm.to_wpilib(model, "a")': "wheel radius is 'a'; give a number",
    'Hardware("a", 617.4, 7.4)': "period_s is 'a'; give a number",
    'Hardware(0.005, 617.4, 7.4, "a")': "full_scale is 'a'; give a whole number",
    'Hardware(0.005, 617.4, 7.4, delay_s="a")': "delay_s is 'a'; give a number",
    'design(model, rig, overshoot_percent="a")': "the overshoot is 'a'; give a number",
    'design(model, rig, bandwidth_Hz="a")': "the bandwidth is 'a'; give a number",
    "write_library(5, {})": "int is not the path of a folder",
    'write_library("x", 5)': "int is not a library",
    "present.overview(5)": "recording is no Recording, but of type int",
    'present.overview("linear.csv")': "recording is no Recording, but of type str",
    "present.residual_voltage(model)": "diagnosis is no Diagnosis, but of type Model",
    "present.simulation(recording)": "fit is no Fit or OpenLoop, but of type Recording",
    "present.simulation(model, recording)": "fit is no Fit or OpenLoop, but of type Model",
    "present.residuals(model)": "fit is no Fit, but of type Model",
    "present.bode(recording)": "frequency_response is no FrequencyResponse, but of type Recording",
    "present.bode_models(None, [])": "frequency_response is no FrequencyResponse, but of type NoneType",
    'present.zoh_bode("a")': "period_s is no number, but of type str",
    "present.zoh_bode(0)": "period_s = 0 is not positive",
    "present.zoh_bode(0.005, recording)": "motor is no AbstractLinearMotor, but of type Recording",
    "present.encoder(617.4, [5])": "rows is no list of SpeedResolution",
    "present.learned(5)": "laws is no list of LearnedLaw, but of type int",
    "present.autocorrelation(5)": "residuals is no dict, but of type int",
    "present.causes(model)": "diagnosis is no Diagnosis",
    "present.probabilities(model)": "diagnosis is no Diagnosis",
    "present.before_after(model)": "diagnosis is no Diagnosis",
    "present.loop_before_after(model)": "gain is no LoopGain",
    "present.population_figure(model)": "population is no Population",
    "present.position_drift(5, 0)": "recording is no Recording",
    'present.sine_fit(recording, "a")': "segment is no whole number, but of type str",
    "present.step(5)": "compared is no Compared",
    "present.closed_loop(5, 5)": "speed is no Compared",
    "present.step_trials(5)": "trials is no StepTrials",
    "present.controller(5)": "loop is no ClosedLoop",
    'present.save(5, "x.png")': "int is not a figure of matplotlib",
}  # fmt: skip
COMMANDS = {
    "identify missing.csv": (1, "missing.csv: cannot be read"),
    "identify .": (1, "is not a file"),
    "diagnose linear.csv --effects friktion": (1, "the effect is 'friktion'"),
    "identify linear.csv --hold-out jump": (2, "'jump' names no segments"),
    "identify linear.csv --hold-out ,": (2, "',' names no segments"),
    "identify linear.csv --model second --method paper": (1, "the paper's method is of first order"),
    "diagnose linear.csv --effects ,": (2, "--effects names no effect"),
    "diagnose linear.csv --effects stiction --exclude stiction": (1, "no effect is left to look for"),
    "import linear.csv -o x.csv --time t --input u:V --count n --supply -1": (1, "--supply is -1; it is a positive"),
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
    "export model.json --to spice --inertia 1e-4": (2, "--inertia belongs to --to mujoco"),
    "report missing.csv -o out": (1, "missing.csv: cannot be read"),
    "report missing.parquet -o out": (1, "missing.parquet: is not a file"),
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
