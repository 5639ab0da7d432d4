"""Room for what is written around the panels."""

import numpy as np
import pytest
from matplotlib.ticker import Locator

from jaxmotor.present import bode, position_drift, residuals, simulation
from jaxmotor.present._style import panels, styled

DRAWN = {
    "simulation": simulation,
    "residuals": residuals,
    "bode": lambda fit, recording: bode(fit.frequency_response),
    "drift": lambda fit, recording: position_drift(recording, 0, pole_rad_s=float(fit.motor.pole)),
}


def places(figure):
    """(axes, 4) [pixel]"""
    return np.array([ax.get_position().bounds for ax in figure.axes]) * np.tile(figure.bbox.size, 2)


@pytest.mark.parametrize("name", DRAWN)
def test_another_round_of_layout_would_move_nothing(exact, recording, name):
    figure = DRAWN[name](exact, recording)
    before = places(figure)
    figure.set_layout_engine("constrained")
    figure.get_layout_engine().execute(figure)
    assert places(figure) == pytest.approx(before, abs=0.5)


class BySize(Locator):
    """Ticks with long labels where there is much room, and with short ones where there is little."""

    def __call__(self):
        width = self.axis.axes.get_position().width
        return np.array([0.0, 1e40 if width > 0.8 else 1.0])


def test_ticks_that_go_to_and_fro_have_room():
    @styled
    def drawn():
        figure, axes = panels(1, 2.0)
        axes[0, 0].plot([0, 1], [0, 1e40])
        axes[0, 0].yaxis.set_major_locator(BySize())
        axes[0, 0].yaxis.set_major_formatter(lambda value, _: f"{value:.0f}")
        return figure

    figure = drawn()
    [ax] = figure.axes
    assert ax.get_tightbbox().x0 >= 0
    before = places(figure)
    assert ax.get_yticks().tolist() in ([0.0, 1e40], [0.0, 1.0])
    figure.set_layout_engine("constrained")
    figure.get_layout_engine().execute(figure)
    assert places(figure) == pytest.approx(before, abs=0.5)
