"""Figures drawn on the axes of somebody else's figure, which otherwise stays as it is."""

import numpy as np
import pytest
from figures import line
from matplotlib.figure import Figure

from jaxmotor import JaxmotorError
from jaxmotor.present import (
    Compared,
    bode,
    bode_models,
    closed_loop,
    position_drift,
    residuals,
    simulation,
    sine_fit,
    zoh_bode,
)
from jaxmotor.present import step as step_figure

TIME = np.arange(50) * 0.005
COMPARED = Compared(TIME, np.sin(TIME), np.cos(TIME))
DRAWN = {
    "simulation": (3, lambda fit, recording, axes: simulation(fit, recording, axes=axes)),
    "residuals": (2, lambda fit, recording, axes: residuals(fit, recording, axes=axes)),
    "bode": (3, lambda fit, recording, axes: bode(fit.frequency_response, axes=axes)),
    "bode_models": (4, lambda fit, recording, axes: bode_models(fit.frequency_response, [fit], axes=axes)),
    "sine_fit": (2, lambda fit, recording, axes: sine_fit(recording, 0, axes=axes)),
    "position_drift": (1, lambda fit, recording, axes: position_drift(recording, 0, axes=axes)),
    "step": (2, lambda fit, recording, axes: step_figure(COMPARED, title="a step", axes=axes)),
    "closed_loop": (2, lambda fit, recording, axes: closed_loop(COMPARED, COMPARED, axes=axes)),
    "zoh_bode": (2, lambda fit, recording, axes: zoh_bode(0.005, axes=axes)),
}


@pytest.mark.parametrize("name", DRAWN)
def test_all_is_drawn_on_the_axes_given(exact, recording, name):
    number, draw = DRAWN[name]
    figure = Figure(layout="tight")
    own = figure.subplots(number + 1, squeeze=False)[:, 0]
    assert draw(exact, recording, own[:number]) is figure
    assert all(ax.has_data() for ax in own[:number]) and not own[number].has_data()
    assert figure.axes == list(own) and figure.get_suptitle() == "" and not figure.legends
    assert type(figure.get_layout_engine()).__name__ == "TightLayoutEngine"
    panels = len(exact.traces) if name == "simulation" else number
    with pytest.raises(JaxmotorError, match=f"this figure has {panels} panels"):
        draw(exact, recording, [own[0]] * 30)


def test_one_panel_takes_bare_axes(exact, recording):
    ax = Figure().subplots()
    assert simulation(exact, recording, axes=ax) is ax.figure
    np.testing.assert_array_equal(line(ax, "measured").get_ydata(), exact.traces[0].measured_rad_s)
