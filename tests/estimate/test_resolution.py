"""The noise of logs of angles and speeds: the grid that their values lie on, or what their differences show."""

import numpy as np
import pytest

from jaxmotor.prediction import resolution

COUNT = 2 * np.pi / 1200


def turned(rows=2000):
    """A motion that goes on in one direction, now faster and now slower."""
    return np.cumsum(0.04 + 0.03 * np.sin(0.1 * np.arange(rows)))


def test_an_encoder_that_never_comes_back_is_found():
    """Each value is seen once or twice; the text has nine digits of radians."""
    angle = np.round(np.floor(turned() / COUNT) * COUNT, 9)
    step, grid = resolution([angle])
    assert grid and step == pytest.approx(COUNT, rel=1e-6)


@pytest.mark.parametrize("place", [1e-3, 2e-3, np.radians(0.05), 2e-4 * np.pi])
def test_decimals_are_no_encoder(place):
    """A noise of thirty steps, written with so many digits."""
    noise = 30 * place * np.random.default_rng(0).standard_normal(2000)
    smooth = 400 * place * np.arange(2000)
    step, grid = resolution([np.round((smooth + noise) / place) * place])
    assert not grid and step / np.sqrt(12) == pytest.approx(30 * place, rel=0.2)


def test_decimals_that_come_again_are_one():
    step, grid = resolution([np.round(np.sin(0.1 * np.arange(3000)), 2)])
    assert grid and step == pytest.approx(0.01, rel=1e-6)


def test_values_without_a_grid_have_noise():
    noise = 1e-3 * np.random.default_rng(1).standard_normal(2000)
    step, grid = resolution([turned() + noise])
    assert not grid and step / np.sqrt(12) == pytest.approx(1e-3, rel=0.2)
