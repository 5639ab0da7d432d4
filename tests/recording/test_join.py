"""Recordings of one motor joined to one, and steady states as a recording."""

import dataclasses
from typing import Any

import numpy as np
import pytest

from jaxmotor.cli import main
from jaxmotor.recording import RecordingError, import_log, import_steady, join, read, write

CURVE = "u,y\n-2,-100.5\n0,0\n1,50\n2,101\n"
LOG = "t_s,u,y\n" + "".join(f"{0.02 * k:.2f},{1 + k % 2},{40 + k % 7}\n" for k in range(50))


@pytest.fixture
def files(tmp_path):
    (tmp_path / "curve.csv").write_text(CURVE)
    (tmp_path / "log.csv").write_text(LOG)
    return tmp_path


def curve_of(files, **changed: Any):
    flags: dict[str, Any] = {
        "input": "u:V",
        "speed": "y:deg/s",
        "period_s": 0.02,
        "hold_s": 1.0,
        "speed_window_s": 0.02,
    } | changed
    return import_steady(files / "curve.csv", **flags)


def log_of(files, **flags: Any):
    return import_log(files / "log.csv", time="t_s", input="u:V", speed="y:deg/s", speed_window_s=0.02, **flags)


def test_each_steady_state_is_a_segment_that_stays_as_it_is(files):
    recording = curve_of(files)
    assert len(recording.segments) == 4
    assert recording.period_s == 0.02
    for segment, (volts, speed) in zip(recording.segments, [(-2, -100.5), (0, 0), (1, 50), (2, 101)], strict=True):
        assert len(segment) == 51
        assert segment.time_s[-1] == pytest.approx(1.0)
        assert (segment.volts == volts).all()
        np.testing.assert_allclose(segment.speed_rad_s, np.deg2rad(speed))
        assert not segment.at_rest
    starts = [segment.start_s for segment in recording.segments]
    assert (np.diff(starts) > 1.0).all()


@pytest.mark.parametrize(
    ("changed", "sentence"),
    [
        ({"hold_s": 0.02}, "less than two periods"),
        ({"hold_s": -1.0}, "hold_s is -1"),
        ({"period_s": 0.0}, "period_s is 0"),
        ({"input": "volts:V"}, "volts"),
        ({"speed": "y"}, "unit"),
        ({"hold_s": 1e9}, "rows"),
    ],
)
def test_bad_flags_are_one_sentence(files, changed, sentence):
    with pytest.raises(RecordingError, match=sentence):
        curve_of(files, **changed)


def test_segments_are_kept_and_follow_each_other(files):
    log, curve = log_of(files), curve_of(files, supply_V=5.0)
    joined = join([log, curve])
    assert len(joined.segments) == 5
    np.testing.assert_array_equal(joined.segments[0].speed_rad_s, log.segments[0].speed_rad_s)
    np.testing.assert_array_equal(joined.segments[4].volts, curve.segments[3].volts)
    ends = [segment.start_s + segment.time_s[-1] for segment in joined.segments]
    assert all(later.start_s > end for later, end in zip(joined.segments[1:], ends, strict=False))
    assert joined.supply_V == 5.0
    assert joined.header["joined"] == ["log.csv", "curve.csv"]


@pytest.mark.parametrize(
    ("name", "value", "sentence"),
    [
        ("period_s", 0.01, "a period of 0.02 s.*a period of 0.01 s.*one rig"),
        ("drive", "coast", "a bridge set to brake.*a bridge set to coast"),
        ("speed_window_s", None, "states none"),
        ("duty_delay_s", 4e-5, "4e-05 s late.*states none"),
    ],
)
def test_what_contradicts_is_refused(files, name, value, sentence):
    log = log_of(files, drive="brake")
    other = dataclasses.replace(curve_of(files, drive="brake"), **{name: value})
    with pytest.raises(RecordingError, match=sentence):
        join([log, other])


def test_where_only_some_hold_duties_all_hold_volts(files):
    """One run at full duty, 1, among others at parts of it."""
    flags: dict[str, Any] = {"time": "t", "input": "u:duty:1", "angle": "y:rad", "supply_V": 6.0}
    for name, duty in (("half", 0.5), ("whole", 1)):
        rows = "".join(f"{0.02 * k:.2f},{duty if k > 5 else 0},{0.1 * max(k - 5, 0) ** 1.5:.6f}\n" for k in range(40))
        (files / f"{name}.csv").write_text("t,u,y\n" + rows)
    half, whole = (import_log(files / f"{name}.csv", **flags) for name in ("half", "whole"))
    assert half.segments[0].duty is None and whole.segments[0].duty is not None
    for both in ([half, whole], [whole, half]):
        write(join(both), files / "both.csv")
        again = read(files / "both.csv")
        assert sorted(segment.volts.max() for segment in again.segments) == [3.0, 6.0]
        assert again.duty_full_scale is None
    two = join([whole, whole])
    assert two.duty_full_scale == 1 and all(segment.duty is not None for segment in two.segments)


def test_over_how_long_a_row_usually_is_may_differ(files):
    uneven = np.cumsum(np.random.default_rng(0).uniform(0.015, 0.025, 50))
    logs = []
    for name, time in (("one", uneven), ("other", 1.1 * uneven)):
        rows = "".join(f"{t:.4f},{k % 2},{k % 7}\n" for k, t in enumerate(time))
        (files / f"{name}.csv").write_text("t,u,y\n" + rows)
        logs.append(import_log(files / f"{name}.csv", time="t", input="u:V", speed="y:rad/s", speed_period_s=0.02))
    both = join(logs)
    assert both.speed_window_rows == 1
    assert logs[0].speed_window_s < both.speed_window_s < logs[1].speed_window_s


def test_what_was_measured_otherwise_is_refused(files):
    angle = import_log(files / "log.csv", time="t_s", input="u:V", angle="y:deg")
    with pytest.raises(RecordingError, match=r"holds the speed.*the angle"):
        join([log_of(files), angle])
    with pytest.raises(RecordingError, match="nothing to join"):
        join([])


def test_commands_make_one_recording_of_a_log_and_a_curve(files, capsys):
    one, other, both = (str(files / name) for name in ("one.csv", "other.csv", "both.csv"))
    shaft = ["--input", "u:V", "--speed", "y:deg/s", "--speed-window", "0.02"]
    assert main(["import", str(files / "log.csv"), "-o", one, "--time", "t_s", *shaft]) == 0
    steady = ["--steady", "1", "--period", "0.02"]
    assert main(["import", str(files / "curve.csv"), "-o", other, *steady, *shaft]) == 0
    assert main(["join", one, other, "-o", both]) == 0
    assert "254 rows in 5 segments of 2 recordings" in capsys.readouterr().out
    assert len(read(both).segments) == 5
    assert main(["join", one, other, "-o", both]) == 1
    assert "exists already" in capsys.readouterr().err
    assert main(["import", str(files / "curve.csv"), "-o", other, "--force", "--steady", "1", *shaft]) == 2
    assert "--period" in capsys.readouterr().err
