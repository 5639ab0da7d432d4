"""From the motor to its controller and back: recorded on the emulated board, found, exported as C, run on the board."""

import dataclasses

import numpy as np
import pytest
from testing.exported import DUTY_DELAY_S, Drawn, on_board

import jaxmotor as jm
from jaxmotor.cli import main
from jaxmotor.control import Hardware, measure_step, predict_step, speed_controller
from jaxmotor.present.exports import design, to_c

HARDWARE = Hardware(0.005, 617.4, 7.4, 250, DUTY_DELAY_S)
RIG = ["--counts-per-rev", "617.4", "--supply", "7.4", "--delay", f"{DUTY_DELAY_S}"]
REFERENCE = 16 * 15
"""[1/16 count per tick], 30.5 rad/s."""
REFERENCE_rad_s = REFERENCE / 16 / HARDWARE.counts_per_tick
TICKS = 300
FRICTION_V = 0.3


@pytest.fixture
def folder(emulator, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "rough.toml").write_text(f"[coulomb_friction]\nvolts_V = {FRICTION_V}\n")
    return tmp_path


def jaxmotor(*words):
    assert main([str(word) for word in words]) == 0, words


def ran(header, model, toml, folder):
    """Overshoot [%] and steady error [rad/s] of the header's speed loop on the board with the motor of `toml`."""
    count, _, _ = on_board(header, Drawn(HARDWARE, model, toml), REFERENCE, TICKS, folder)
    return measure_step(np.diff(count, prepend=count[0]) / HARDWARE.counts_per_tick, REFERENCE_rad_s)


def assert_predicted(found, model, kind):
    loop = speed_controller(model.whole, design(model, HARDWARE, kind=kind).speed, HARDWARE)
    predicted = predict_step(model, loop, HARDWARE, REFERENCE_rad_s, seconds=TICKS * HARDWARE.period_s)
    over, steady = predicted.overshoot_percent, predicted.steady_error
    assert over.low <= found[0] <= over.high and steady.low <= found[1] <= steady.high, (found, over, steady)


def test_from_a_recording_through_identify(folder):
    jaxmotor("record", "--port", "emulated", "--plan", "paper", "-o", "plain.csv")
    jaxmotor("identify", "plain.csv", "-o", "results")
    jaxmotor("export", "results/plain.json", "--to", "c", *RIG, "-o", "plain.h")
    model = jm.read_model("results/plain.json")
    assert_predicted(ran((folder / "plain.h").read_text(), model, "", folder), model, "PI")


def test_from_a_recording_with_friction_through_diagnose(folder):
    """The header makes up for the friction that was found; without it a P loop falls short by what friction takes."""
    toml = (folder / "rough.toml").read_text()
    jaxmotor("record", "--port", "emulated", "--plant", "rough.toml", "--plan", "full", "-o", "rough.csv")
    jaxmotor("diagnose", "rough.csv", "-o", "results")
    model = jm.read_model("results/rough-extended.json")
    [effect] = model.effects
    assert effect.name == "coulomb_friction" and float(effect.volts_V) == pytest.approx(FRICTION_V, rel=0.02)
    for kind in ("PI", "P"):
        jaxmotor("export", "results/rough-extended.json", "--to", "c", *RIG, "--kind", kind, "-o", f"{kind}.h")
        found = ran((folder / f"{kind}.h").read_text(), model, toml, folder)
        assert_predicted(found, model, kind)
    bare = dataclasses.replace(model, effects=(), effect_errors=())
    made = design(bare, HARDWARE, kind="P")
    without = ran(to_c(bare, made), bare, toml, folder)
    gain = float(model.motor.gain)
    assert without[1] == pytest.approx(gain * FRICTION_V / (1 + gain * made.speed.gain_V_s_rad), rel=0.1)
    assert abs(found[1]) < 0.1 * without[1]
