"""An effect that was found: its size, what else could be in its place, and how sure that is."""

import dataclasses

from jaxmotor.diagnosis._found import NAMED, STAYS
from jaxmotor.diagnosis._learned_law import LearnedLaw
from jaxmotor.motor import AbstractEffect
from jaxmotor.motor.effects import parameters


@dataclasses.dataclass(frozen=True)
class Alternative:
    """Another effect in the place of one that was named."""

    name: str
    chi2_excess: float
    """By how much its held-out chi2 per sample is above the named effect's, of residuals that add up over twenty
    ticks; negative where it does better."""
    inseparable: bool
    """This recording cannot tell the two apart."""
    wider: bool = False
    """Its law contains the named effect's."""


@dataclasses.dataclass(frozen=True, eq=False)
class FoundEffect:
    """One effect of the extended motor."""

    effect: AbstractEffect
    standard_error: dict[str, float]
    """Of each parameter, in its unit; 1.96 of them each way hold the truth 95 times of 100."""
    held_out_gain_percent: float
    """By how much it lowers the drift chi2 per sample of data that was not fitted, of what the motor without it has."""
    alternatives: tuple[Alternative, ...]
    """The nearest first."""
    unknown: tuple[str, ...]
    """Parameters that this recording does not determine: their error is more than half of them."""
    probability: float
    """Of all models tried, by blocks left out."""
    family_probability: float
    """The same of it or of any alternative that is indistinguishable."""
    curve: LearnedLaw | None = None
    """Where it was learned as a curve."""
    of_family: float = 0.0
    """Probability of it or of any effect of its family."""
    unexplained_share: float = 0.0
    """Of the residual that the motor without it leaves, beside the noise, the share that stays unexplained with it:
    where it is large, the effect may only imitate another one, and the probabilities allow for that."""
    held_out_share: float = 0.0
    """The same of rows that were held out."""
    name_probability: float = 0.0
    """As `family_probability`, with laws that contain the effect; of a known law in a log whose noise is not known
    without learned curves: the law may be one that nobody tried."""
    kin_probability: float = 1.0
    """As sure as a name is: the probability of it or of any effect of its family."""

    @property
    def is_named(self) -> bool:
        """It is told as a cause, by its name: that or what it may as well be is nearly sure (`NAMED`). Otherwise its
        family is told."""
        return self.name_probability >= NAMED

    @property
    def is_one_of_several(self) -> bool:
        """Only it or alternatives that have nothing in common with it are nearly sure, together: a choice that the
        recording leaves."""
        return self.is_named and self.kin_probability < NAMED

    @property
    def is_sure(self) -> bool:
        """It is named, and no mere choice."""
        return self.is_named and not self.is_one_of_several

    @property
    def is_told(self) -> bool:
        """It or its family is more likely than not. Otherwise the motor only fits better with it."""
        return self.is_named or self.of_family >= STAYS

    @property
    def name(self) -> str:
        return self.effect.name

    @property
    def summary(self) -> str:
        """What it does, with its parameters in SI."""
        about, (says, values) = parameters(self.effect), self.effect.told()
        return says.format(
            **{name: f"{value:.4g} {about[name]['unit']}".removesuffix(" 1") for name, value in values.items()}
        )

    @property
    def parameters(self) -> dict[str, float]:
        """By name, in SI."""
        return {name: float(getattr(self.effect, name)) for name in parameters(self.effect)}
