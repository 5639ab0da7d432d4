"""`lax.scan` over the first rows only: one compiled program then serves recordings of any length up to its own."""

import math
from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int


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
