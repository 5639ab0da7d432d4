"""Motors as vectors of unconstrained numbers."""

import jax
import numpy as np
import pytest

from jaxmotor.diagnosis._free import free_of, linear_of, motor_at, motors_at, together
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
