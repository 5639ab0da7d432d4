"""Volts of duties follow the supply that was logged; a stiff one changes nothing."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from recordings import same

from jaxmotor.recording import (
    Recording,
    RecordingError,
    Segment,
    check,
    import_log,
    join,
    logs_supply,
    read,
    supplied,
    write,
)

PERIOD, GAIN, POLE, SUPPLY, FULL = 0.005, 8.0, 30.0, 7.4, 250
RATIO = 0.25
"""The supply's resistance over the winding's."""


def made(drift=0.0, ratio=0.0, seed=1, seconds=20.0):
    """Duties, counts, supply at each row and its mean until the next: finely integrated Euler steps of 50 us."""
    rng = np.random.default_rng(seed)
    duty = np.repeat(rng.integers(-FULL, FULL + 1, int(seconds / 0.1)), round(0.1 / PERIOD))
    duty[:4] = 0
    steps, h = 100, PERIOD / 100
    speed = angle = time = 0.0
    count, reading, mean = [], [], []
    terminal = SUPPLY
    for share in (duty / FULL).tolist():
        count.append(int(np.floor(angle * 600 / (2 * np.pi) + 0.3)))
        reading.append(terminal)
        total = 0.0
        for _ in range(steps):
            unloaded = SUPPLY * (1 - drift * time)
            back = share * speed / GAIN
            terminal = (unloaded + ratio * back) / (1 + ratio * share**2)
            if share * terminal * share < back:
                terminal = (unloaded - ratio * back) / (1 - ratio * share**2)
            total += terminal
            speed += h * POLE * (GAIN * share * terminal - speed)
            angle += h * speed
            time += h
        mean.append(total / steps)
    return duty, np.array(count), np.array(reading), np.array(mean)


def recording(duty, count, supply, at_rest=True):
    tick = np.arange(len(duty))
    segment = Segment(
        "other",
        0.0,
        at_rest,
        {},
        tick * PERIOD,
        duty / FULL * SUPPLY,
        tick=tick,
        duty=duty,
        count=count,
        supply_V=supply,
    )
    return Recording((segment,), "made.csv", PERIOD, 600.0, float(FULL), SUPPLY, "brake")


def error(found, duty, mean):
    """Of the applied volts: root mean square [V], and of their scale."""
    volts, true = found.segments[0].volts, duty / FULL * mean
    return float(np.sqrt(np.mean((volts - true) ** 2))), float(volts @ true / (true @ true) - 1)


CASES = {"drifts": (0.004, 0.0), "sags": (0.0, RATIO), "both": (0.004, RATIO)}


@pytest.mark.parametrize("drift, ratio", CASES.values(), ids=CASES)
@pytest.mark.parametrize("seed", [1, 2])
def test_volts_are_those_of_the_logged_supply(drift, ratio, seed):
    duty, count, reading, mean = made(drift, ratio, seed)
    nominal, _ = error(recording(duty, count, reading), duty, mean)
    rms, scale = error(supplied(recording(duty, count, np.round(reading, 3))), duty, mean)
    assert nominal > 0.1 and rms < 0.003 and abs(scale) < 2e-4


@pytest.mark.parametrize("drift, ratio", CASES.values(), ids=CASES)
def test_a_supply_that_was_held_from_each_row_on_is_taken_as_it_is(drift, ratio):
    duty, count, _, mean = made(drift, ratio)
    rms, scale = error(supplied(recording(duty, count, mean)), duty, mean)
    assert rms < 0.0015 and abs(scale) < 1e-4


def test_readings_of_a_coarse_converter_leave_the_volts_as_they_are():
    duty, count, reading, _ = made(0.004, RATIO)
    coarse = np.floor(reading / 0.01968 + 0.5) * 0.01968
    every = round(0.1 / PERIOD)
    sparse = np.where(np.arange(len(duty)) % every == 7, coarse, np.nan)
    held = sparse.copy()
    held[:7] = coarse[0]
    for k in range(7, len(held)):
        held[k] = held[k] if not np.isnan(held[k]) else held[k - 1]
    for supply in (sparse, held):
        one = recording(duty, count, supply)
        assert np.array_equal(supplied(one).segments[0].volts, one.segments[0].volts) and not logs_supply(one)


@pytest.mark.parametrize("flicker", [0.0, 0.01968])
@pytest.mark.parametrize("level", [7.4, 7.1, 8.9])
def test_a_stiff_supply_leaves_volts_to_the_last_bit(flicker, level):
    duty, count, *_ = made()
    rng = np.random.default_rng(3)
    one = recording(duty, count, level + flicker * rng.integers(0, 2, len(duty)))
    assert same(supplied(one), one)


def test_the_scale_is_the_stated_supply_and_a_warning_where_they_differ():
    duty, count, reading, mean = made(0.004, RATIO)
    off = supplied(recording(duty, count, np.round(1.05 * reading, 3)))
    assert abs(error(off, duty, mean)[1]) < 2e-4
    assert any("the logged supply begins at 7.77 V, the header states 7.4 V" in warning for warning in check(off))
    assert not any("logged supply" in warning for warning in check(supplied(recording(duty, count, reading))))


@pytest.mark.parametrize("idle", [True, False])
def test_a_supply_that_wanders_for_reasons_of_its_own(idle):
    duty, count, *_ = made()
    duty[:4] = 0 if idle else 100
    wander = SUPPLY + np.cumsum(np.random.default_rng(5).normal(scale=0.004, size=len(duty)))
    volts = supplied(recording(duty, count, wander + SUPPLY - wander[0], at_rest=idle)).segments[0].volts
    np.testing.assert_allclose(volts, duty / FULL * (wander + SUPPLY - wander[0]), rtol=0, atol=0.02)


def test_files_keep_what_was_logged(tmp_path):
    duty, count, reading, _ = made(0.004, RATIO, seconds=5.0)
    sparse = np.where(np.arange(len(duty)) % 20 == 0, np.round(reading, 3), np.nan)
    for supply, version in ((np.round(reading, 3), 1), (sparse, 2)):
        one = supplied(recording(duty, count, supply))
        write(one, tmp_path / "r.csv")
        assert (tmp_path / "r.csv").read_text().startswith(f"# jaxmotor recording {version}\n")
        again = read(tmp_path / "r.csv")
        np.testing.assert_array_equal(again.segments[0].volts, one.segments[0].volts)
        np.testing.assert_array_equal(again.segments[0].supply_V, supply)
        assert logs_supply(again) == (version == 1), "too few readings in the other"
    text = (tmp_path / "r.csv").read_text()
    (tmp_path / "bad.csv").write_text(text.replace(",nan\n", ",nan,\n", 1))
    with pytest.raises(RecordingError, match="fields where the columns"):
        read(tmp_path / "bad.csv")
    (tmp_path / "bad.csv").write_text(text.replace("supply_mV", "current_A", 1))
    with pytest.raises(RecordingError, match="current_A is"):
        read(tmp_path / "bad.csv")


def test_joined_recordings_are_written_as_they_are(tmp_path):
    parts = [supplied(recording(*made(0.004, RATIO, seed, seconds=5.0)[:3])) for seed in (1, 2)]
    whole = join(parts)
    write(whole, tmp_path / "r.csv")
    np.testing.assert_allclose(read(tmp_path / "r.csv").segments[1].volts, whole.segments[1].volts, rtol=1e-12)


def test_few_or_impossible_readings_are_left_alone():
    duty, count, reading, _ = made(0.004, RATIO, seconds=5.0)
    few = np.where(np.arange(len(duty)) % 100 == 0, reading, np.nan)
    for supply in (few, np.where(np.arange(len(duty)) == 5, 0.0, reading), np.full(len(duty), np.nan)):
        one = recording(duty, count, supply)
        assert not logs_supply(one) and supplied(one) is one


@settings(max_examples=60, deadline=None)
@given(data=st.data())
def test_no_readings_break_it(data):
    rows = data.draw(st.integers(20, 60))
    column = st.lists(st.one_of(st.floats(1e-6, 1e6), st.sampled_from([7.4, 7.42, 1e-6])), min_size=rows, max_size=rows)
    duty = np.array(data.draw(st.lists(st.integers(-FULL, FULL), min_size=rows, max_size=rows)))
    count = np.array(data.draw(st.lists(st.integers(-(2**61), 2**61), min_size=rows, max_size=rows)))
    supply = np.array(data.draw(column))
    found = supplied(recording(duty, count, supply))
    assert np.isfinite(found.segments[0].volts).all() and found.supply_V == SUPPLY


def test_imported_supply_columns(tmp_path):
    duty, count, reading, mean = made(0.004, RATIO)
    lines = [
        f"{k * PERIOD:.3f},{d / FULL:.6f},{n},{1000 * v:.0f}\n"
        for k, (d, n, v) in enumerate(zip(duty, count, reading, strict=True))
    ]
    path = tmp_path / "log.csv"
    path.write_text("t,pwm,n,mV\n" + "".join(lines))
    flags = {"time": "t", "input": "pwm:duty:1", "count": "n", "counts_per_rev": 600, "drive": "brake"}
    found = import_log(path, **flags, supply="mV:mV")
    assert found.supply_V == pytest.approx(SUPPLY, abs=0.002)
    assert found.duty_full_scale == 1e6 and error(found, duty, mean)[0] < 0.005
    stated = import_log(path, **flags, supply="mV:mV", supply_V=2 * SUPPLY)
    np.testing.assert_allclose(stated.segments[0].volts, 2 * SUPPLY / found.supply_V * found.segments[0].volts)
    write(found, tmp_path / "r.csv")
    np.testing.assert_allclose(read(tmp_path / "r.csv").segments[0].volts, found.segments[0].volts, rtol=1e-12)


@pytest.mark.parametrize(
    "cells, flags, reason",
    [
        ("7.4", {"supply": "v"}, "states no unit"),
        ("7.4", {"supply": "v:A"}, "'A' is not known"),
        ("7.4", {"supply": "w:V"}, "no column 'w'"),
        ("", {"supply": "v:V"}, "never holds a supply"),
        ("-1", {"supply": "v:V"}, "line 2: v is -1 V"),
        ("x", {"supply": "v:V"}, "line 2: v is 'x'"),
        ("7.4", {"supply": "v:V", "supply_unknown": True}, "supply_unknown"),
    ],
)
def test_supply_columns_that_do_not_fit(tmp_path, cells, flags, reason):
    path = tmp_path / "log.csv"
    path.write_text("t,u,n,v\n" + "".join(f"{k},{k},{k},{cells}\n" for k in range(9)))
    with pytest.raises(RecordingError, match=reason):
        import_log(path, time="t", input="u:duty:10", count="n", counts_per_rev=5, **flags)


def test_a_recording_without_a_supply_says_what_is_left_out():
    duty, count, *_ = made(seconds=5.0)
    one = dataclasses.replace(recording(duty, count, None), supply_V=None, duty_full_scale=None)
    one = dataclasses.replace(one, segments=(dataclasses.replace(one.segments[0], duty=None),))
    assert any("left out: supply_sag, coast_drive" in warning for warning in check(one))
    unknown = dataclasses.replace(recording(duty, count, None), supply_V=1.0, header={"supply_unknown": True})
    assert any("1 V stands for it" in warning for warning in check(unknown))
