import dataclasses

import numpy as np
import pytest
from figures import bands, check, labels, line

from jaxmotor._errors import JaxmotorError
from jaxmotor.diagnosis._learned_law import LearnedLaw, Resemblance
from jaxmotor.present import learned

STEP = (Resemblance("drift", 0.99, "like a steady drift", 0.2, 0.01),)


def law(coordinate, low, high, share, resembles=()):
    at = np.linspace(low, high, 121)
    return LearnedLaw(coordinate, at, 0.2 * np.sin(at), np.full(121, 0.01), share, share, resembles)


LAWS = (
    law("time", 0, 60, 0.96, STEP),
    law("speed", -50, 50, 0.4),
    law("voltage", -5, 5, 0.1),
    law("angle", 0, 2 * np.pi, 0.0),
)


@pytest.mark.parametrize("number", [1, 2, 3, 4])
def test_each_law_has_its_panel_and_the_best_is_marked(number):
    figure = learned(LAWS[:number])
    check(figure)
    shown = [ax for ax in figure.axes if ax.axison]
    assert len(shown) == number and labels(figure)[0] == ("Time in the recording (s)", "Residual voltage (mV)")
    title = shown[0].get_title(loc="left").splitlines()
    assert title[0] == "Best: 96 % explained" and len(title) == (2 if number == 1 else 3)
    assert " ".join(title[1:]) == "like a steady drift, of up to 200 ± 20 mV"
    for ax, one in zip(shown, LAWS, strict=False):
        np.testing.assert_allclose(line(ax, "learned").get_ydata(), 1e3 * one.values)
        np.testing.assert_allclose(bands(ax)[0][:, 1] - bands(ax)[0][:, 0], 40.0)
    if number > 1:
        assert shown[1].get_title(loc="left") == "40 % explained"


def test_a_long_title_stays_over_its_panel():
    text = "like Coulomb friction in a sector of 360 degrees and of no other name, $x$"
    best = law("angle", 0, 2 * np.pi, 0.96, (Resemblance("sector", 0.99, text, 0.2, 0.01),))
    figure = learned((best, *LAWS[1:]))
    check(figure)
    ax, beside, *_ = figure.axes
    title = " ".join(ax.get_title(loc="left").split())
    assert title.endswith(r"no other name, \$x\$, of up to 200 ± 20 mV")
    assert ax.get_tightbbox().x1 < beside.get_window_extent().x0


def test_an_error_of_the_reading_has_an_axis_of_its_own():
    misread = dataclasses.replace(LAWS[3], unit="rad", values=0.1 * LAWS[3].values)
    figure = learned((misread, LAWS[1]))
    check(figure)
    assert labels(figure) == [
        ("Shaft angle (rad, one turn)", "Error of the reading (mrad)"),
        ("Speed (rad/s)", "Residual voltage (mV)"),
    ]
    one, other = figure.axes
    assert one.get_ylim() != other.get_ylim()


def test_nothing_explained_is_not_best():
    figure = learned((dataclasses.replace(LAWS[3]),))
    check(figure)
    assert figure.axes[0].get_title(loc="left") == "0 % explained"


def test_no_laws_are_said():
    with pytest.raises(JaxmotorError, match="longer"):
        learned(())
