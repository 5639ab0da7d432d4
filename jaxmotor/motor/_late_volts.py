"""Which voltages act in rows of lengths of their own, where each acts some time after it was asked for.

Row k begins at T_k, lasts d_k and asks for u_k, which acts from T_k + τ on, as long as the next one does not. With
C(t) the integral of u over time up to t, and j the last row with T_j + τ <= T_k,

    old = u_j,    part = min(T_{j+1} + τ - T_k, d_k)/d_k,
    new = (C(T_{k+1} - τ) - C(T_{j+1}))/(T_{k+1} - τ - T_{j+1}),

the mean of all that follow within the row: there may be several where rows before were shorter.
"""

from typing import NamedTuple

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, Int

from jaxmotor.motor._row_search import row_by
from jaxmotor.motor._scan import in_chunks, some_rows, taken
from jaxmotor.motor.effects._base import Scalar


class LateVolts(NamedTuple):
    """Of each row."""

    old: Float[Array, "n *sequence"]
    """That acts as the row begins [V]."""
    new: Float[Array, "n *sequence"]
    """That acts after it [V]."""
    part: Float[Array, "n *sequence"]
    """Of the row in which the old one acts, 0 to 1."""


def late_volts(
    delay: Scalar,
    volts: Float[Array, "n *sequence"],
    reset: Bool[Array, "n *sequence"],
    duration: Float[Array, "n *sequence"],
    typical: Scalar,
    used: Int[Array, ""] | None = None,
    *,
    early: bool,
) -> LateVolts:
    """Where `volts` act `delay` [s] after the begin of their row; before those of an experiment, which begins at
    `reset`, there is none. With `early` they may act before, by a row at most. Of `used` rows, or of all; `typical` is
    about how long they last [s]."""
    # Motors side by side have an axis that rows have not.
    shape = jnp.broadcast_shapes(delay.shape, volts.shape[1:])
    delay = jnp.broadcast_to(delay, (1, *shape))
    duration = jnp.broadcast_to(duration, volts.shape)
    number = jnp.arange(len(volts), dtype=jnp.int32).reshape(-1, *(1,) * (volts.ndim - 1))
    begin = jax.lax.cummax(jnp.where(reset, number, 0), axis=0)
    last = jnp.broadcast_to(number, volts.shape)
    if early:
        ends = jnp.concatenate([reset[1:], jnp.ones_like(reset[:1])])
        last = jnp.where(ends, number, number + 1)
    time, charge = (
        jnp.concatenate([jnp.zeros_like(one[:1]), jnp.cumsum(one, 0)]) for one in (duration, volts * duration)
    )
    every = (number, begin, last, time[:-1], time[1:], duration)

    def some(first: Int[Array, ""], size: int) -> LateVolts:
        number, begin, last, now, end, lasts = (
            jnp.broadcast_to(some_rows(one, first, size), (size, *shape)) for one in every
        )
        back = jnp.ceil(delay / typical).astype(number.dtype)
        at = row_by(time, now - delay, begin - 1, last, number - back)
        by = row_by(time, end - delay, begin - 1, last, at + 1)

        def asked(rows: Int[Array, "some *sequence"]) -> Float[Array, "some *sequence"]:
            return jnp.where(rows < begin, 0.0, taken(volts, jnp.maximum(rows, 0)))

        next_time = taken(time, at + 1)
        change = jnp.where(at < last, jnp.clip(next_time + delay - now, 0.0, lasts), lasts)
        # Several in one row: each but the last acts for a row, so that what they are divided by is not small.
        several = by > at + 1
        lasted = jnp.where(several, end - delay - next_time, 1.0)
        within = end - delay - taken(time, jnp.maximum(by, 0))
        mean = (taken(charge, jnp.maximum(by, 0)) - taken(charge, at + 1) + asked(by) * within) / lasted
        return LateVolts(asked(at), jnp.where(several, mean, asked(by)), change / lasts)

    return in_chunks(some, len(volts), used)
