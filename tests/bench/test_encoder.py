import json
import math
import subprocess
import sys

import numpy as np
import pytest
import typer
from hypothesis import given
from hypothesis import strategies as st
from typer.testing import CliRunner

from jaxmotor import JaxmotorError
from jaxmotor.bench import resolution_table, speed_resolution
from jaxmotor.cli._encoder import encoder_command

COUNTS = st.floats(1, 1e6)
PERIODS = st.floats(1e-5, 10)
TICKS = st.integers(1, 1000)


def test_the_paper_s_table_1():
    """5 ms at 617.4 counts give 19.4 rpm; the other rows follow from eq. 2."""
    rows = resolution_table(617.4, (0.005, 0.01, 0.02, 0.05, 0.1))
    assert [f"{row.resolution_rpm:.3g}" for row in rows] == ["19.4", "9.72", "4.86", "1.94", "0.972"]
    assert rows[0].resolution_rad_s == pytest.approx(2.0353694, rel=1e-7)
    assert rows[0].relative_error(2 * math.pi * 6) == pytest.approx(19.436346 / 360, rel=1e-7)


@given(COUNTS, PERIODS, TICKS)
def test_the_two_units_agree_and_the_error_goes_as_one_over_the_window(counts, period, ticks):
    one, many = speed_resolution(counts, period), speed_resolution(counts, period, ticks)
    assert one.resolution_rpm == pytest.approx(60 / (counts * period))
    assert many.resolution_rad_s * ticks == pytest.approx(one.resolution_rad_s)
    assert many.resolution_rad_s == pytest.approx(speed_resolution(counts, period * ticks).resolution_rad_s)
    assert many.delay_s == pytest.approx(ticks * period / 2)
    assert many.standard_deviation_rad_s**2 * 6 == pytest.approx(many.resolution_rad_s**2)


@given(COUNTS, PERIODS, st.floats(1e-3, 1e4))
def test_relative_error_is_the_resolution_over_the_speed(counts, period, speed):
    row = speed_resolution(counts, period)
    assert row.relative_error(speed) * speed == pytest.approx(row.resolution_rad_s)
    assert row.relative_error(-speed) == row.relative_error(speed)


@given(st.floats(-50, 50), TICKS)
def test_no_speed_is_off_by_more_than_one_count(speed, ticks):
    row = speed_resolution(617.4, 0.005, min(ticks, 50))
    time = np.arange(2000) * 0.005
    count = np.floor((1.234 + speed * time) * 617.4 / (2 * np.pi))
    seen = (count[row.ticks :] - count[: -row.ticks]) * 2 * np.pi / 617.4 / (0.005 * row.ticks)
    assert np.abs(seen - speed).max() <= row.resolution_rad_s * (1 + 1e-6)


def test_the_usual_error_is_the_standard_deviation():
    """Over speeds and encoder offsets drawn at random."""
    rng = np.random.default_rng(1)
    row = speed_resolution(617.4, 0.005, 3)
    speed, offset = rng.uniform(-100, 100, 200_000), rng.uniform(0, 1, 200_000)
    turned = speed * 0.015 * 617.4 / (2 * np.pi)
    seen = np.floor(turned + offset) * 2 * np.pi / 617.4 / 0.015
    assert np.std(seen - speed) == pytest.approx(row.standard_deviation_rad_s, rel=0.01)


@pytest.mark.parametrize("bad", [0, -1, math.nan, math.inf, -math.inf, 1e-320])
def test_bad_numbers_are_one_sentence(bad):
    for arguments in ((bad, 0.005), (617.4, bad)):
        with pytest.raises(JaxmotorError) as error:
            speed_resolution(*arguments)
        assert "\n" not in str(error.value)
    if bad != 1e-320:
        with pytest.raises(JaxmotorError, match="speed"):
            speed_resolution(617.4, 0.005).relative_error(bad if bad != -1 else 0)


def test_an_empty_window_is_refused():
    with pytest.raises(JaxmotorError, match="window"):
        speed_resolution(617.4, 0.005, 0)


def command(*arguments: str):
    app = typer.Typer()
    app.command()(encoder_command)
    return CliRunner().invoke(app, arguments)


def test_the_command_prints_table_1():
    result = command("--counts-per-rev", "617.4")
    assert result.exit_code == 0
    lines = result.stdout.splitlines()
    (row,) = [line.split() for line in lines if line.split()[:1] == ["5"]]
    assert row == ["5", "19.4", "2.04", "0.831", "2.5"]
    assert all(line == line.rstrip() for line in lines)
    assert len({len(line) for line in lines[4:]}) == 1, "columns are aligned"


def test_periods_speeds_and_windows_are_the_user_s():
    result = command(
        *("--counts-per-rev", "1000", "--period", "0.01", "--period", "0.002"),
        *("--speed", "10", "--rpm", "60", "--average", "5"),
    )
    lines = [line.split() for line in result.stdout.splitlines() if "%" in line]
    assert [line[0] for line in lines] == ["10", "2"]
    assert lines[0][5:] == ["1.26", "%", "2.00", "%"]
    assert "5 ticks" in result.stdout


def test_json_is_one_object_with_units_in_its_keys():
    result = command("--counts-per-rev", "617.4", "--period", "0.005", "--rpm", "360", "--json")
    (line,) = result.stdout.splitlines()
    content = json.loads(line)
    assert content["format"] == 1 and content["counts_per_rev"] == 617.4
    (row,) = content["rows"]
    assert row["resolution_rpm"] == pytest.approx(19.436346)
    assert row["relative_error"][0]["ratio"] == pytest.approx(19.436346 / 360)


def test_the_figure_is_written_into_a_folder(tmp_path):
    result = command("--counts-per-rev", "617.4", "--rpm", "360", "-o", str(tmp_path / "new" / "folder"))
    assert result.exit_code == 0
    assert sorted(path.name for path in (tmp_path / "new" / "folder").iterdir()) == ["encoder.png", "encoder.svg"]


@pytest.mark.parametrize(
    "arguments",
    [
        ("--counts-per-rev", "-5"),
        ("--counts-per-rev", "nan"),
        ("--counts-per-rev", "617.4", "--period", "0"),
        ("--counts-per-rev", "617.4", "--speed", "0"),
        ("--counts-per-rev", "617.4", "--average", "0"),
    ],
)
def test_bad_input_is_an_error_of_ours_and_writes_nothing(tmp_path, arguments):
    result = command(*arguments, "-o", str(tmp_path / "out"))
    assert isinstance(result.exception, JaxmotorError) and result.stdout == ""
    assert not (tmp_path / "out").exists()


def test_the_table_needs_neither_jax_nor_matplotlib():
    code = "import sys, jaxmotor.bench; print(*{'jax', 'matplotlib'} & set(sys.modules))"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == ""
