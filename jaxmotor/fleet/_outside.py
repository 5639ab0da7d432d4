"""How far from the rest one of a few normal points may lie, where centre and covariance are estimated from them too.

A point that was not among the m that they were estimated from has d² ~ p (m² - 1)/(m (m - p)) F(p, m - p) in p
dimensions; one that was among them has d² ~ (m - 1)²/m Beta(p/2, (m - p - 1)/2), less, since it drew them to itself
(Wilks, "Multivariate statistical outliers", Sankhya A 25, 1963). For large m both are chi-square.
"""

import math

import jax
import jax.numpy as jnp
from jax.scipy.special import betainc
from jaxtyping import Array, Float

from jaxmotor._precision import in_float64


def farthest(number: float, size: int, share: float) -> tuple[float, float]:
    """Distances [standard deviations] that `share` of all points exceed: of those in the `number`, and of others."""
    left = number - size
    if left < 2:
        return math.inf, math.inf
    own = (number - 1) ** 2 / number * beta_above(share, size / 2, (left - 1) / 2)
    ratio = beta_above(share, size / 2, left / 2)
    other = (number**2 - 1) / number * ratio / (1 - ratio) if ratio < 1 else math.inf
    return math.sqrt(own), math.sqrt(other)


@in_float64
def beta_above(share: float, a: float, b: float) -> float:
    """What `share` of Beta(a, b) exceeds."""
    return float(_beta_above(jnp.asarray(share), jnp.asarray(a), jnp.asarray(b)))


@jax.jit
def _beta_above(share: Float[Array, ""], a: Float[Array, ""], b: Float[Array, ""]) -> Float[Array, ""]:
    def half(_, ends: Float[Array, " 2"]) -> Float[Array, " 2"]:
        middle = ends.mean()
        # Above x as well as Beta(b, a) below 1 - x: small shares keep their digits.
        return ends.at[jnp.where(betainc(b, a, 1 - middle) > share, 0, 1)].set(middle)

    return jax.lax.fori_loop(0, 60, half, jnp.array([0.0, 1.0])).mean()
