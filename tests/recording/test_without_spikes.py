"""Speeds and angles that no motor has are no readings where that is asked for."""

import numpy as np
import pytest
import typer
from typer.testing import CliRunner

from jaxmotor.cli._import import import_command
from jaxmotor.recording import RecordingError, check, import_log, read, write

ROWS, PERIOD_S, SPIKES = 300, 0.02, (100, 101, 220)
VOLTS = np.where(np.arange(ROWS) < 60, 0.0, 6.0)
NOISE = np.random.default_rng(0).normal(size=ROWS)
SPEED = 12 * -np.expm1(-np.clip(np.arange(ROWS) - 60, 0, None) / 20) + 0.02 * NOISE * (VOLTS > 0)
ANGLE = np.cumsum(SPEED) * PERIOD_S
APP = typer.Typer()
APP.command()(import_command)


def text_of(shaft, spiky=None, empty=()):
    """As a CSV, in which rows that are `empty` have no reading; with `spiky` those of SPIKES are off by that."""
    cells = [f"{value:.4f}" for value in shaft]
    for row in SPIKES if spiky is not None else ():
        cells[row] = f"{shaft[row] + spiky:.4f}"
    for row in empty:
        cells[row] = ""
    rows = (f"{PERIOD_S * row:.2f},{volts},{cells[row]}" for row, volts in enumerate(VOLTS))
    return "\n".join(["t,u,y", *rows]) + "\n"


def imported(tmp_path, text, **flags):
    path = tmp_path / "log.csv"
    path.write_text(text)
    return import_log(path, time="t", input="u:V", **flags)


@pytest.mark.parametrize("spike", [25.0, -25.0])
def test_their_rows_are_as_if_they_were_empty(tmp_path, spike):
    spiky = imported(tmp_path, text_of(SPEED, spike), speed="y:rad/s", drop_spikes=True)
    empty = imported(tmp_path, text_of(SPEED, empty=SPIKES), speed="y:rad/s")
    [one], [other] = spiky.segments, empty.segments
    np.testing.assert_array_equal(np.flatnonzero(one.unread), SPIKES)
    np.testing.assert_array_equal(one.unread, other.unread)
    np.testing.assert_array_equal(one.shaft, other.shaft)
    np.testing.assert_array_equal(one.volts, other.volts)
    assert spiky.header["imported"] == {**empty.header["imported"], "spikes": len(SPIKES)}
    assert not any("no motor does that" in note for note in check(spiky))
    write(spiky, tmp_path / "written.csv")
    np.testing.assert_array_equal(read(tmp_path / "written.csv").segments[0].unread, one.unread)


@pytest.mark.parametrize("printed", [0.0, 0.002])
def test_rows_without_a_pulse_have_no_speed(tmp_path, printed):
    """Magnets pass the sensor every 25 ms at 12 rad/s, and the program prints every 20 ms. That it prints 0 alone, and
    nothing that is nearly 0, is what tells such rows from a motor that sticks."""
    pulses = np.floor(ANGLE / (12 * 0.025))
    none = (np.diff(pulses, prepend=0) == 0) & (ANGLE > 8)
    speed = np.where(none, np.where(np.arange(ROWS) % 2, printed, 0.0), np.maximum(SPEED, 0.1))
    log = imported(tmp_path, text_of(speed), speed="y:rad/s")
    said = [note for note in check(log) if "without a pulse" in note]
    dropped = imported(tmp_path, text_of(speed), speed="y:rad/s", drop_spikes=True).segments[0]
    if printed:
        assert not said and dropped.unread is None
        return
    [note] = said
    assert "is 0 rad/s, for that row only (and " in note and "--drop-spikes" in note
    np.testing.assert_array_equal(dropped.unread, none)


@pytest.mark.parametrize("most", [1, 3])
def test_a_slow_motor_has_rows_without_a_count(tmp_path, most):
    """0 and one, two or three counts by turns are how slow speeds look."""
    counts = np.random.default_rng(1).integers(0, most + 1, ROWS) * (VOLTS > 0)
    log = imported(tmp_path, text_of(counts * 0.3), speed="y:rad/s", drop_spikes=True)
    assert log.segments[0].unread is None


def test_an_angle_that_was_lost_is_left_out(tmp_path):
    cells = ANGLE.copy()
    cells[150] = 0.0
    recording = imported(tmp_path, text_of(cells), angle="y:rad", drop_spikes=True)
    [segment] = recording.segments
    assert np.flatnonzero(segment.unread).tolist() == [150]
    assert segment.angle_rad[150] == pytest.approx(ANGLE[150], abs=0.01)


def test_a_sound_log_is_what_it_was(tmp_path):
    plain = imported(tmp_path, text_of(SPEED), speed="y:rad/s")
    asked = imported(tmp_path, text_of(SPEED), speed="y:rad/s", drop_spikes=True)
    assert asked.segments[0].unread is None and asked.header == plain.header
    np.testing.assert_array_equal(asked.segments[0].shaft, plain.segments[0].shaft)


def test_counts_have_none_but_as_angles(tmp_path):
    with pytest.raises(RecordingError) as caught:
        imported(tmp_path, text_of(SPEED), count="y", counts_per_rev=100, drop_spikes=True)
    assert "leave drop_spikes out" in str(caught.value) and "COL:counts" in str(caught.value)
    counts = text_of(np.round(100 * ANGLE) + np.where(np.arange(ROWS) == SPIKES[-1], 900, 0))
    told = imported(tmp_path, counts, angle="y:counts", counts_per_rev=628)
    assert any("--angle COL:counts --drop-spikes" in note for note in check(told))
    dropped = imported(tmp_path, counts, angle="y:counts", counts_per_rev=628, drop_spikes=True)
    np.testing.assert_array_equal(np.flatnonzero(dropped.segments[0].unread), SPIKES[-1])


def test_the_command_tells_of_it_and_takes_it(tmp_path):
    (tmp_path / "log.csv").write_text(text_of(SPEED, 25.0))
    options = [str(tmp_path / "log.csv"), "-o", str(tmp_path / "made.csv"), "--time", "t", "--input", "u:V"]
    told = CliRunner().invoke(APP, [*options, "--speed", "y:rad/s"])
    assert told.exit_code == 0 and "--drop-spikes" in told.output
    done = CliRunner().invoke(APP, [*options, "--speed", "y:rad/s", "--force", "--drop-spikes"])
    assert done.exit_code == 0 and "3 of 300 rows have no speed" in done.output and "--drop-spikes" not in done.output
