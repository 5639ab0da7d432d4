"""The encoder's own error, and residuals freed of its correlation.

A count is floor(θ N/2π + c): its error is uniform, variance 1/12. A difference of two counts has variance 1/6 and
shares an error with its neighbours, covariance -1/12. Differences whitened with exactly that are as good as positions
with a free offset, millions of times better than they look, and fragile: a torque that wanders by a hair counts as
hundreds of standard errors. With a process term q >= 0 [counts² per tick]

    Cov(d) = tridiagonal(1/6 + q, -1/12)

q = 0 is the encoder alone, q -> ∞ ordinary least squares on differences. The Cholesky factor is one pass:

    D_1 = 1/6 + q,  e_1 = r_1;   l_k = (1/12)/D_{k-1},  D_k = 1/6 + q - (1/12) l_k,  e_k = r_k + l_k e_{k-1}

with whitened residuals e_k/√D_k and log det = Σ log D_k.
"""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float


def whiten(
    columns: Float[Array, "n c"],
    begins: Bool[Array, " n"],
    valid: Bool[Array, " n"],
    variance: Float[Array, ""],
    shared: Float[Array, ""],
) -> tuple[Float[Array, "n c"], Float[Array, ""]]:
    """`columns` freed of the tridiagonal covariance (`variance`, -`shared`), and the log determinant of it.

    A run of correlated rows ends where `begins` is true or a row is not `valid`; rows not valid come out as zero.
    """

    def row(carry, now):
        before, error = carry
        values, begins, valid = now
        link = jnp.where(begins, 0.0, shared / before)
        spread = variance - shared * link
        error = jnp.where(valid, values + link * error, 0.0)
        white = error / jnp.sqrt(spread)
        return (jnp.where(valid, spread, jnp.inf), error), (white, jnp.where(valid, jnp.log(spread), 0.0))

    start = (jnp.full_like(variance, jnp.inf), jnp.zeros_like(columns[0]))
    _, (white, log_spread) = jax.lax.scan(row, start, (columns, begins, valid))
    return white, log_spread.sum()
