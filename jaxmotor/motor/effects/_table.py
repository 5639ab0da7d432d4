"""The linear part over steps of many lengths: computed for some, interpolated for the others."""

from collections.abc import Callable

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from jaxmotor.motor.effects._base import Scalar
from jaxmotor.motor.effects._elementwise import elementwise
from jaxmotor.motor.effects._substep import Linear

NODES, ORDER = 256, 6
"""Lengths that are computed, and how many of them each interpolation uses."""
SHORT = 0.02
"""Of the typical length: shorter ones are evenly spaced."""


def tabulated(over: Callable[[Scalar], Linear], lengths: Float[Array, " 2"]) -> Callable[[Scalar], Linear]:
    """`over` by interpolation; `lengths` are a typical one and the longest [s], which longer ones are taken for.

    Nodes are a few percent of the length apart: what decays within a step is over before that is far.
    """
    short, longest = SHORT * lengths[0], lengths[1]
    spacing = jnp.arcsinh(longest / short) / (NODES - 1)
    nodes = short * jnp.sinh(spacing * jnp.arange(NODES, dtype=lengths.dtype))
    table = jax.vmap(over)(nodes)

    def one(table: Linear, length: Scalar) -> Linear:
        # A polynomial knows nothing of what is beyond its nodes: padding, and rows that no other one follows.
        length = jnp.minimum(length, longest)
        place = jnp.arcsinh(length / short) / spacing
        first = jnp.clip(jnp.floor(place).astype(jnp.int32) - (ORDER // 2 - 1), 0, NODES - ORDER)
        weights = _lagrange(place - first.astype(place.dtype))

        def mean(leaf: Float[Array, "nodes *shape"]) -> Float[Array, "*shape"]:
            return jnp.tensordot(weights, jax.lax.dynamic_slice_in_dim(leaf, first, ORDER), 1)

        return jax.tree.map(mean, table)._replace(duration=length)

    return lambda length: elementwise(one, (table, length), table.duration.ndim - 1)


def _lagrange(place: Scalar) -> Float[Array, " order"]:
    """Weights of values at 0, 1, ..., `ORDER` - 1 for a polynomial through them at `place`."""
    weights = []
    for k in range(ORDER):
        others = [n for n in range(ORDER) if n != k]
        weight = jnp.ones_like(place)
        for n in others:
            weight = weight * ((place - n) / (k - n))
        weights.append(weight)
    return jnp.stack(weights)
