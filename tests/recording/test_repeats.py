"""Logs that repeat each reading until the next one comes."""

import numpy as np
import pytest

from jaxmotor import identify
from jaxmotor.recording import check, from_arrays, import_log, read, write

PERIOD_S, GAIN, POLE = 0.005, 12.0, 8.0


def motion(seed, rows=3000):
    """Volts that change every 0.2 s, and the angle of a motor that follows them exactly."""
    rng = np.random.default_rng(seed)
    volts = np.repeat(rng.uniform(-8, 8, rows // 40), 40)
    keep, speed, angle = np.exp(-POLE * PERIOD_S), 0.0, 0.0
    angles, speeds = [], []
    for volt in volts:
        angles.append(angle)
        speeds.append(speed)
        target = GAIN * volt
        angle += target * PERIOD_S + (speed - target) * (1 - keep) / POLE
        speed = target + (speed - target) * keep
    return np.arange(rows) * PERIOD_S, volts, np.array(angles), np.array(speeds)


def repeated(values, every):
    """`values`, of which a new one comes only in those rows; `every` are the rows that each stays."""
    new = np.concatenate([[0], np.cumsum(every)])
    return values[new[np.searchsorted(new, np.arange(len(values)), side="right") - 1]]


@pytest.mark.parametrize("jitter", [0, 1])
@pytest.mark.parametrize("name", ["angle_rad", "speed_rad_s"])
def test_only_new_readings_are_kept(name, jitter, tmp_path):
    time, volts, angle, speed = motion(1)
    every = 4 + np.random.default_rng(2).integers(-jitter, jitter + 1, len(time))
    true = angle if name == "angle_rad" else speed
    log = from_arrays(time_s=time, volts=volts, **{name: repeated(true, every)})
    [segment] = log.segments
    assert segment.read.sum() == pytest.approx(len(time) / 4, rel=0.03)
    assert log.header["readings_every_s"] == pytest.approx(0.02) and log.period_s is not None
    row = np.rint(segment.time_s / PERIOD_S).astype(int)
    # Each fourth row is enough where nothing changes between; else each keeps its input.
    assert len(segment) == pytest.approx(len(time) if jitter else len(time) / 4, rel=0.03)
    np.testing.assert_array_equal(segment.volts, volts[row])
    new, read_rows = np.cumsum(every), row[segment.read]
    if jitter and name == "angle_rad":
        # What was turned since the reading before is a mean speed: of the first one nobody knows it.
        assert log.speed_window_rows == 0 and log.speed_window_s == pytest.approx(0.02)
        np.testing.assert_array_equal(read_rows, new[new < len(time)])
        turned, took_s = np.diff(true[[0, *read_rows]]), PERIOD_S * np.diff([0, *read_rows])
        np.testing.assert_allclose(segment.speed_rad_s[segment.read], turned / took_s, atol=1e-9)
    else:
        np.testing.assert_allclose(segment.shaft[segment.read], true[read_rows])
    write(log, tmp_path / "log.csv")
    [note] = [note for note in check(read(tmp_path / "log.csv")) if "a new reading came" in note]
    assert "20 ms" in note
    found = identify(log).motor
    assert (float(found.gain), float(found.pole)) == pytest.approx((GAIN, POLE), rel=0.02)


@pytest.mark.parametrize(("every", "window"), [(4, 0), (4, 4), (7, 7)])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_inputs_that_change_while_a_speed_stays_act_when_they_did(seed, every, window):
    """A voltage that changes every 15 ms, and speeds that come every 20 or 35 ms: at once, or as means over that."""
    gain, pole, rows = 3.0, 12.7, 3000
    rng = np.random.default_rng(seed)
    volts = np.repeat(rng.choice([-6.0, 6.0, 3.0, -3.0], rows // 3), 3)
    keep, speed, angle = np.exp(-pole * PERIOD_S), np.zeros(rows), np.zeros(rows)
    for k in range(rows - 1):
        target = gain * volts[k]
        angle[k + 1] = angle[k] + target * PERIOD_S + (speed[k] - target) * (1 - keep) / pole
        speed[k + 1] = target + (speed[k] - target) * keep
    seen = speed
    if window:
        seen = np.concatenate([np.zeros(window), (angle[window:] - angle[:-window]) / (window * PERIOD_S)])
    seen = np.round(seen + 0.05 * rng.standard_normal(rows), 2)
    held = repeated(seen, np.full(rows, every))
    log = from_arrays(time_s=np.arange(rows) * PERIOD_S, volts=volts, speed_rad_s=held)
    fit = identify(log)
    assert sum(segment.read.sum() for segment in log.segments) == pytest.approx(rows / every, rel=0.02)
    assert float(fit.motor.gain) == pytest.approx(gain, abs=4 * float(fit.standard_error.gain))
    assert float(fit.motor.pole) == pytest.approx(pole, abs=4 * float(fit.standard_error.pole))
    assert float(fit.standard_error.gain) < 0.002 * gain and float(fit.standard_error.pole) < 0.005 * pole
    if window:
        assert fit.average is not None
        assert fit.average.length_s == pytest.approx(window * PERIOD_S, rel=0.02)


def test_of_many_rows_that_say_nothing_new_those_are_kept_that_do():
    """A log of 1 kHz, a speed every 20 ms, and a voltage that changes every 40 to 400 rows."""
    gain, pole, rows, rng = 3.0, 12.7, 20_000, np.random.default_rng(8)
    changes = np.cumsum(rng.integers(40, 400, 200))
    volts = rng.choice([-6.0, -2.0, 3.0, 6.0], 201)[np.searchsorted(changes, np.arange(rows), side="right")]
    speed, keep = np.zeros(rows), np.exp(-pole * 1e-3)
    for k in range(rows - 1):
        speed[k + 1] = gain * volts[k] + (speed[k] - gain * volts[k]) * keep
    held = repeated(np.round(speed + 0.05 * rng.standard_normal(rows), 2), np.full(rows, 20))
    log = from_arrays(time_s=1e-3 * np.arange(rows), volts=volts, speed_rad_s=held)
    [segment] = log.segments
    row = np.rint(segment.time_s / 1e-3).astype(int)
    assert segment.read.sum() == 1000 and len(segment) < 1000 + 200
    np.testing.assert_array_equal(row[segment.read], 20 * np.arange(1000))
    # In each row of the log acts what the row kept before it has.
    np.testing.assert_array_equal(volts[: row[-1]], segment.volts[:-1].repeat(np.diff(row)))
    fit = identify(log)
    assert float(fit.motor.gain) == pytest.approx(gain, abs=4 * float(fit.standard_error.gain))
    assert float(fit.motor.pole) == pytest.approx(pole, abs=4 * float(fit.standard_error.pole))
    assert float(fit.standard_error.gain) < 0.002 * gain and float(fit.standard_error.pole) < 0.005 * pole


@pytest.mark.parametrize("counts_per_rev", [20, 500])
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_slow_shaft_repeats_its_count_and_every_row_stays(seed, counts_per_rev):
    time, volts, angle, _ = motion(seed)
    volts, angle = volts / 8, angle / 8
    count = np.floor(angle * counts_per_rev / (2 * np.pi)).astype(np.int64)
    log = from_arrays(time_s=time, volts=volts, counts=count, counts_per_rev=counts_per_rev)
    assert sum(map(len, log.segments)) == len(time) and "readings_every_s" not in log.header


def test_steps_of_a_rounded_speed_are_no_repeats():
    """Steady speeds are the same row after row; they change in each row where the motor speeds up."""
    time, volts, _, speed = motion(4)
    log = from_arrays(time_s=time, volts=volts, speed_rad_s=np.rint(speed / 2) * 2)
    assert sum(map(len, log.segments)) == len(time)


def test_speeds_from_pulses_say_themselves_which_are_new():
    time, volts, _, speed = motion(5)
    log = from_arrays(
        time_s=time, volts=volts, speed_rad_s=repeated(speed, np.full(len(time), 4)), speed_pulses_per_rev=6
    )
    assert sum(map(len, log.segments)) == len(time)


def test_duties_that_change_while_an_angle_stays_are_kept(tmp_path):
    time, volts, angle, _ = motion(6)
    duty = np.rint(volts * 20 + 3 * np.sin(9 * time)).astype(int)
    path = tmp_path / "log.csv"
    rows = zip(time, duty, repeated(angle, np.full(len(time), 4)), strict=True)
    path.write_text("t,duty,angle\n" + "".join(f"{a:.4f},{b},{c:.5f}\n" for a, b, c in rows))
    log = import_log(path, time="t:s", input="duty:duty:255", angle="angle:rad", supply_V=12.75)
    [segment] = log.segments
    assert segment.duty is not None and log.duty_full_scale == 255
    np.testing.assert_array_equal(segment.duty, duty[: len(segment)])
    assert segment.read.tolist() == [k % 4 == 0 and k > 0 for k in range(len(time) - 3)]
    speeds = np.diff(np.round(angle[::4], 5)) / (4 * PERIOD_S)
    np.testing.assert_allclose(segment.speed_rad_s[segment.read], speeds, atol=1e-9)


def test_where_a_segment_has_one_angle_alone_the_others_have_the_mean_voltage():
    time, volts, angle, _ = motion(7)
    volts = np.roll(volts, 2)
    held = repeated(angle, np.full(len(time), 4))
    pieces = [[column[:-2], column[-2:]] for column in (time, volts, held)]
    log = from_arrays(**dict(zip(("time_s", "volts", "angle_rad"), pieces, strict=True)))
    first, last = log.segments
    assert first.angle_rad is not None and len(first) == 750 and len(last) == 1
    np.testing.assert_allclose(first.volts[:-1], volts[: 4 * 749].reshape(-1, 4).mean(axis=1))
