"""What the tests check of types and shapes while they run."""

import dataclasses

import jax.numpy as jnp
import pytest
from checked_types import checked
from jaxtyping import Array, Float

from jaxmotor._programs import program
from jaxmotor.motor import FirstOrder, Motor

VIOLATION = "violates type hint"
"""Without it an error may be one of the computation, such as a product of arrays that do not fit."""


@checked
def both(one: Float[Array, " n"], other: Float[Array, "n k"]) -> Float[Array, " k"]:
    return one @ other


@checked
def halved(number: float) -> float:
    return "half" if number else 0.0  # pyright: ignore[reportReturnType]


@checked
@dataclasses.dataclass
class Pair:
    one: Float[Array, " n"]
    other: Float[Array, " n"]


def test_axes_of_one_name_have_one_size():
    assert both(jnp.ones(3), jnp.ones((3, 2))).shape == (2,)
    assert both(jnp.ones(4), jnp.ones((4, 1))).shape == (1,)
    with pytest.raises(TypeError, match=VIOLATION):
        both(jnp.ones(3), jnp.ones((4, 2)))
    with pytest.raises(TypeError, match=VIOLATION):
        both(jnp.ones((3, 1)), jnp.ones((3, 2)))


def test_results_are_checked():
    assert halved(0.0) == 0.0
    with pytest.raises(TypeError, match=VIOLATION):
        halved(1.0)


def test_fields_are_checked():
    Pair(jnp.ones(3), jnp.ones(3))
    with pytest.raises(TypeError, match=VIOLATION):
        Pair(jnp.ones(3), jnp.ones(4))


def test_the_package_is_checked():
    with pytest.raises(TypeError, match=VIOLATION):
        program(3)  # pyright: ignore[reportArgumentType]
    with pytest.raises(TypeError, match=VIOLATION):
        Motor(FirstOrder(jnp.ones(()), jnp.ones(())), 3)  # pyright: ignore[reportArgumentType]
