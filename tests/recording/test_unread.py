"""Rows whose input is known and whose shaft was not read."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from recordings import same
from test_repeats import GAIN, PERIOD_S, POLE, motion

from jaxmotor import diagnose, identify
from jaxmotor.prediction import pack
from jaxmotor.recording import Recording, RecordingError, Segment, check, from_arrays, import_log, read, write
from jaxmotor.recording._unread import between
from jaxmotor.validation._open_loop import has_pieces

TIME, VOLTS = {"time": "t", "input": "u:V"}, {"speed": "y:rad/s"}
UNEVEN = (0, 0.011, 0.02, 0.034, 0.04, 0.051, 0.06, 0.0713)


def log(tmp_path, cells, times=range(8), **flags):
    path = tmp_path / "log.csv"
    path.write_text(
        "t,u,y\n" + "".join(f"{t},{k},{cell}\n" for k, (t, cell) in enumerate(zip(times, cells, strict=True)))
    )
    return import_log(path, **TIME | (flags or VOLTS))


@given(st.lists(st.tuples(st.booleans(), st.booleans(), st.booleans()), min_size=1, max_size=30))
def test_rows_are_kept_from_the_first_reading_of_a_run_to_its_last(rows):
    known, was_read, begins = (np.array(column) for column in zip(*rows, strict=True))
    begins[0] = True
    kept = between(known, was_read, begins)

    def reading(row, step):
        """Whether the run of known rows has one at `row` or further on that way."""
        while 0 <= row < len(rows) and known[row]:
            if was_read[row]:
                return True
            if begins[row if step < 0 else min(row + 1, len(rows) - 1)]:
                return False
            row += step
        return False

    assert kept.tolist() == [bool(known[k] and reading(k, -1) and reading(k, 1)) for k in range(len(rows))]


@pytest.mark.parametrize("times", [range(8), UNEVEN])
@pytest.mark.parametrize("shaft", [VOLTS, {"angle": "y:rad"}])
def test_a_row_without_a_reading_keeps_its_input(times, shaft, tmp_path):
    recording = log(tmp_path, ["", 0, 10, "nan", 30, 40, 50, "NA"], times, **shaft)
    [segment] = recording.segments
    # Nothing is known of the motor before the first reading, and nothing is to be known after the last one.
    assert segment.volts.tolist() == [1, 2, 3, 4, 5, 6] and not segment.at_rest
    assert segment.read.tolist() == [True, True, False, True, True, True]
    assert 10 < segment.shaft[2] < 30
    assert recording.header["imported"]["missing_rows"] == 2
    [note] = [note for note in check(recording) if "compared" in note]
    assert "1 of 6 rows have no" in note
    write(recording, tmp_path / "written.csv")
    text = (tmp_path / "written.csv").read_text()
    assert text.startswith("# jaxmotor recording 3\n") and text.count("nan") == 1
    again = read(tmp_path / "written.csv")
    assert same(again, recording) and again.segments[0].read.tolist() == segment.read.tolist()
    write(again, tmp_path / "again.csv")
    assert (tmp_path / "again.csv").read_bytes() == (tmp_path / "written.csv").read_bytes()
    assert np.isnan(again.to_dataframe()["angle_rad" if segment.speed_rad_s is None else "speed_rad_s"]).tolist() == [
        not one for one in segment.read
    ]


def test_a_segment_without_any_reading_is_refused(tmp_path):
    recording = log(tmp_path, [0, "nan", 10, 20, 30, 40, 50, 60])
    write(recording, tmp_path / "written.csv")
    text = (tmp_path / "written.csv").read_text()
    rows = [line for line in text.splitlines() if line.startswith("0,")]
    for row in rows:
        text = text.replace(row, row.rpartition(",")[0] + ",nan")
    (tmp_path / "written.csv").write_text(text)
    with pytest.raises(RecordingError, match="segment 0 has no speed_rad_s at all; leave the segment out"):
        read(tmp_path / "written.csv")


@pytest.mark.parametrize("late", [0, 1])
def test_where_readings_are_repeated_a_row_without_one_is_one_more(late):
    """Each fourth row holds a new speed; where that one has none, nobody knows when the speed came that stands in the
    next."""
    time, volts, _, speed = motion(3)
    held = speed[np.arange(len(speed)) // 4 * 4]
    empty = np.array([400, 1200]) + (0 if late else 1)
    held[empty] = np.nan
    recording = from_arrays(time_s=time, volts=volts, speed_rad_s=held)
    assert "readings_every_s" in recording.header
    [segment] = recording.segments
    row = np.rint(segment.time_s / (time[1] - time[0])).astype(int)
    np.testing.assert_allclose(segment.volts, volts[row])
    np.testing.assert_array_equal(segment.shaft[segment.read], speed[row[segment.read]])
    assert np.isin(empty, row[~segment.read]).all() == bool(late)
    assert segment.read.sum() == len(time) // 4 - (2 if late else 0)


def test_equal_readings_beside_a_row_without_one_come_when_they_do():
    """Rounded speeds stay for several readings, in whose midst cells are empty."""
    time, volts, _, speed = motion(5)
    volts = np.roll(volts, 1)
    held = np.round(speed[np.arange(len(speed)) // 4 * 4])
    empty = np.flatnonzero((np.arange(len(held)) % 4 == 1) & (np.random.default_rng(1).random(len(held)) < 0.2))
    held[empty] = np.nan
    [segment] = from_arrays(time_s=time, volts=volts, speed_rad_s=held).segments
    row = np.rint(segment.time_s / PERIOD_S).astype(int)
    assert (row[segment.read] % 4 == 0).all() and segment.read.sum() > 0.9 * len(time) / 4


@pytest.mark.parametrize("jitter", [0, 1])
@pytest.mark.parametrize("name", ["counts", "angle_rad"])
def test_turns_over_many_rows_are_mean_speeds_where_the_input_changed(name, jitter):
    time, volts, angle, _ = motion(4)
    every = 4 + np.random.default_rng(5).integers(-jitter, jitter + 1, len(time))
    new = np.cumsum(every)
    new = new[new < len(time)]
    cells = np.full(len(time), np.nan)
    cells[new] = np.floor(angle * 9000 / (2 * np.pi))[new] if name == "counts" else angle[new]
    stated = {"counts_per_rev": 9000} if name == "counts" else {}
    recording = from_arrays(time_s=time, volts=volts, **{name: cells}, **stated)
    [segment] = recording.segments
    assert recording.period_s is not None and recording.header["readings_every_s"] == pytest.approx(4 * PERIOD_S)
    if jitter:
        np.testing.assert_array_equal(segment.volts, volts[new[0] : new[-1] + 1])
        np.testing.assert_array_equal(np.flatnonzero(segment.read), new[1:] - new[0])
        unit = 2 * np.pi / 9000 if name == "counts" else 1.0
        speeds = unit * np.diff(cells[new]) / (PERIOD_S * np.diff(new))
        np.testing.assert_allclose(segment.speed_rad_s[segment.read], speeds, atol=1e-9)
        assert recording.speed_window_rows == 0
    else:
        assert recording.measured == ("count" if name == "counts" else "angle")
        np.testing.assert_array_equal(segment.volts, volts[new])
    fit = identify(recording)
    assert (float(fit.motor.gain), float(fit.motor.pole)) == pytest.approx((GAIN, POLE), rel=0.002)
    assert fit.chi2_per_sample < 1.5


@pytest.mark.parametrize("driven_at", [13, 15])
def test_a_mean_speed_may_begin_while_the_motor_stands_still(driven_at):
    """An angle in each fourth row; the rest before the first voltage is left out but for a row of it."""
    time, volts, angle, _ = motion(6)
    rest = np.zeros(driven_at)
    volts, angle = np.concatenate([rest, volts])[: len(time)], np.concatenate([rest, angle])
    cells = np.where(np.arange(len(time)) % 4 == 0, angle[: len(time)], np.nan)
    recording = from_arrays(time_s=time, volts=volts, angle_rad=cells)
    [segment] = recording.segments
    assert segment.at_rest and recording.speed_window_rows == 0
    packed = pack(recording, (0,))
    row = int(np.argmax(packed.row_of[0] == 16))
    assert packed.batch.valid[0, row] and packed.row_of[0, 0] == driven_at - 1
    np.testing.assert_allclose(packed.batch.span[0, row], 1.0)
    fit = identify(recording)
    assert (float(fit.motor.gain), float(fit.motor.pole)) == pytest.approx((GAIN, POLE), rel=0.001)


@pytest.mark.parametrize(("every", "scored"), [(1, True), (3, False)])
def test_a_segment_that_shows_no_turn_is_not_scored(every, scored):
    time, volts, angle, _ = motion(10, 400)
    unread = np.arange(len(time)) % every != 0
    first = Segment("other", 0.0, True, {}, time, volts, tick=np.arange(len(time)), angle_rad=angle)
    second = dataclasses.replace(first, start_s=9.0, unread=unread if unread.any() else None)
    recording = Recording((first, second), "two", PERIOD_S)
    assert has_pieces(recording, 0) and has_pieces(recording, 1) == scored


def test_pulses_that_were_not_read_are_lost(tmp_path):
    recording = log(tmp_path, [0, "", "", 5, "", "", 5, 5], pulses="y", counts_per_rev=100)
    assert recording.count_resets and recording.header["imported"]["missing_rows"] == 4


@pytest.mark.parametrize("seed", [6, 7, 8])
@pytest.mark.parametrize("missing", ["few", "most", "a stretch"])
def test_the_motor_is_found_through_rows_without_speeds(missing, seed):
    time, volts, _, speed = motion(seed)
    rng = np.random.default_rng(seed)
    speed = speed + 0.3 * rng.standard_normal(len(speed))
    row = np.arange(len(time))
    gone = {"few": rng.random(len(time)) < 0.1, "most": row % 7 > 0, "a stretch": (row > 500) & (row < 900)}[missing]
    fit = identify(from_arrays(time_s=time, volts=volts, speed_rad_s=np.where(gone, np.nan, speed), speed_window_s=0))
    for name, true in (("gain", GAIN), ("pole", POLE)):
        error = float(getattr(fit.standard_error, name))
        assert abs(float(getattr(fit.motor, name)) - true) < 4 * error < 0.02 * true


def test_nothing_is_named_where_most_rows_have_no_speed():
    time, volts, _, speed = motion(9)
    speed = speed + 0.3 * np.random.default_rng(9).standard_normal(len(speed))
    speed[np.arange(len(time)) % 5 > 0] = np.nan
    found = diagnose(from_arrays(time_s=time, volts=volts, speed_rad_s=speed, speed_window_s=0, supply_V=9.0))
    assert found.verdict == "complete" and found.motor.effects == ()
