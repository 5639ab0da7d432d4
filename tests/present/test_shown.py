"""Results as a terminal, a notebook and a data frame show them."""

import dataclasses
import html.parser
import re

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxmotor import FirstOrder, Motor, from_arrays, validate
from jaxmotor.motor.effects import CoulombFriction, SupplySag

INTERVAL = r"gain +1[01]\.\d+ ± 0\.0\d+ rad/s/V\n  pole +(?:40|39)\.\d+ ± 0\.0\d+ rad/s\n"


def test_a_fit_says_its_numbers_with_intervals_and_units(exact):
    assert re.search(INTERVAL, repr(exact)) and "voltage_offset" in repr(exact) and "chi2" in repr(exact)
    assert repr(exact).startswith("Fit of made.csv (exact, 9 segments, ± is 95 %)")
    assert re.search(INTERVAL, f"{exact.model!r}\n")


def test_a_ratio_has_no_unit(exact):
    sags = dataclasses.replace(exact.model, effects=(SupplySag.of(ratio=0.03),), effect_errors=({"ratio": 0.001},))
    assert "\n  supply_sag.ratio  0.0300 ± 0.0020" in f"{sags!r}\n"
    assert not re.search(r" 1(\n|$)", repr(sags)) and "<td>1</td>" not in sags._repr_html_()


def test_motors_are_readable(exact):
    assert re.fullmatch(r"FirstOrder\(gain=1[01][\d.]*, pole=(?:40|39)[\d.]*\)", repr(exact.motor))
    motor = Motor(FirstOrder(jnp.asarray(10.5), jnp.asarray(40.0)), (CoulombFriction.of(volts_V=0.25),))
    said = "Motor(linear=FirstOrder(gain=10.5, pole=40), effects=(CoulombFriction(volts_V=0.25),), viscous_share=0)"
    assert repr(motor) == said
    traced = []
    jax.make_jaxpr(lambda gain: traced.append(repr(FirstOrder(gain, gain))))(jnp.float32(1.0))
    assert traced == ["FirstOrder(gain=f32[], pole=f32[])"]


def test_a_notebook_gets_a_table_a_picture_and_no_markup_of_strangers(exact):
    evil = "<script>alert(1)</script>"
    page = dataclasses.replace(exact, notes=(evil,), source=f"{evil}\x1b[31m.csv")._repr_html_()
    tags = []
    parser = html.parser.HTMLParser()
    parser.handle_starttag = lambda tag, attrs: tags.append(tag)
    parser.feed(page)
    assert set(tags) == {"div", "table", "caption", "tr", "th", "td", "ul", "li", "img"}
    assert evil not in page and "\x1b" not in page and "&lt;script&gt;" in page
    assert "<th>gain</th>" in page and "data:image/png;base64,iVBOR" in page


def test_a_recording_says_what_it_holds(recording):
    assert re.fullmatch(
        r"Recording made.csv: \d+ rows, one per 0.005 s, .*; count measured\n  sine: \d.*", repr(recording)
    )
    assert re.fullmatch(r"Segment\('sine', start_s=\d+, \d+ rows of count\)", repr(recording.segments[0]))
    assert "data:image/png;base64,iVBOR" in recording._repr_html_()
    evil = from_arrays(time_s=np.arange(9.0), volts=np.ones(9), speed_rad_s=np.arange(9.0), name="<b>\n\x07")
    assert "<b>" not in evil._repr_html_() and "\n" not in repr(evil).splitlines()[0] and "\x07" not in repr(evil)


def test_a_measured_response_says_its_range(exact):
    said = repr(exact.frequency_response)
    assert re.match(r"FrequencyResponse\(frequency_Hz=<\d+ from 0\.\d+ to \d+\.?\d*>, response=c128", said)


def test_a_data_frame_of_a_validation(exact, recording):
    pytest.importorskip("pandas")
    validation = validate(dataclasses.replace(exact.model, fitted=frozenset()), recording, simulations=64)
    frame = validation.to_dataframe().set_index(["segments", "quantity"])
    assert validation.open_loop is not None and validation.steps
    number, score = next(iter(validation.open_loop.segments.items()))
    assert frame.loc[(str(number), "fit_percent"), "score"] == score.fit_percent
    step = validation.steps[0]
    row = frame.xs("rise_time_s", level="quantity").iloc[0]
    assert tuple(row[1:]) == pytest.approx((*step.rise_time_s.measured, *step.rise_time_s.predicted), nan_ok=True)
    assert "<th>fit</th>" in validation._repr_html_()


def test_a_data_frame_of_parameters(exact):
    pytest.importorskip("pandas")
    frame = exact.to_dataframe()
    assert list(frame.index) == ["gain", "pole", "voltage_offset"] and list(frame["unit"]) == ["rad/s/V", "rad/s", "V"]
    assert frame.loc["gain", "value"] == float(exact.motor.gain)
    half = 1.96 * float(exact.standard_error.pole)
    assert frame.loc["pole", "high"] - frame.loc["pole", "low"] == pytest.approx(2 * half)
