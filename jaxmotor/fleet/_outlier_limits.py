"""How far from the rest one of a few normal points may lie, where centre and covariance are estimated from them too.

A point that was not among the m that they were estimated from has d² ~ p (m² - 1)/(m (m - p)) F(p, m - p) in p
dimensions; one that was among them has d² ~ (m - 1)²/m Beta(p/2, (m - p - 1)/2), less, since it drew them to itself
(Wilks, "Multivariate statistical outliers", Sankhya A 25, 1963). For large m both are chi-square.
"""

import math


def farthest(number: float, size: int, share: float) -> tuple[float, float]:
    """Distances [standard deviations] that `share` of all points exceed: of those in the `number`, and of others."""
    from scipy.special import betainccinv

    left = number - size
    if left < 2:
        return math.inf, math.inf
    own = (number - 1) ** 2 / number * betainccinv(size / 2, (left - 1) / 2, share)
    ratio = betainccinv(size / 2, left / 2, share)
    other = (number**2 - 1) / number * ratio / (1 - ratio) if ratio < 1 else math.inf
    return math.sqrt(own), math.sqrt(other)
