"""How sure an effect may be named where the motor that has it leaves something unexplained.

The weights of models say which of the laws that were tried predicts best. Where none of them leaves but the noise, the
best one may only imitate a law that nobody tried. With s the share of the residual beside the noise that stays
(`Named.unexplained_share`), the probability that the effect is there, and not an imitation, is

    1 / (1 + (s / s0)^k).

s0 and k are a logistic regression on recordings of a plant of its own in which a law was hidden that was left out of
what was sought, or that no effect is (`benchmarks/other_world.py --parts without outside` prints it). So far they are
few: docs/other-world.md lists them.
"""

from typing import NamedTuple


class Logistic(NamedTuple):
    """1 / (1 + (s / half)^power)."""

    half: float
    """The share at which it is as likely as not."""
    power: float

    def __call__(self, share: float) -> float:
        """Probability [1] where a `share` [1] of the residual stays unexplained."""
        return 1 / (1 + (max(share, 0.0) / self.half) ** self.power)


OF_NAME, OF_FAMILY = Logistic(0.018, 1.8), Logistic(0.29, 1.2)
"""That it is this effect; that it is one of its family."""


def of_name(share: float, held_out: float) -> float:
    """Probability that an effect is there, and not another one that it imitates, by the larger of the shares that stay
    unexplained of rows that were fitted and of others."""
    return OF_NAME(max(share, held_out))
