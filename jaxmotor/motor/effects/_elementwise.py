"""Functions of single motors, for many motors and experiments side by side."""

from collections.abc import Callable
from typing import Any

import jax
import jax.numpy as jnp


def elementwise(function: Callable[..., Any], trees: tuple[Any, ...], rank: int | None = None) -> Any:
    """`function` of `trees` of numbers, for each element of arrays in their place, which broadcast.

    Axes of what it returns come before those of the arrays. With `rank` only the last so many axes are elements, and
    those before them are `function`'s own. It is computed once for elements along which nothing changes.
    """
    leaves, tree = jax.tree.flatten(trees)
    rank = max(jnp.ndim(leaf) for leaf in leaves) if rank is None else rank
    leaves = [jnp.reshape(leaf, (1,) * (rank - jnp.ndim(leaf)) + jnp.shape(leaf)) for leaf in leaves]
    if rank == 0:
        return function(*trees)
    one = [leaf.shape[-rank] == 1 for leaf in leaves]
    axes = [None if single else leaf.ndim - rank for leaf, single in zip(leaves, one, strict=True)]
    leaves = [jnp.squeeze(leaf, -rank) if single else leaf for leaf, single in zip(leaves, one, strict=True)]

    def inner(*leaves: jax.Array) -> Any:
        return elementwise(function, jax.tree.unflatten(tree, leaves), rank - 1)

    if all(one):
        return jax.tree.map(lambda leaf: jnp.expand_dims(leaf, -rank), inner(*leaves))
    return jax.vmap(inner, axes, -rank)(*leaves)
