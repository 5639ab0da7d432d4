"""`lax.scan` over the first rows only: one compiled program then serves recordings of any length up to its own."""

import math
from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

CHUNK = 128
"""Rows that are computed side by side."""


def scan_rows(
    step: Callable[[Any, Any], tuple[Any, Any]], carry: Any, rows: Any, count: Int[Array, ""] | None = None
) -> tuple[Any, Any]:
    """As `lax.scan(step, carry, rows)`, but only over `count` rows; what it gives of the others is zero."""
    if count is None:
        return jax.lax.scan(step, carry, rows)

    # Traced once for the shapes of its results, and once more for the loop, unless it is known to be the same.
    step = jax.jit(step, inline=True)

    def at(k: Int[Array, ""]) -> Any:
        return jax.tree.map(lambda leaf: jax.lax.dynamic_index_in_dim(leaf, k, 0, keepdims=False), rows)

    def body(k: Int[Array, ""], state: tuple[Any, Any]) -> tuple[Any, Any]:
        carry, out = step(state[0], at(k))
        put = jax.tree.map(lambda all_, one: jax.lax.dynamic_update_index_in_dim(all_, one, k, 0), state[1], out)
        return carry, put

    size = jax.tree.leaves(rows)[0].shape[0]
    _, shape = jax.eval_shape(step, carry, at(jnp.zeros((), jnp.int32)))
    out = jax.tree.map(lambda leaf: jnp.zeros((size, *leaf.shape), leaf.dtype), shape)
    return jax.lax.fori_loop(0, count, body, (carry, out))


def taken(values: Float[Array, "row ..."], rows: Int[Array, "some ..."]) -> Float[Array, "some ..."]:
    """`values` of `rows`, all of which there are: one index into all values takes a quarter of the time of several."""
    column = jnp.arange(math.prod(values.shape[1:]), dtype=rows.dtype).reshape(1, *values.shape[1:])
    return values.reshape(-1).at[rows * column.size + column].get(mode="promise_in_bounds")


def in_chunks(some: Callable[[Int[Array, ""], int], Any], rows: int, used: Int[Array, ""] | None = None) -> Any:
    """What `some(begin, number)` gives of `number` rows from `begin` on, for all `rows`: as many at a time as `CHUNK`,
    and only the `used` ones, where that is given; of the others it is zero."""
    if used is None:
        return some(jnp.zeros((), jnp.int32), rows)
    chunk = min(CHUNK, rows)

    def put(number: Int[Array, ""], every: Any) -> Any:
        at = jnp.minimum(number * chunk, rows - chunk)
        return jax.tree.map(
            lambda whole, part: jax.lax.dynamic_update_slice_in_dim(whole, part, at, 0), every, some(at, chunk)
        )

    shapes = jax.eval_shape(lambda at: some(at, chunk), jax.ShapeDtypeStruct((), jnp.int32))
    every = jax.tree.map(lambda part: jnp.zeros((rows, *part.shape[1:]), part.dtype), shapes)
    return jax.lax.fori_loop(0, (used + chunk - 1) // chunk, put, every)


def some_rows(values: Array, begin: Int[Array, ""], number: int) -> Array:
    """`number` rows of `values` (row, ...) from row `begin` on; all of them where they are one, or no array of rows."""
    if values.ndim == 0 or values.shape[0] == 1:
        return values
    return jax.lax.dynamic_slice_in_dim(values, begin, number, 0)
