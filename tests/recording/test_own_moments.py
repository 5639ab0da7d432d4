"""Logs whose commands and readings come at moments of their own."""

import dataclasses

import numpy as np
import pytest

from jaxmotor import diagnose, identify
from jaxmotor.recording import RecordingError, check, from_arrays, import_log, read, write

GAIN, POLE = 3.0, 12.7
CELLS = "t,u,y,part\n0,,1,a\n1,5,,a\n2,,2,a\n3,,3,a\n4,6,4,a\n5,,5,a\n6,,6,b\n7,7,,b\n8,,8,b\n9,,9,b\n10,8,,b\n"
FLAGS = {"time": "t", "input": "u:V", "segment": "part"}


@pytest.fixture
def log(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text(CELLS)
    return path


def test_an_input_acts_until_the_next_one(log, tmp_path):
    recording = import_log(log, **FLAGS, speed="y:rad/s", input_holds=True)
    # What was applied before the first input of a segment is not known, nor what the motor did after the last reading.
    assert [segment.volts.tolist() for segment in recording.segments] == [[5, 5, 6, 6], [7, 7]]
    assert [segment.shaft.tolist() for segment in recording.segments] == [[2, 3, 4, 5], [8, 9]]
    assert all(segment.read.all() for segment in recording.segments)
    assert recording.header["imported"]["input_holds"] is True
    write(recording, tmp_path / "written.csv")
    assert read(tmp_path / "written.csv").header["imported"] == recording.header["imported"]


def test_an_input_that_was_until_its_row_acted_since_the_one_before(log):
    recording = import_log(log, **FLAGS, speed="y:rad/s", input_holds=True, input_acts="before")
    assert [segment.volts.tolist() for segment in recording.segments] == [[5, 6, 6, 6], [7, 8, 8, 8]]
    assert [segment.read.tolist() for segment in recording.segments] == [[True, False, True, True]] * 2


def test_without_it_an_empty_input_is_a_gap(log):
    with pytest.raises(RecordingError, match="a segment has no row with both an input and a shaft"):
        import_log(log, **FLAGS, speed="y:rad/s")
    log.write_text("t,u,y\n0,5,\n1,,1\n2,6,\n3,,2\n")
    with pytest.raises(RecordingError, match=r"no row has both .* until the next one, state input_holds$"):
        import_log(log, time="t", input="u:V", speed="y:rad/s")
    with pytest.raises(RecordingError, match=r"until the next one, state input_holds$"):
        from_arrays(time_s=np.arange(4.0), volts=[5, np.nan, 6, np.nan], speed_rad_s=[np.nan, 1, np.nan, 2])
    log.write_text("t,u,y\n0,,\n1,,1\n2,,\n3,,2\n")
    with pytest.raises(RecordingError, match=r"log both at the same moments$"):
        import_log(log, time="t", input="u:V", speed="y:rad/s", input_holds=True)


def joined(seed, kind, tmp_path):
    """A command every 20 ms and a reading every 30, each in rows of its own."""
    rng = np.random.default_rng(seed)
    commands, readings = np.round(0.02 * np.arange(1000), 4), np.round(0.0031 + 0.03 * np.arange(660), 4)
    volts = rng.choice([-6.0, 6.0, 3.0, -3.0], 200).repeat(5)
    time = np.unique(np.concatenate([commands, readings]))
    acts = volts[np.searchsorted(commands, time, side="right") - 1]
    speed, angle = np.zeros(len(time)), np.zeros(len(time))
    for k, step in enumerate(np.diff(time)):
        target, keep = GAIN * acts[k], np.exp(-POLE * step)
        angle[k + 1] = angle[k] + target * step + (speed[k] - target) * (1 - keep) / POLE
        speed[k + 1] = target + (speed[k] - target) * keep
    seen = {"speed": speed + 0.05 * rng.standard_normal(len(time)), "angle": angle, "count": np.floor(angle * 400)}[
        kind
    ]
    has = np.isin(time, commands), np.isin(time, readings)
    rows = [
        f"{at:.4f},{volt if command else ''},{value if reading else ''}\n"
        for at, volt, value, command, reading in zip(time, acts, np.round(seen, 3), *has, strict=True)
    ]
    path = tmp_path / "joined.csv"
    path.write_text("t,u,y\n" + "".join(rows))
    own = (
        {"count": "y", "counts_per_rev": 800 * np.pi} if kind == "count" else {kind: f"y:rad{'/s' * (kind == 'speed')}"}
    )
    return import_log(path, time="t:s", input="u:V", input_holds=True, **own)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_speeds_between_commands_are_as_exact_as_beside_them(seed, tmp_path):
    recording = joined(seed, "speed", tmp_path)
    [segment] = recording.segments
    assert segment.read.sum() == 660 and 1600 < len(segment) < 1660
    fit = identify(recording)
    assert float(fit.motor.gain) == pytest.approx(GAIN, abs=4 * float(fit.standard_error.gain))
    assert float(fit.motor.pole) == pytest.approx(POLE, abs=4 * float(fit.standard_error.pole))
    assert float(fit.standard_error.gain) < 0.001 * GAIN and float(fit.standard_error.pole) < 0.002 * POLE


@pytest.mark.parametrize("kind", ["angle", "count"])
def test_turns_between_commands_are_mean_speeds(kind, tmp_path):
    recording = joined(4, kind, tmp_path)
    [segment] = recording.segments
    assert recording.measured == "speed" and segment.read.sum() == 659 and recording.speed_window_rows == 0
    assert "each is the mean speed since the last" in " ".join(check(recording))
    write(recording, tmp_path / "written.csv")
    assert (tmp_path / "written.csv").read_text().startswith("# jaxmotor recording 3\n")
    found = diagnose(read(tmp_path / "written.csv"))
    assert found.verdict == "complete" and found.fit.chi2_per_sample < 1.2
    motor, error = found.motor.linear, found.standard_error
    assert float(motor.gain) == pytest.approx(GAIN, abs=4 * error["gain_rad_s_V"])
    assert float(motor.pole) == pytest.approx(POLE, abs=4 * error["pole_rad_s"])
    assert error["gain_rad_s_V"] < 0.001 * GAIN and error["pole_rad_s"] < 0.002 * POLE


def test_means_since_the_reading_before_need_the_format_that_has_them(tmp_path):
    time = 0.01 * np.arange(40)
    recording = from_arrays(time_s=time, volts=np.ones(40), speed_rad_s=np.sqrt(time), speed_window_s=0.01)
    write(dataclasses.replace(recording, speed_window_rows=0), tmp_path / "written.csv")
    assert (tmp_path / "written.csv").read_text().startswith("# jaxmotor recording 3\n")
    assert read(tmp_path / "written.csv").speed_window_rows == 0
