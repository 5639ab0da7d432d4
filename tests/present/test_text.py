"""Names from files are shown as they are, never read as mathematics."""

import dataclasses
import math
import re

import numpy as np
import pytest
from figures import check
from hypothesis import given, settings
from hypothesis import strategies as st
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from present_rig import AWKWARD

from jaxmotor.cli._text import fit_text
from jaxmotor.motor.effects import EFFECTS, told_parameters
from jaxmotor.present import position_drift, simulation
from jaxmotor.present._style import plain
from jaxmotor.text import if_determined, key_title, parameter_title, spoken, voltage, with_bracket, with_error


def test_an_error_that_only_says_that_nothing_is_known_is_said_so():
    assert with_error(133.0, 5.8e118, "ms") == "133 ms (not determined)"
    assert with_error(133.04, math.inf, "ms") == "133 ms (not determined)"
    assert with_error(0.001, 3.0, "mV") == "0.0 ± 5.9 mV"
    assert with_error(0.0, 3.0, "mV") == "0.0 ± 5.9 mV"


@settings(max_examples=30)
@given(st.text(max_size=70))
def test_any_text_can_be_drawn(text):
    figure = Figure(figsize=(2, 1))
    drawn = figure.text(0.1, 0.5, plain(text), fontsize=8)
    FigureCanvasAgg(figure).draw()
    shown, is_math = drawn._preprocess_math(drawn.get_text())
    assert not is_math and len(shown) <= 60
    assert all(one == other or other in " ?…" for one, other in zip(text, shown, strict=False))


def test_dollars_and_backslashes_come_out_as_they_went_in():
    figure = Figure()
    for text in ("$x$", r"$\frac{", r"\$a\$", r"C:\motors\$1", "100 $"):
        drawn = figure.text(0, 0, plain(text))
        assert drawn._preprocess_math(drawn.get_text()) == (text, False)


def test_a_motor_with_an_awkward_name(recording):
    assert recording.header["motor"] == AWKWARD
    figure = position_drift(recording, 2)
    check(figure)
    assert r"\frac{ 50 % \alpha_ ??" in figure.get_suptitle()


@pytest.mark.parametrize(
    "value", [AWKWARD, 10**400, float("nan"), None, [1.0]], ids=["text", "huge", "nan", "none", "list"]
)
def test_parameters_that_make_no_sense_are_no_trouble(exact, recording, value):
    strange = dataclasses.replace(recording.segments[0], parameters={"reference_rad_s": value}, kind="closed_loop")
    mixed = dataclasses.replace(recording, segments=(strange, *recording.segments[1:]))
    figure = simulation(exact, mixed)
    check(figure)
    assert figure.axes[0].get_title(loc="left").startswith("closed loop (0): ")


def test_an_offset_against_a_motion_of_one_direction_may_be_friction(exact):
    one_way = tuple(dataclasses.replace(one, measured_rad_s=np.abs(one.measured_rad_s)) for one in exact.traces)
    back = tuple(dataclasses.replace(one, measured_rad_s=-one.measured_rad_s) for one in one_way)
    hint = "it may be Coulomb friction; see jaxmotor diagnose"
    for offset, traces, is_told in (
        (-0.2, one_way, True),
        (0.2, back, True),
        (0.2, one_way, False),
        (-0.2, exact.traces, False),
        (-0.001, one_way, False),
    ):
        told = fit_text(dataclasses.replace(exact, offset_V=offset, traces=traces), [], [])
        assert (hint in told) == is_told, (offset, is_told)


@pytest.mark.parametrize(
    ("interval", "shown"),
    [
        ((96.7, 90.12, 97.55), "96.7 [90.12, 97.55]"),
        ((4.06, 4.05832, 4.05841), "4.06 [4.0583, 4.0584]"),
        ((96.7, 96.7, 96.7), "96.7"),
        ((96.7, float("nan"), float("nan")), "96.7"),
    ],
)
def test_an_interval_of_no_width_is_none(interval, shown):
    assert with_bracket(interval) == shown


def test_names_of_effects_are_words():
    text = "a ramp tells coulomb_friction from load_torque, not from some_thing"
    assert spoken(text) == "a ramp tells Coulomb friction from load torque, not from some_thing"
    note = "shaft_compliance: this recording does not determine damping_ratio, frequency_Hz"
    assert spoken(note) == "shaft compliance: this recording does not determine damping ratio, frequency"


@pytest.mark.parametrize("effect", sorted(EFFECTS))
def test_parameters_have_names_without_units(effect):
    titles = [parameter_title(name) for name in told_parameters(EFFECTS[effect])]
    assert len(set(titles)) == len(titles) and not [title for title in titles if "_" in title]
    assert not [title for title in titles if re.search(r"(^|[a-z] )(V|s|rad|Hz|per)$", title)]


@pytest.mark.parametrize(
    ("key", "title"),
    [
        ("lost_samples", "lost samples"),
        ("counts_per_rev", "counts per turn"),
        ("reference_rad_s", "reference (rad/s)"),
        ("duty_delay_s", "duty delay (s)"),
        ("from_V", "from (V)"),
        ("firmware", "firmware"),
        ("odd <b>key</b>", "odd <b>key</b>"),
    ],
)
def test_keys_of_a_header_are_words_with_units(key, title):
    assert key_title(key) == title


@pytest.mark.parametrize(
    ("volts", "shown"),
    [(0.1309, "131 mV"), (0.0004, "0.4 mV"), (0.9994, "999 mV"), (0.9997, "1 V"), (1.3704, "1.37 V"), (-2.0, "-2 V")],
)
def test_a_voltage_has_no_power_of_ten(volts, shown):
    assert voltage(volts) == shown


def test_an_interval_that_holds_zero_is_no_value():
    """Nor is one without limits; of one far wider than its middle not even that is told."""
    assert if_determined(20.0, 1.0, "rad/s") == "20.0 ± 2.0 rad/s"
    assert if_determined(20.0, 15.0, "rad/s") == "not determined (20 ± 29 rad/s)"
    for error in (200.0, np.inf, np.nan):
        assert if_determined(20.0, error, "rad/s") == "not determined"
