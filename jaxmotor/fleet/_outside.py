"""How far from the rest one of a few normal points may lie, where centre and covariance are estimated from them too.

A point that was not among the m that they were estimated from has d² ~ p (m² - 1)/(m (m - p)) F(p, m - p) in p
dimensions; one that was among them has d² ~ (m - 1)²/m Beta(p/2, (m - p - 1)/2), less, since it drew them to itself
(Wilks, "Multivariate statistical outliers", Sankhya A 25, 1963). For large m both are chi-square.
"""

import math

STEPS, TINY = 1000, 1e-300
"""Of the continued fraction, and what stands for nothing in it."""


def farthest(number: float, size: int, share: float) -> tuple[float, float]:
    """Distances [standard deviations] that `share` of all points exceed: of those in the `number`, and of others."""
    left = number - size
    if left < 2:
        return math.inf, math.inf
    own = (number - 1) ** 2 / number * beta_above(share, size / 2, (left - 1) / 2)
    ratio = beta_above(share, size / 2, left / 2)
    other = (number**2 - 1) / number * ratio / (1 - ratio) if ratio < 1 else math.inf
    return math.sqrt(own), math.sqrt(other)


def beta_above(share: float, a: float, b: float) -> float:
    """What `share` of Beta(a, b) exceeds, by bisection."""
    low, high = 0.0, 1.0
    for _ in range(60):
        middle = (low + high) / 2
        # Above x as well as Beta(b, a) below 1 - x: small shares keep their digits.
        low, high = (middle, high) if beta_below(1 - middle, b, a) > share else (low, middle)
    return (low + high) / 2


def beta_below(x: float, a: float, b: float) -> float:
    """Share of Beta(a, b) below `x`: the incomplete beta function by its continued fraction, as Lentz evaluates it."""
    if x <= 0 or x >= 1:
        return float(x >= 1)
    if x > (a + 1) / (a + b + 2):
        return 1 - beta_below(1 - x, b, a)
    log_front = a * math.log(x) + b * math.log1p(-x) + math.lgamma(a + b) - math.lgamma(a) - math.lgamma(b)
    up, down = 1.0, 1 / _not_none(1 - (a + b) * x / (a + 1))
    value = down
    for k in range(1, STEPS):
        even = k * (b - k) * x / ((a + 2 * k - 1) * (a + 2 * k))
        odd = -(a + k) * (a + b + k) * x / ((a + 2 * k) * (a + 2 * k + 1))
        before = value
        for term in (even, odd):
            down, up = 1 / _not_none(1 + term * down), _not_none(1 + term / up)
            value *= down * up
        if abs(value - before) <= 1e-15 * abs(value):
            break
    return math.exp(log_front) * value / a


def _not_none(x: float) -> float:
    return x if abs(x) > TINY else TINY
