"""Rows of a log by the time at which they begin."""

from collections.abc import Callable

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from jaxmotor.motor._scan import taken


def row_by(
    time: Float[Array, "row ..."],
    moment: Float[Array, "some *sequence"],
    first: Int[Array, "some ..."],
    last: Int[Array, "some ..."],
    near: Int[Array, "some *sequence"],
) -> Int[Array, "some *sequence"]:
    """The last row from `first` to `last` that begins by each `moment` [s], of those that begin at `time` [s]; `first`
    where none of them does, which may be the row before the first one, -1.

    It is sought from `near` on, row by row.
    """

    def is_late(row: Int[Array, "some *sequence"]) -> Bool[Array, "some *sequence"]:
        return (row > first) & (taken(time, jnp.maximum(row, 0)) > moment)

    def is_early(row: Int[Array, "some *sequence"]) -> Bool[Array, "some *sequence"]:
        return (row < last) & (taken(time, jnp.minimum(row + 1, last)) <= moment)

    return _walked(is_early, 1, _walked(is_late, -1, jnp.clip(near, first, last)))


def _walked(
    goes_on: Callable[[Int[Array, "some *sequence"]], Bool[Array, "some *sequence"]],
    way: int,
    row: Int[Array, "some *sequence"],
) -> Int[Array, "some *sequence"]:
    """`row`, or as many rows on as it `goes_on`."""

    def on(state: tuple[Array, Array]) -> tuple[Array, Array]:
        row = state[0] + jnp.where(state[1], way, 0)
        return row, goes_on(row)

    return jax.lax.while_loop(lambda state: state[1].any(), on, (row, goes_on(row)))[0]
