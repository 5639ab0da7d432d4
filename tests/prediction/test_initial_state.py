"""Where a load is within its gap as a piece begins: anywhere, and it is found."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxmotor.motor import Motor, Rows, SecondOrder, simulate_motor
from jaxmotor.motor.effects import EFFECTS
from jaxmotor.prediction import PLACES, as_begins, fit_initial_places, fit_initial_speeds

GAIN, POLE, GAP_RAD, RATIO, PERIOD_S = 10.0, 20.0, 0.2, 0.5, 0.002
PIECE = np.repeat([0, 1, 2], 40)
SPEEDS, PLACE = np.array([0.0, 9.0, 0.0, 0.0]), np.array([-0.93, 0.31, 0.6, 0.0])
"""Of pieces, of which rows know but three."""


def residuals(begins: np.ndarray) -> np.ndarray:
    """Of each row by how far its piece's place is off."""
    assert np.array_equal(begins[:, :4], np.broadcast_to(SPEEDS, (len(begins), 4)))
    return (begins[:, 4:] - PLACE)[:, PIECE] + 0.01


def test_each_piece_has_the_place_that_fits_it():
    found = fit_initial_places(residuals, np.concatenate([SPEEDS, np.zeros(4)]), PIECE)
    assert found[4:] == pytest.approx(PLACE, abs=0.04)
    assert np.array_equal(found[:4], SPEEDS)


def test_a_place_is_within_the_gap():
    far = np.concatenate([np.zeros(4), np.full(4, 2.0)])
    found = fit_initial_places(lambda tried: residuals(tried - far), np.concatenate([SPEEDS, np.zeros(4)]), PIECE)
    assert np.array_equal(found[4:7], np.ones(3))


def test_what_fits_best_stays():
    """Between two places that are tried, too."""
    begins = np.concatenate([SPEEDS, np.full(4, 0.5 * (PLACES[0] + PLACES[1]) + 0.01)])

    def off(tried: np.ndarray) -> np.ndarray:
        return (tried - begins)[:, 4:][:, PIECE]

    assert np.array_equal(fit_initial_places(off, begins, PIECE), begins)


def test_speeds_are_fitted_beside_places():
    """Only of pieces that begin in motion."""
    true = np.concatenate([[3.0, 9.0, 4.0, 0.0], PLACE])

    def off(tried: np.ndarray) -> np.ndarray:
        return (tried - true)[:, :4][:, PIECE]

    start = np.concatenate([SPEEDS - 1.0, PLACE])[None]
    [found] = fit_initial_speeds(off, start, PIECE, np.array([True, True, False, False]))
    assert found == pytest.approx(np.concatenate([[3.0, 9.0, -1.0, -1.0], PLACE]))


def test_begins_are_those_of_the_motor(x64):
    linear = SecondOrder(*map(jnp.asarray, (GAIN, POLE, 0.0)))
    plain, gap = Motor(linear), Motor(linear, (EFFECTS["backlash"].of(gap_rad=GAP_RAD, inertia_ratio=RATIO),))
    both = np.concatenate([SPEEDS, PLACE])
    assert np.array_equal(as_begins(both, 4, gap), both)
    assert np.array_equal(as_begins(SPEEDS, 4, gap), np.concatenate([SPEEDS, np.zeros(4)]))
    assert np.array_equal(as_begins(both, 4, plain), SPEEDS)


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
