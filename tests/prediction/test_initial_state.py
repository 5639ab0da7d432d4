"""Where a load is within its gap as a piece begins: anywhere, and it is found."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxmotor.motor import Motor, Rows, SecondOrder, simulate_motor
from jaxmotor.motor.effects import EFFECTS
from jaxmotor.prediction import PLACES, fit_initial_places

GAIN, POLE, GAP_RAD, RATIO, PERIOD_S = 10.0, 20.0, 0.2, 0.5, 0.002
PIECE = np.repeat([0, 1, 2], 40)
TRUE = np.array([-0.93, 0.31, 7.0, 0.0])


def residuals(begins: np.ndarray) -> np.ndarray:
    """Of each row by how far its piece's begin is off; there are more pieces than rows know of."""
    return (begins - TRUE)[:, PIECE] + 0.01


def test_a_piece_at_rest_has_the_place_that_fits_it():
    found = fit_initial_places(residuals, np.array([0.0, 0.9, 5.0, 0.0]), PIECE, np.array([False, False, True, False]))
    assert found[:2] == pytest.approx(TRUE[:2], abs=0.04)
    assert found[2] == 5.0


def test_a_place_is_within_the_gap():
    begins = np.zeros(4)
    found = fit_initial_places(lambda tried: residuals(tried - 2.0), begins, PIECE, np.zeros(4, bool))
    assert found[0] == 1.0 and found[1] == 1.0


def test_what_fits_best_stays():
    """Between two places that are tried, too."""
    begins = np.array([0.5 * (PLACES[0] + PLACES[1]) + 0.01, 0.31, 0.0, 0.0])

    def off(tried: np.ndarray) -> np.ndarray:
        return (tried - begins)[:, PIECE]

    assert np.array_equal(fit_initial_places(off, begins, PIECE, np.zeros(4, bool)), begins)


@pytest.fixture
def turned(x64) -> dict[float, np.ndarray]:
    """Angle [rad] of a motor that is driven from rest, by the place of its load."""
    size = 200
    time, none = jnp.asarray(np.arange(size) * PERIOD_S), jnp.zeros(size)
    linear = SecondOrder(jnp.asarray(GAIN), jnp.asarray(POLE), jnp.asarray(0.0))
    backlash = EFFECTS["backlash"].of(gap_rad=GAP_RAD, inertia_ratio=RATIO)
    motor = Motor(linear, (jax.tree.map(jnp.asarray, backlash),), jnp.asarray(0.0))

    def run(place: float) -> np.ndarray:
        rows = Rows(none + 6.0, time == 0, none, time, place=none + place)
        return np.cumsum(simulate_motor(motor, rows, jnp.asarray(PERIOD_S), jnp.asarray(6.0)).turn)

    return {place: run(place) for place in (-1.0, 0.0, 1.0)}


def test_a_load_at_the_far_edge_is_not_moved_at_first(turned):
    """The rotor alone until it has crossed the gap, half of it or none."""
    pole, time = POLE, PERIOD_S * np.arange(1, 201)
    alone = 6.0 * GAIN * (time - (1 - np.exp(-pole * time)) / pole)
    for place in (-1.0, 0.0):
        free = alone < (1 - place) / 2 * GAP_RAD
        assert turned[place][free] == pytest.approx(alone[free], abs=1e-9)
        assert turned[place][free.sum() + 10] < alone[free.sum() + 10] - 0.01


def test_a_load_at_the_near_edge_is_moved_at_once(turned):
    """About as one motor with both inertias, which the contact's spring makes a little softer."""
    pole, time = POLE / (1 + RATIO), PERIOD_S * np.arange(1, 201)
    both = 6.0 * GAIN * (time - (1 - np.exp(-pole * time)) / pole)
    assert turned[1.0][30:] == pytest.approx(both[30:], abs=0.03)
    assert turned[0.0][60] > turned[1.0][60]
