"""Speeds that a program takes over a fixed time: what tells them, and what they become."""

import numpy as np
import pytest

from jaxmotor.recording import RecordingError, check, from_arrays, import_log, read, write

FIXED_S = 0.02
GAIN, POLE = 4.0, 12.0
STATED = {"time": "t", "input": "u:V", "speed": "w:rad/s", "supply_V": 6.0}


def late_rows(rng, number=800, late=0.02):
    """(n,) times of rows that are a little uneven, and now and then far too late."""
    step = FIXED_S * rng.uniform(0.97, 1.03, number)
    step[rng.random(number) < late] *= 5
    return np.cumsum(step) - step[0]


def motor(time, volts):
    """(n,) angle [rad] and speed [rad/s] at the rows of GAIN/(1 + s/POLE), each of `volts` held until the next row."""
    angle, speed = np.zeros((2, len(time)))
    for k, step in enumerate(np.diff(time)):
        end = GAIN * volts[k]
        decay = np.exp(-POLE * step)
        angle[k + 1] = angle[k] + end * step + (speed[k] - end) * (1 - decay) / POLE
        speed[k + 1] = end + (speed[k] - end) * decay
    return angle, speed


def steps(time, rng):
    return np.repeat(rng.choice([-4.0, -2.0, 0.0, 3.0, 5.0], len(time) // 40 + 1), 40)[: len(time)]


def log(tmp_path, time, volts, speed, name="log.csv", **stated):
    table = "".join(f"{t:.6f},{u:g},{w:.8g}\n" for t, u, w in zip(time, volts, speed, strict=True))
    (tmp_path / name).write_text("t,u,w\n" + table)
    return import_log(tmp_path / name, **(STATED | stated))


def is_told(recording):
    return any("--speed-period" in sentence for sentence in check(recording))


def test_they_are_told_and_become_means_over_the_rows(tmp_path):
    rng = np.random.default_rng(1)
    time = late_rows(rng)
    volts = steps(time, rng)
    turned = np.diff(motor(time, volts)[0], prepend=0.0)
    [sentence] = [one for one in check(log(tmp_path, time, volts, turned / FIXED_S)) if "--speed-period" in one]
    assert f"{FIXED_S:g} s if it is the usual one" in sentence
    recording = log(tmp_path, time, volts, turned / FIXED_S, speed_period_s=FIXED_S)
    assert not is_told(recording) and recording.speed_window_rows == 1
    assert recording.speed_window_s == pytest.approx(FIXED_S, rel=0.02)
    np.testing.assert_allclose(recording.segments[0].shaft[1:], turned[1:] / np.diff(time), rtol=1e-4, atol=1e-6)
    write(recording, tmp_path / "made.csv")
    again = read(tmp_path / "made.csv")
    assert again.header["imported"]["speed_period_s"] == FIXED_S and again.speed_window_rows == 1
    np.testing.assert_allclose(again.segments[0].shaft, recording.segments[0].shaft)


@pytest.mark.parametrize("late", [0.0, 0.02])
@pytest.mark.parametrize("seed", range(5))
def test_they_are_told_with_whole_counts_and_without_late_rows(tmp_path, seed, late):
    rng = np.random.default_rng(seed)
    time = late_rows(rng, late=late) if late else np.cumsum(FIXED_S * rng.uniform(0.8, 1.2, 800))
    volts = steps(time, rng)
    counts = np.diff(np.floor(motor(time, volts)[0] / (2 * np.pi) * 4000), prepend=0.0)
    assert is_told(log(tmp_path, time - time[0], volts, counts / 4000 * 2 * np.pi / FIXED_S))


@pytest.mark.parametrize("seed", range(5))
def test_others_are_not(tmp_path, seed):
    """Means over the rows, speeds at the rows, the same through a filter, over even rows, and standing still."""
    rng = np.random.default_rng(seed)
    time = late_rows(rng)
    volts = steps(time, rng)
    angle, speed = motor(time, volts)
    step = np.diff(time, prepend=-FIXED_S)
    mean, smooth = np.diff(angle, prepend=0.0) / step, np.zeros(len(time))
    for k, own in enumerate(np.diff(angle, prepend=0.0) / FIXED_S):
        smooth[k] = 0.75 * smooth[k - 1] + 0.25 * own if k else 0.0
    for own in (mean, speed, speed * (1 + 0.05 * rng.standard_normal(len(time))), smooth):
        assert not is_told(log(tmp_path, time, volts, own))
    even = FIXED_S * np.arange(len(time))
    assert not is_told(log(tmp_path, even, volts, motor(even, volts)[1]))
    few = from_arrays(time_s=time[:8], volts=volts[:8] + 1, speed_rad_s=np.arange(8.0))
    assert not is_told(few)


@pytest.mark.parametrize("seed", range(5))
def test_they_are_told_where_rows_of_an_even_log_are_lost(tmp_path, seed):
    """Speeds in the log are as high again after a lost row; those that are means over the time it took are not."""
    rng = np.random.default_rng(seed)
    even = FIXED_S * np.arange(500)
    kept = np.sort(rng.choice(np.arange(500), 490, replace=False))
    time, volts = even[kept] - even[kept[0]], np.repeat(rng.uniform(2.0, 6.0, 10), 50)[kept]
    counts = np.diff(np.floor(motor(time, volts)[0] / (2 * np.pi) * 4000), prepend=0.0)
    turned = counts / 4000 * 2 * np.pi
    own = log(tmp_path, time, volts, turned / FIXED_S)
    assert own.period_s == pytest.approx(FIXED_S) and is_told(own)
    assert not is_told(log(tmp_path, time, volts, turned / np.diff(time, prepend=-FIXED_S)))


def test_of_even_rows_they_are_means_over_a_period(tmp_path):
    time = 2 * FIXED_S * np.arange(200)
    volts = np.repeat([0.0, 3.0, -2.0, 5.0], 50)
    turned = np.diff(motor(time, volts)[0], prepend=0.0)
    recording = log(tmp_path, time, volts, turned / FIXED_S, speed_period_s=FIXED_S)
    assert recording.speed_window_s == recording.period_s == pytest.approx(2 * FIXED_S)
    assert recording.speed_window_rows is None
    np.testing.assert_allclose(recording.segments[0].shaft, turned / (2 * FIXED_S), rtol=1e-4, atol=1e-6)


def test_segments_begin_anew(tmp_path):
    rng = np.random.default_rng(2)
    time = late_rows(rng, 200)
    volts = steps(time, rng)
    speed = np.diff(motor(time, volts)[0], prepend=0.0) / FIXED_S
    twice = [np.concatenate([column, column]) for column in (time, volts, speed)]
    recording = log(tmp_path, *twice, segment="t", speed_period_s=FIXED_S)
    first, second = recording.segments
    np.testing.assert_allclose(first.shaft, second.shaft)
    assert np.abs(first.shaft).max() < 1.001 * GAIN * 5


def test_what_cannot_be_is_refused(tmp_path):
    time = FIXED_S * np.arange(20)
    with pytest.raises(RecordingError, match="speed_period_s is 0"):
        log(tmp_path, time, time, time, speed_period_s=0)
    with pytest.raises(RecordingError, match=r"speed_period_s is 1e\+308; rows are"):
        log(tmp_path, time, time, time, speed_period_s=1e308)
    with pytest.raises(
        RecordingError, match="speed_period_s says over how long each speed is; leave speed_window_s out"
    ):
        log(tmp_path, time, time, time, speed_period_s=FIXED_S, speed_window_s=FIXED_S)
    (tmp_path / "angle.csv").write_text("t,u,w\n" + "".join(f"{k},{k},{k}\n" for k in range(9)))
    angle = {"time": "t", "input": "u:V", "angle": "w:rad"}
    with pytest.raises(RecordingError, match="speed_period_s is of a speed"):
        import_log(tmp_path / "angle.csv", **angle, speed_period_s=FIXED_S)
