"""Speeds from the time between two pulses: over how long they are, and what states it."""

import dataclasses

import numpy as np
import pytest

from jaxmotor.recording import RecordingError, Segment, check, from_arrays, import_log, join, pulse_windows, read, write
from jaxmotor.recording._check import warn_pulses
from jaxmotor.recording._read import parse

PULSES = 40.0
APART_RAD = 2 * np.pi / PULSES


def printed(time, angle_at, speed_at):
    """(n,) what a program prints that looks for pulses every 10 µs; nothing before the second one."""
    fine = np.arange(0.0, time[-1] + 1e-5, 1e-5)
    number = np.floor(angle_at(fine) / APART_RAD)
    came = fine[1:][np.diff(number) > 0]
    # When exactly: by the speed there.
    came = came - (angle_at(came) - np.floor(angle_at(came) / APART_RAD) * APART_RAD) / speed_at(came)
    seen = np.searchsorted(came, time, side="right")
    return np.array([APART_RAD / (came[k - 1] - came[k - 2]) if k > 1 else 0.0 for k in seen])


@pytest.mark.parametrize(("begin", "rise", "row_s"), [(20.0, 15.0, 0.03), (4.0, 1.5, 0.01)])
def test_a_mean_over_the_window_is_what_is_printed_on_average(begin, rise, row_s):
    """Several pulses in a row, and one in several rows; of a shaft whose speed rises evenly."""
    apart = []
    for phase in np.linspace(0, APART_RAD, 20, endpoint=False):
        time = np.arange(0, 3, row_s)
        speed = printed(time, lambda t, phase=phase: phase + begin * t + rise * t**2 / 2, lambda t: begin + rise * t)
        segment = Segment("other", 0.0, True, {}, time_s=time, volts=np.ones(len(time)), speed_rad_s=speed)
        window, fresh = pulse_windows(segment, PULSES)
        mean = begin + rise * (time - window / 2)
        apart.append((speed - mean)[fresh & (time > 0.5)])
    whole = np.concatenate(apart)
    # What the last speed of a row would be off by if it were taken as it is: half a row and more.
    assert abs(whole.mean()) < 0.02 * rise * row_s and np.abs(whole).max() < rise * row_s


def test_where_no_pulse_came_nothing_was_read():
    time = 0.01 * np.arange(8)
    speed = np.array([0.0, 0.0, 5.0, 5.0, 5.0, 6.0, 0.0, 40.0])
    segment = Segment("other", 0.0, True, {}, time_s=time, volts=np.ones(8), speed_rad_s=speed)
    window, fresh = pulse_windows(segment, PULSES)
    assert fresh.tolist() == [False, False, True, False, False, True, False, True]
    assert window[2] == pytest.approx(APART_RAD / 5 + 0.01) and window[7] == pytest.approx(2 * APART_RAD / 40)
    assert np.isfinite(window).all()
    one = Segment("other", 0.0, True, {}, time_s=time[:1], volts=np.ones(1), speed_rad_s=np.array([1e-320]))
    window, fresh = pulse_windows(one, PULSES)
    assert window.tolist() == [1.0] and fresh.tolist() == [False]


def log_of(tmp_path, pulses=PULSES, name="log.csv", scale=1.0):
    time = 0.01 * np.arange(400)
    speed = scale * np.maximum(20 * np.sin(3 * time), 0)
    rows = "".join(f"{t:.2f},{100 * (y > 0):d},{y:.4f}\n" for t, y in zip(time, speed, strict=True))
    (tmp_path / name).write_text("t,pwm,w\n" + rows)
    stated = {"time": "t", "input": "pwm:duty:255", "supply_V": 6.0, "speed": "w:rad/s"}
    return import_log(tmp_path / name, **stated, speed_pulses_per_rev=pulses)


