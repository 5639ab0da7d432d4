"""Logs without a column of what was applied: one step, whose voltage is stated."""

import numpy as np
import pytest
import typer
from scipy.io import savemat
from typer.testing import CliRunner

from jaxmotor.cli._import import import_command
from jaxmotor.recording import RecordingError, import_log, read

ROWS = 40
PERIOD_S = 0.02
SPEED = np.round(10 * -np.expm1(-PERIOD_S * np.clip(np.arange(ROWS) - 5, 0, None) / 0.1), 3)
WITHOUT = "t,w\n" + "".join(f"{PERIOD_S * row:.2f},{speed}\n" for row, speed in enumerate(SPEED))
TWICE = WITHOUT + WITHOUT.partition("\n")[2]
APP = typer.Typer()
APP.command()(import_command)


def with_column(volts):
    rows = WITHOUT.splitlines()
    return "\n".join(["t,w,u", *(f"{row},{volt}" for row, volt in zip(rows[1:], volts, strict=True))]) + "\n"


@pytest.fixture
def imported(tmp_path):
    def of(text, time="t", **flags):
        path = tmp_path / "log.csv"
        path.write_text(text)
        return import_log(path, time=time, speed="w:rad/s", **flags)

    return of


@pytest.mark.parametrize(("at_s", "row"), [(None, 0), (0.1, 5), (0.095, 5), (0.78, ROWS - 1)])
def test_it_is_what_a_column_of_it_would_say(imported, at_s, row):
    volts = np.where(np.arange(ROWS) < row, 0, -9)
    stated, of_column = imported(WITHOUT, step_V=-9, step_at_s=at_s), imported(with_column(volts), input="u:V")
    [one], [other] = stated.segments, of_column.segments
    np.testing.assert_array_equal(one.volts, other.volts)
    np.testing.assert_array_equal(one.time_s, other.time_s)
    np.testing.assert_array_equal(one.speed_rad_s, other.speed_rad_s)
    assert one.at_rest == other.at_rest and stated.supply_V is None
    assert stated.header["imported"]["step_V"] == -9.0
    assert stated.header["imported"].get("step_at_s") == at_s


@pytest.mark.parametrize(
    ("at_s", "until_s", "rows"), [(None, 0.3, (0, 15)), (0.1, 0.305, (5, 16)), (0.1, 9, (5, ROWS))]
)
def test_it_may_have_an_end(imported, at_s, until_s, rows):
    recording = imported(WITHOUT, step_V=3.0, step_at_s=at_s, step_until_s=until_s)
    row = np.arange(ROWS)
    expected = np.where((row >= rows[0]) & (row < rows[1]), 3.0, 0.0)
    np.testing.assert_array_equal(recording.segments[0].volts, expected)
    assert recording.header["imported"]["step_until_s"] == until_s


def test_each_segment_has_its_own(imported):
    recording = imported(TWICE, segment="t", step_V=3.0, step_at_s=0.1)
    driven = np.arange(ROWS) >= 5
    assert len(recording.segments) == 2
    for segment in recording.segments:
        np.testing.assert_array_equal(segment.volts, np.where(driven, 3.0, 0.0))
        assert segment.at_rest


def test_rows_without_stamps_and_rows_that_are_left_out(imported):
    recording = imported(WITHOUT, time=None, period_s=0.01, drop_first=3, step_V=3.0, step_at_s=0.05)
    np.testing.assert_array_equal(recording.segments[0].volts, np.where(np.arange(ROWS - 3) < 5, 0.0, 3.0))


def test_a_file_of_matlab_may_lack_it_too(tmp_path):
    savemat(tmp_path / "log.mat", {"t": PERIOD_S * np.arange(ROWS), "w": SPEED})
    recording = import_log(tmp_path / "log.mat", time="t", speed="w:rad/s", step_V=3.0, step_at_s=0.1)
    np.testing.assert_array_equal(recording.segments[0].volts, np.where(np.arange(ROWS) < 5, 0.0, 3.0))


def test_a_column_of_that_name_stays_what_it_is(imported):
    recording = imported(WITHOUT.replace("t,w", "step,w"), time="step", step_V=3.0)
    assert set(recording.segments[0].volts) == {3.0}


@pytest.mark.parametrize(
    ("stated", "said"),
    [
        ({"step_V": 3.0, "input": "w:V"}, "input and step_V both say"),
        ({"step_V": 3.0, "input_acts": "before"}, "step_V says from which row on"),
        ({"step_V": 3.0, "input_holds": True}, "step_V says from which row on"),
        ({"step_at_s": 1.0}, "state its voltage, too (step_V)"),
        ({"step_until_s": 1.0}, "state its voltage, too (step_V)"),
        ({"step_V": 3.0, "step_at_s": 0.5, "step_until_s": 0.5}, "step_until_s is 0.5; give seconds"),
        ({"step_V": 3.0, "step_until_s": np.nan}, "step_until_s is nan; give seconds"),
        (
            {"step_V": 3.0, "step_at_s": 0.105, "step_until_s": 0.115},
            "line 2: the segment that begins here lasts 0.78 s; no row of it is between step_at_s 0.105",
        ),
        ({"step_V": 0.0}, "step_V is 0; give the volts"),
        ({"step_V": np.nan}, "step_V is nan"),
        ({"step_V": 3.0, "step_at_s": -1.0}, "step_at_s is -1; give the seconds"),
        (
            {"step_V": 3.0, "step_at_s": 1.0},
            "line 2: the segment that begins here lasts 0.78 s; step_at_s 1 is after it",
        ),
        ({}, "no column 'u_V'"),
    ],
)
def test_what_cannot_be_is_refused_in_a_sentence(imported, stated, said):
    with pytest.raises(RecordingError) as caught:
        imported(WITHOUT, **stated)
    assert said in str(caught.value) and "\n" not in str(caught.value)


def command(folder, *options):
    (folder / "log.csv").write_text(WITHOUT)
    return CliRunner().invoke(APP, [str(folder / "log.csv"), "-o", str(folder / "made.csv"), *options])


def test_the_command_takes_it(tmp_path):
    done = command(tmp_path, "--time", "t", "--step", "9", "--step-at", "0.1", "--speed", "w:rad/s")
    assert done.exit_code == 0, done.output
    assert set(read(tmp_path / "made.csv").segments[0].volts) == {0.0, 9.0}
    options = ("--time", "t", "--step", "9", "--step-until", "0.3", "--speed", "w:rad/s", "--force")
    done = command(tmp_path, *options)
    assert done.exit_code == 0, done.output
    np.testing.assert_array_equal(np.flatnonzero(read(tmp_path / "made.csv").segments[0].volts), np.arange(15))


def test_the_command_says_what_may_be_stated(tmp_path):
    done = command(tmp_path, "--time", "t", "--speed", "w:rad/s")
    assert done.exit_code == 2 and "--step" in done.output
    done = command(tmp_path, "--steady", "1", "--period", "0.1", "--input", "t:V", "--speed", "w:rad/s", "--step", "3")
    assert done.exit_code == 2 and "--step" in done.output
