"""Names from files are shown as they are, never read as mathematics."""

import dataclasses

import pytest
from figures import check
from hypothesis import given, settings
from hypothesis import strategies as st
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from present_rig import AWKWARD

from jaxmotor.present import position_drift, simulation
from jaxmotor.present._style import plain


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
