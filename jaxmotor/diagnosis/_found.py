"""Where a search for effects ended, and what counts as explained."""

import dataclasses

from jaxmotor.diagnosis._solve import Fitted

NEARLY = 1.06
"""chi2 per sample up to which motors scatter that leave nothing but the encoder's error."""
EXPLAINED = 1.15
"""chi2 per sample up to which nothing is unexplained; two laws are not that exact themselves."""
OFF = 0.03
"""Share of what an effect explains that it may leave beside the noise's scatter, while that stays below `EXPLAINED`."""
LAW_OFF = 0.1
"""The same of an effect whose law is known to be inexact, up to its `explained_chi2`."""
INEXACT = 0.03
"""Amplitude that is left, over what the linear motor leaves, up to which nothing is unexplained where the noise is not
known: no law of friction or of a drive is more exact on a real motor."""
LEAST = 0.1
"""Part of the mean square, beside the noise where that is known, that an effect must take up where more is left than
noise: some law takes up a little of anything."""
COARSE = 2e-4
"""Part of chi2 that a step of a fit must promise while effects are compared; `FINE` once they are chosen."""
FINE = 1e-6
"""Part of chi2 that a step of the last fit must promise."""
NONE = "none"
"""In the place of an effect's name: the linear motor."""
STAYS = 0.5
"""Probability, of it or what it may as well be, from which an effect stays in the motor, and its family is told."""
NAMED = 0.9
"""The same from which it is told by its name, as a cause: by what is stated, one name in ten is wrong at most."""


@dataclasses.dataclass(frozen=True, eq=False)
class Named:
    """One effect of the motor that was found, and what else could be in its place."""

    name: str
    alternatives: tuple[Fitted, ...]
    """Motors with another effect in its place, the best first."""
    probability: float
    """The sum of the weights of all models that have it."""
    with_equal: float
    """The same with effects that are not told from it."""
    equal: frozenset[str]
    """The same: effects of `alternatives` that blocks left out do not tell from it."""
    unexplained_share: float
    """Of the residual that a motor without it leaves, beside the noise, the share that stays unexplained with it."""
    with_law: float = 0.0
    """As `with_equal`, with laws that contain the effect; of a known law in a log whose noise is not known without
    curves, which have no name."""
    held_out_share: float = 0.0
    """As `unexplained_share`, of rows that were held out, where something of the fitted ones stays unexplained, too."""


@dataclasses.dataclass(frozen=True, eq=False)
class Found:
    """Where the search ended."""

    linear: Fitted
    fitted: Fitted
    named: tuple[Named, ...]
    probabilities: dict[str, float]
    """Of each effect that was tried, the sum of the weights of all models that have it, the largest first; of `none`,
    the linear motor's weight. Nothing where none is trusted."""
    families: dict[str, float]
    """The same of each family of effects that was tried."""
    unexplained_share: float = 0.0
    """Of the residual that the linear motor leaves, beside the noise, the share that stays unexplained."""
    held_out_share: float = 0.0
    """As in `Named`."""


@dataclasses.dataclass(frozen=True, eq=False)
class Explained:
    """When a motor leaves nothing unexplained of a recording."""

    linear_chi2: float
    """Of the linear motor."""
    noise_known: bool
    noise: float = NEARLY
    """chi2 per sample up to which the noise scatters, where it is known."""

    def enough(self, fitted: Fitted, otherwise: float = EXPLAINED, shorter_chi2: float | None = None) -> float:
        """chi2 per sample at which `fitted` leaves nothing unexplained of what a shorter motor leaves (the linear one
        where no `shorter_chi2` is given): `otherwise`, or what its laws are off by."""
        left = self.linear_chi2 if shorter_chi2 is None else shorter_chi2
        laws = max((effect.explained_chi2 for effect in fitted.template.effects), default=0.0)
        laws = min(laws, self.noise + LAW_OFF * max(left - 1, 0.0))
        return max(otherwise, laws, 0.0 if self.noise_known else INEXACT**2 * self.linear_chi2)

    def holds(self, fitted: Fitted) -> bool:
        """`fitted` leaves nothing that its laws are not off by."""
        return fitted.chi2 <= self.enough(fitted)

    def share_left(self, fitted: Fitted, shorter_chi2: float, chi2: float | None = None) -> float:
        """Of the mean square `shorter_chi2` of a shorter motor, beside the noise, the share that `fitted` leaves
        unexplained; of other rows than it was fitted to where its `chi2` there is given.

        Where that is little, little is enough to be unexplained."""
        little = self.noise + OFF * (shorter_chi2 - 1) if self.noise_known else EXPLAINED
        enough = self.enough(fitted, min(little, EXPLAINED), shorter_chi2)
        unexplained = max((fitted.chi2 if chi2 is None else chi2) - enough, 0.0)
        return min(unexplained / max(shorter_chi2 - 1, unexplained), 1.0) if unexplained else 0.0
