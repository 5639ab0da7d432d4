"""The sine that simulations take at every step, against numpy's."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxmotor.motor.effects._sine import sine


@pytest.mark.parametrize("turns", [1.0, 1e3, 1e6])
def test_it_is_the_sine(turns, x64):
    x = 2 * np.pi * np.random.default_rng(0).uniform(-turns, turns, 20_000)
    np.testing.assert_allclose(sine(jnp.asarray(x)), np.sin(x), atol=1e-15)
    np.testing.assert_allclose(jax.vmap(jax.grad(sine))(jnp.asarray(x)), np.cos(x), atol=1e-14)


def test_it_is_the_sine_where_it_turns(x64):
    x = np.pi / 2 * np.arange(-8, 9)[:, None] + np.array([-1e-9, 0.0, 1e-9])
    np.testing.assert_allclose(sine(jnp.asarray(x)), np.sin(x), atol=1e-15)


def test_single_precision_has_its_own(x64):
    x = np.linspace(-300, 300, 1001, dtype=np.float32)
    np.testing.assert_allclose(sine(jnp.asarray(x)), np.sin(x), atol=1e-6)
