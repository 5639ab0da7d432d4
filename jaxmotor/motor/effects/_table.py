"""The linear part over steps of many lengths: computed for some, interpolated for the others."""

import math
from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from jaxmotor.motor.effects._base import Scalar
from jaxmotor.motor.effects._elementwise import elementwise
from jaxmotor.motor.effects._propagate import Matrix
from jaxmotor.motor.effects._substep import Linear

FEW, MANY, ORDER = 128, 256, 6
"""Lengths that are computed, for parts in 1e8 and 1e9, and how many of them each interpolation uses."""
FEW_ROWS = 2048
"""Up to which few lengths are computed: many would take as long as all rows."""
SHORT = 0.02
"""Of the typical length: shorter ones are evenly spaced."""


def tabulated(over: Callable[[Scalar], Linear], lengths: Float[Array, " 2"], rows: int) -> Callable[[Scalar], Linear]:
    """`over` of so many `rows` by interpolation; `lengths` are a typical one and the longest [s], which longer ones are
    taken for.

    Nodes are a few percent of the length apart: what decays within a step is over before that is far.
    """
    short, longest = SHORT * lengths[0], lengths[1]
    number = FEW if rows <= FEW_ROWS else MANY
    spacing = jnp.arcsinh(longest / short) / (number - 1)
    nodes = short * jnp.sinh(spacing * jnp.arange(number, dtype=lengths.dtype))
    table = jax.vmap(over)(nodes)
    rank = table.duration.ndim - 1

    def at(length: Scalar) -> Linear:
        # A polynomial knows nothing of what is beyond its nodes: padding, and rows that no other one follows.
        length = jnp.minimum(jnp.reshape(length, (1,) * (rank - jnp.ndim(length)) + jnp.shape(length)), longest)
        place = jnp.arcsinh(length / short) / spacing
        first = jnp.clip(jnp.floor(place).astype(jnp.int32) - (ORDER // 2 - 1), 0, number - ORDER)
        weights = _lagrange(place - first.astype(place.dtype))

        closed, open_ = jax.tree.map(lambda matrices: _mean(matrices, first, weights), (table.closed, table.open))
        return Linear(length, closed, open_, None if table.lag is None else table.lag[0])

    return at


def _mean(
    table: Float[Array, "nodes n m *own"], first: Int[Array, "*asked"], weights: Float[Array, "order *asked"]
) -> Matrix:
    """The weighted mean of `ORDER` matrices from node `first` on, for each element of arrays that broadcast.

    Where steps are as long in many motors, the numbers of all these are read as they lie in the table.
    """
    size, own = table.shape[1:3], table.shape[3:]
    alike = sum(one == 1 for one in own)
    if own[:alike] != (1,) * alike or any(one > 1 for one in first.shape[alike:]):

        def one(table: Float[Array, "nodes n m"], first: Int[Array, ""], *weights: Scalar) -> Matrix:
            return jnp.tensordot(jnp.stack(weights), jax.lax.dynamic_slice_in_dim(table, first, ORDER), 1)

        return elementwise(one, (table, first, *weights), first.ndim)
    rows, place, weights = table.reshape(len(table), -1), first.reshape(-1), weights.reshape(ORDER, -1, 1)

    def add(k: Int[Array, ""], total: Float[Array, "place number"]) -> Float[Array, "place number"]:
        return total + weights[k] * rows.at[place + k].get(mode="promise_in_bounds")

    # One after the other, in a loop: XLA adds eight numbers at a time then, but gathers all of them, one by one and in
    # three times the time, where it may.
    total = jax.lax.fori_loop(0, ORDER, add, jnp.zeros((len(place), rows.shape[1]), rows.dtype))
    means = jnp.moveaxis(total.reshape(len(place), *size, *own[alike:]), 0, 2)
    return means.reshape(*size, *first.shape[:alike], *own[alike:])


def _lagrange(place: Scalar) -> Float[Array, "order ..."]:
    """Weights of values at 0, 1, ..., `ORDER` - 1 for a polynomial through them at `place`."""
    past = [place - n for n in range(ORDER)]
    products = [math.prod(past[n] for n in range(ORDER) if n != k) for k in range(ORDER)]
    between = np.array([math.prod(k - n for n in range(ORDER) if n != k) for k in range(ORDER)], dtype=place.dtype)
    return jnp.stack(products) / between.reshape(ORDER, *(1,) * place.ndim)