@pytest.mark.parametrize("row_s", [0.0005, 0.002])
def test_speeds_from_pulses_that_nobody_stated_are_told(tmp_path, row_s):
    time = np.arange(0, 3, row_s)
    speed = printed(time, lambda t: 6 * t - np.cos(2 * t), lambda t: 6 + 2 * np.sin(2 * t))
    rows = "".join(f"{t:.4f},{100 * (y > 0):d},{y:.4f}\n" for t, y in zip(time, speed, strict=True))
    (tmp_path / "log.csv").write_text("t,pwm,w\n" + rows)
    stated = {"time": "t", "input": "pwm:duty:255", "supply_V": 6.0, "speed": "w:rad/s"}
    told = check(import_log(tmp_path / "log.csv", **stated))
    assert any("--speed-pulses 40" in sentence for sentence in told)
    told = check(import_log(tmp_path / "log.csv", **stated, speed_pulses_per_rev=PULSES))
    assert not any("--speed-pulses" in sentence for sentence in told)


@pytest.mark.parametrize("every", [1, 10])
def test_speeds_at_an_even_pace_are_not_taken_for_those_of_pulses(every):
    """Nor where a reading is repeated, at a speed that wanders as pulses would show it."""
    rng = np.random.default_rng(0)
    speed = 6 + np.cumsum(0.05 * rng.standard_normal(200))
    segment = np.repeat(speed, every)
    recording = from_arrays(time_s=0.002 * np.arange(len(segment)), volts=np.ones(len(segment)), speed_rad_s=segment)
    assert not any("--speed-pulses" in sentence for sentence in check(recording))


def test_no_sensor_has_pulses_of_many_turns_or_of_none():
    time = np.cumsum(np.random.default_rng(0).uniform(1.0, 2.0, 50))
    for angle in (1e-200, 1e-6, 10.0, 1e5):
        speed = angle / np.diff(time, prepend=0.0)
        recording = from_arrays(time_s=time - time[0], volts=np.ones(50), speed_rad_s=speed)
        assert not any("--speed-pulses" in sentence for sentence in warn_pulses(recording))


def test_it_is_stated_kept_and_joined(tmp_path):
    made = log_of(tmp_path)
    assert made.speed_pulses_per_rev == PULSES and made.speed_window_s == pytest.approx(0.02, abs=0.015)
    assert not any("averaged" in sentence for sentence in check(made))
    write(made, tmp_path / "made.csv")
    again = read(tmp_path / "made.csv")
    assert (again.speed_pulses_per_rev, again.speed_window_s) == (PULSES, made.speed_window_s)
    slower = log_of(tmp_path, name="slower.csv", scale=0.3)
    assert slower.speed_window_s > made.speed_window_s
    both = join([made, slower])
    assert made.speed_window_s < both.speed_window_s < slower.speed_window_s
    with pytest.raises(RecordingError, match="pulses per turn; only recordings of one rig"):
        join([made, log_of(tmp_path, pulses=30.0)])
    column = {"time_s": made.segments[0].time_s, "volts": made.segments[0].volts}
    same = from_arrays(**column, speed_rad_s=made.segments[0].speed_rad_s, speed_pulses_per_rev=PULSES)
    assert same.speed_window_s == pytest.approx(made.speed_window_s)


def test_what_cannot_be_is_refused(tmp_path):
    (tmp_path / "log.csv").write_text("t,u,w,n\n" + "".join(f"{k},1,0,{k}\n" for k in range(9)))
    of = {"time": "t", "input": "u:V", "speed_pulses_per_rev": PULSES}
    with pytest.raises(RecordingError, match="no pulse is seen"):
        import_log(tmp_path / "log.csv", **of, speed="w:rad/s")
    with pytest.raises(RecordingError, match="leave speed_window_s out"):
        import_log(tmp_path / "log.csv", **of, speed="w:rad/s", speed_window_s=0.1)
    with pytest.raises(RecordingError, match="speed_pulses_per_rev is of a speed"):
        import_log(tmp_path / "log.csv", **of, count="n", counts_per_rev=4)
    made = log_of(tmp_path)
    with pytest.raises(RecordingError, match="no speed_window_rows"):
        check(dataclasses.replace(made, speed_window_rows=2))
    write(made, tmp_path / "made.csv")
    text = (tmp_path / "made.csv").read_text()
    for damaged in (text.replace("# speed_window_s", "# other"), text.replace("rev = 40.0", "rev = -1.0")):
        with pytest.raises(RecordingError, match="speed_pulses_per_rev"):
            parse(damaged.encode(), "made.csv")
