"""Motors as vectors of unconstrained numbers."""

import jax
import numpy as np
import pytest

from jaxmotor.diagnosis._errors import slopes_of
from jaxmotor.diagnosis._free import OWN, free_of, layout_of, linear_of, motor_at, motors_at, moved, together
from jaxmotor.motor.effects import EFFECTS

pytestmark = pytest.mark.usefixtures("x64")
TEMPLATE = linear_of(
    -11.0, 40.0, 6e-5, 0.04, (EFFECTS["stiction"].start(), EFFECTS["cogging"].start(cycles_per_rev=3.0))
)


def test_a_motor_comes_back_from_its_free_vector():
    again = motor_at(TEMPLATE, free_of(TEMPLATE))
    assert jax.tree.structure(again) == jax.tree.structure(TEMPLATE)
    for own, other in zip(jax.tree.leaves(again), jax.tree.leaves(TEMPLATE), strict=True):
        assert float(own) == pytest.approx(float(other), rel=1e-12, abs=1e-15)


def test_slopes_are_those_of_the_parameters():
    """Static friction moves with the moving one, to which its ratio is fitted."""
    free, width = free_of(TEMPLATE), 1e-6
    slopes = slopes_of(TEMPLATE.effects[0], OWN, len(free))
    for at in range(len(free)):
        there = [motor_at(TEMPLATE, free + way * width * np.eye(len(free))[at]).effects[0] for way in (-1, 1)]
        for name, slope in slopes.items():
            low, high = (float(getattr(one, name)) for one in there)
            assert slope[at] == pytest.approx((high - low) / (2 * width), rel=1e-6, abs=1e-9)
    names = layout_of(TEMPLATE.effects).names
    assert layout_of(TEMPLATE.effects).low[names.index("stiction.static_volts_V")] == 0.0


def test_many_motors_as_one_are_each_of_them():
    frees = free_of(TEMPLATE) * (1 + 0.1 * np.arange(3)[:, None])
    many, each = motors_at(TEMPLATE, frees), together([motor_at(TEMPLATE, free) for free in frees])
    assert jax.tree.structure(many) == jax.tree.structure(each)
    for own, other in zip(jax.tree.leaves(many), jax.tree.leaves(each), strict=True):
        np.testing.assert_allclose(own, other, rtol=1e-14)


def test_a_wild_motor_is_infinite_and_no_warning():
    """A fit that strays there finds residuals that are none, and turns back."""
    frees = np.stack([free_of(TEMPLATE), free_of(TEMPLATE)])
    frees[1, 0] = 800.0
    gains = motors_at(TEMPLATE, frees).linear.gain
    assert gains[0] == pytest.approx(-11.0) and gains[1] == -np.inf


def test_steps_move_the_pole_of_rotor_and_load_together_as_far_whatever_their_size():
    load = EFFECTS["shaft_compliance"].start()
    template = linear_of(11.0, 40.0, 6e-5, 0.04, (load,))
    free = free_of(template)
    step = np.zeros(len(free))
    step[1], step[4:] = 0.03, np.linspace(0.2, 0.7, len(free) - 4)

    def total(free: np.ndarray) -> float:
        motor = motor_at(template, free)
        return float(motor.linear.pole) / (1 + float(motor.effects[0].load().ratio))

    tiny = 1e-6
    slope = np.log(total(free + tiny * step) / total(free)) / tiny
    shares = np.array([1e-3, 0.5, 1.0])
    for share, there in zip(shares, moved(template, free, shares[:, None] * step), strict=True):
        assert np.log(total(there) / total(free)) == pytest.approx(share * slope, rel=1e-5)
        # All else goes where the step says.
        np.testing.assert_allclose(np.delete(there, 1), np.delete(free + share * step, 1), rtol=1e-15)


def test_steps_without_a_load_are_plain_sums():
    free = free_of(TEMPLATE)
    steps = np.stack([np.full(len(free), 0.1), np.full(len(free), -0.7)])
    np.testing.assert_array_equal(moved(TEMPLATE, free, steps), free + steps)
