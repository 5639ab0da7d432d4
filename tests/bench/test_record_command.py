"""`jaxmotor record` as a person meets it."""

import pytest
import typer
from faults import PLAN

from jaxmotor._errors import JaxmotorError
from jaxmotor.cli._record import record_command
from jaxmotor.recording import read


@pytest.fixture
def plan(tmp_path):
    path = tmp_path / "plan.toml"
    path.write_text(PLAN)
    return str(path)


def test_a_plan_file_on_the_emulated_board(emulator, tmp_path, plan, capsys):
    record_command(tmp_path / "r.csv", "emulated", plan, supply=7.4, counts_per_rev=617.4, seed=3)
    said = capsys.readouterr().out.splitlines()
    assert said[-1].endswith("880 samples in 8 segments, one per 0.005 s, 0 lost")
    assert said[0].startswith("1/4 ")
    assert read(tmp_path / "r.csv").supply_V == 7.4


def test_live_fits_say_gain_and_phase(emulator, tmp_path, plan, capsys):
    record_command(tmp_path / "r.csv", "emulated", plan, live=True)
    fits = [line for line in capsys.readouterr().out.splitlines() if " Hz: " in line]
    # 10.6 rad/s/V and 40 rad/s; half a tick of hold is part of what is measured
    assert len(fits) == 2
    assert fits[0].startswith("2.007 Hz: 10.1") and " deg" in fits[0]


def test_what_contradicts_itself_is_wrong_usage(tmp_path):
    with pytest.raises(typer.BadParameter, match="--port"):
        record_command(tmp_path / "r.csv", None, "paper")
    with pytest.raises(typer.BadParameter, match="--seed"):
        record_command(tmp_path / "r.csv", "/dev/ttyUSB0", "paper", seed=1)


def test_mistakes_are_sentences(tmp_path):
    with pytest.raises(JaxmotorError, match="no such plant"):
        record_command(tmp_path / "r.csv", "emulated", "paper", plant=tmp_path / "none.toml")
    with pytest.raises(JaxmotorError, match="name a plan"):
        record_command(tmp_path / "r.csv", "emulated")
    with pytest.raises(JaxmotorError, match="nothing to continue"):
        record_command(tmp_path / "r.csv", recover=True)
