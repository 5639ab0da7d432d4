"""Of a long recording a part is searched first."""

import dataclasses

import numpy as np
import pytest
from test_curves_beside_friction import GAIN, POLE, turned, voltages

from jaxmotor import identify
from jaxmotor.diagnosis import _explain, _part
from jaxmotor.diagnosis._explain import _of_part, _searched
from jaxmotor.diagnosis._part import part_of
from jaxmotor.diagnosis._request import Request
from jaxmotor.recording import from_arrays

ROWS = 600
ASKED = ("coulomb_friction", "dead_zone", "voltage_offset", "quadratic_drag", "load_step")


@pytest.fixture
def few(monkeypatch):
    """A part has `ROWS` rows in pieces of 100."""
    monkeypatch.setattr(_part, "ENOUGH", ROWS)
    monkeypatch.setattr(_part, "LASTS", 12.0)


def log():
    """30 s of a motor with friction, in rows of 10 ms."""
    return turned(voltages(5), lambda volt: volt, lambda angle: 0.0)


def found_in(recording):
    fit = identify(recording)
    return _of_part(recording, fit, Request(ASKED), 0), _searched(recording, fit, Request(ASKED), 0)


def test_a_short_recording_has_none():
    assert part_of(log(), POLE) is None


@pytest.mark.parametrize("pole", [0.0, float("nan"), float("inf")])
def test_a_pole_that_is_none_makes_pieces_all_the_same(few, pole):
    assert sum(map(len, part_of(log(), pole).segments)) == ROWS


def test_a_part_that_shows_no_motion_is_none(few):
    """The motor ran between two pieces only."""
    volts = np.where(np.arange(3000) // 100 == 3, 6.0, 0.0)
    assert part_of(turned(volts, lambda volt: volt, lambda angle: 0.0), POLE) is None


def test_pieces_are_rows_of_the_recording(few):
    whole, part = log(), part_of(log(), POLE)
    [segment] = whole.segments
    assert len(part.segments) == 6 and sum(map(len, part.segments)) == ROWS
    assert [piece.at_rest for piece in part.segments] == [True, *5 * [False]]
    for piece in part.segments:
        begin = round(piece.start_s / whole.period_s)
        rows = slice(begin, begin + len(piece))
        np.testing.assert_array_equal(piece.count, segment.count[rows])
        np.testing.assert_array_equal(piece.volts, segment.volts[rows])
        np.testing.assert_array_equal(piece.tick, np.arange(len(piece)))
        np.testing.assert_allclose(piece.start_s + piece.time_s, segment.time_s[rows], atol=1e-12)
    assert part.segments[0].start_s == 0.0
    assert part.segments[-1].start_s + part.segments[-1].time_s[-1] == pytest.approx(segment.time_s[-1])


def test_pieces_last_for_many_time_constants(few):
    assert [len(piece) for piece in part_of(log(), 4.0).segments] == [300, 300]
    assert [len(piece) for piece in part_of(log(), 0.1).segments] == [ROWS]


def test_rows_without_a_reading_and_extra_columns_stay_with_their_rows(few):
    [segment] = log().segments
    number = np.arange(len(segment))
    marked = dataclasses.replace(segment, unread=number % 7 == 3, extra={"row": number.astype(str)})
    for piece in part_of(dataclasses.replace(log(), segments=(marked,)), POLE).segments:
        rows = piece.extra["row"].astype(int)
        np.testing.assert_array_equal(piece.unread, rows % 7 == 3)
        assert rows[0] == round(piece.start_s / 0.01)


@pytest.mark.usefixtures("x64")
def test_the_same_is_found_by_a_part(few):
    by_part, whole = found_in(log())
    assert by_part.found.fitted.names == whole.found.fitted.names == ("coulomb_friction",)
    assert float(by_part.found.fitted.motor.linear.gain) == pytest.approx(GAIN, rel=1e-3)
    np.testing.assert_allclose(by_part.found.fitted.free, whole.found.fitted.free, rtol=1e-4, atol=1e-5)


@pytest.mark.usefixtures("x64")
def test_what_no_piece_shows_is_found_in_the_whole(few):
    """Somebody held the shaft, for 1.5 s between two pieces."""
    sound = log()
    [segment] = sound.segments
    shown = [piece.start_s for piece in part_of(sound, POLE).segments]
    rows = np.arange(len(segment))
    begin = round(shown[2] / sound.period_s) + 150
    volts = segment.volts.copy()
    volts[begin : begin + 150] *= 0.5
    held = from_arrays(
        time_s=segment.time_s,
        volts=segment.volts,
        counts=turned(volts, lambda volt: volt, lambda angle: 0.0).segments[0].count,
        counts_per_rev=1400.0,
        supply_V=12.0,
    )
    assert not any(set(range(begin, begin + 150)) & {*rows[round(one / 0.01) :][:100].tolist()} for one in shown)
    by_part, whole = found_in(held)
    found, alone = by_part.found, whole.found
    assert found.fitted.names == alone.fitted.names == ("coulomb_friction",)
    assert found.fitted.chi2 == pytest.approx(alone.fitted.chi2, rel=1e-3)
    assert found.unexplained_share == pytest.approx(alone.unexplained_share, rel=1e-3)
    assert found.unexplained_share > 0.5


@pytest.mark.usefixtures("x64")
def test_a_part_is_explained_in_the_noise_of_the_whole(few, monkeypatch):
    """A quiet piece would have another one, in which the whole seems to hold more than that."""
    generator = np.random.default_rng(4)
    [segment] = log().segments
    speed = np.gradient(segment.count * (2 * np.pi / 1400.0), segment.time_s)
    spread = np.where(np.arange(len(speed)) < 1500, 0.2, 0.4)
    noisy = from_arrays(
        time_s=segment.time_s,
        volts=segment.volts,
        speed_rad_s=speed + generator.normal(0.0, spread),
        supply_V=12.0,
        speed_window_s=0.0,
    )
    levels = []
    searched = _explain._searched
    monkeypatch.setattr(_explain, "_searched", lambda *a: levels.append(searched(*a)) or levels[-1])
    fit = identify(noisy)
    _of_part(noisy, fit, Request(ASKED), 0)
    assert [one.study.packed.observation.noise.level for one in levels] == [pytest.approx(fit.noise.level)]
