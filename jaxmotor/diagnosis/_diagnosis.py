"""What a diagnosis gives: a verdict, the effects found, the scores of both motors, the extended motor as a model."""

import dataclasses
import math
from typing import TYPE_CHECKING, Literal

import numpy as np

from jaxmotor._precision import in_float64, to_numpy
from jaxmotor._shown import Row, Shown, present
from jaxmotor.diagnosis._before_after import BeforeAfter
from jaxmotor.diagnosis._experiment import Experiment
from jaxmotor.diagnosis._found_effect import FoundEffect
from jaxmotor.diagnosis._learned_law import LearnedLaw
from jaxmotor.diagnosis._loops import LoopGain
from jaxmotor.diagnosis._residual_dependence import Coordinate, Dependence
from jaxmotor.diagnosis._residual_voltage import ResidualVoltage
from jaxmotor.estimate import (
    KEYS,
    SHARE,
    Allowed,
    Fit,
    Joint,
    Model,
    OpenHypothesis,
    SpeedAverage,
    Timing,
    allowing,
    effect_rows,
    linear_rows,
    names_of,
)
from jaxmotor.motor import Motor, linear_motor

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LEARNED = 0.5
"""Share of the excess that a learned curve must explain to say what the rest looks like."""
COORDINATE_OF: dict[str, Coordinate] = {
    "friction": "speed",
    "drag": "speed",
    "dead zone": "voltage",
    "delay": "frequency",
    "electrical lag": "frequency",
}
"""What an open hypothesis depends on."""
SHORTEST_LAG_S = 1e-7
"""A lag that ended at its lower bound, zero, is none."""
Verdict = Literal["complete", "extended", "unexplained"]


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Diagnosis(Shown):
    """Where the linear model of one recording fails, why, and how much an extended model improves it."""

    fit: Fit
    """The linear motor as `identify` gives it."""
    linear: Motor
    """The linear motor fitted as the extended one is: without offset, its slow electrical lag within what is usual."""
    motor: Motor
    """The extended motor; the linear one where no effect is named."""
    standard_error: dict[str, float]
    """Of the extended motor's linear part: gain_rad_s_V, pole_rad_s, electrical_time_constant_s, viscous_share. Where
    an indistinguishable alternative has another gain or pole, they allow for that."""
    covariance: np.ndarray
    """(3, 3) of the first three of these, the effects being those that were named."""
    joint: Joint
    """Of all four and the effects' parameters (`coulomb_friction.volts_V`), but for those that are not determined."""
    effects: tuple[FoundEffect, ...]
    """The largest held-out gain first."""
    disturbances: tuple[FoundEffect, ...]
    """What acted from outside while this was recorded: no part of the motor. The verdict is then `unexplained`."""
    probabilities: dict[str, float]
    """Of each effect that was tried, and of `none`, the largest first; nothing where a disturbance from outside lets
    none be trusted."""
    families: dict[str, float]
    """The same of each family of effects."""
    verdict: Verdict
    """`complete`: the residual is noise; `extended`: it is with the effects; `unexplained`: it is not, or the
    input leaves open what it could be (`undecided`); see `looks_like`."""
    held_out: BeforeAfter
    """Both motors refitted without these segments, scored on them."""
    whole: BeforeAfter
    """Both fitted to and scored on everything."""
    adds_up: bool
    """Motors were compared by residuals that add up over twenty ticks (`drift`), not row by row."""
    closed_loop: tuple[LoopGain, ...]
    """Both motors in the recording's closed loops."""
    residual_voltage: ResidualVoltage
    """Residual voltage of the linear motor, window by window."""
    dependences: tuple[Dependence, ...]
    """What the residual voltage depends on, the largest share first."""
    unexplained_voltage: ResidualVoltage
    """Residual voltage of the extended motor."""
    unexplained_dependences: tuple[Dependence, ...]
    learned: tuple[LearnedLaw, ...]
    """Laws learned as curves: those of `effects` and `disturbances`, and where the verdict is `unexplained` what else
    was tried, the most telling first."""
    experiments: tuple[Experiment, ...]
    """What to record next to distinguish the alternatives, the most telling first."""
    notes: tuple[str, ...]
    open_hypotheses: tuple[OpenHypothesis, ...]
    """Laws that the recording can neither show nor exclude beside the motor."""
    allowed: Allowed | None
    """Intervals of gain and pole that allow for them; None where the linear motor is not determined."""
    undecided: bool
    """No residual is unexplained, but `open_hypotheses` would move the linear motor by more than 10 %: the verdict is
    `unexplained`."""
    timing: Timing | None = None
    """The log's own, where its header does not state it and the data show one."""
    average: SpeedAverage | None = None
    """The same of its speeds."""

    @property
    def outcome(self) -> str:
        """The verdict for people: `undecided` where nothing but the input leaves something open."""
        return "undecided" if self.undecided else self.verdict

    @property
    def named(self) -> tuple[FoundEffect, ...]:
        """Effects and disturbances: what the extended motor has that the linear one has not."""
        return (*self.effects, *self.named_disturbances)

    @property
    def named_disturbances(self) -> tuple[FoundEffect, ...]:
        """The disturbances that are named."""
        return tuple(one for one in self.disturbances if one.is_named)

    @property
    def looks_like(self) -> Dependence | None:
        """What the unexplained residual depends on most, where the verdict is `unexplained`."""
        if self.verdict != "unexplained":
            return None
        if self.named_disturbances:
            text = "; ".join(one.summary for one in self.named_disturbances)
            return Dependence("time", text, 1.0, 0.0, np.zeros(0), np.zeros(0), time_only=True)
        if self.undecided:
            names = ", ".join(one.phrase for one in self.open_hypotheses)
            text = f"{names} or nothing, which this input does not show"
            return Dependence(COORDINATE_OF[self.open_hypotheses[0].name], text, 0.0, 0.0, np.zeros(0), np.zeros(0))
        dependences = self.unexplained_dependences if self.effects else self.dependences
        best = self.learned[0] if self.learned else None
        if dependences and dependences[0].time_only and dependences[0].share > LEARNED:
            return dependences[0]
        if best is not None and best.share > max([LEARNED, *(one.share for one in dependences)]):
            # The curve says it better than windows of the residual voltage do.
            by_time = best.coordinate == "time"
            return Dependence(best.coordinate, best.text, best.share, 0.0, best.at, best.values, time_only=by_time)
        return dependences[0] if dependences else Dependence.none()

    @property
    def recording(self) -> str:
        """File name."""
        return self.fit.source.rpartition("/")[2]

    @property
    def model(self) -> Model:
        """The extended motor, to keep, to simulate, to validate and to export."""
        return extended_model(self)

    def plot(self) -> "dict[str, Figure]":
        """Figures of the residual voltage, its causes and the scores of both motors, by name."""
        return present().diagnosis_figures(self)

    def _title(self) -> str:
        each = [found.name if found.is_sure else f"perhaps {found.name}" for found in self.effects]
        named = ", ".join(each) or "no effect"
        return f"Diagnosis of {self.recording}: {self.outcome}, {named} (± is 95 %)"

    def _rows(self) -> tuple[Row, ...]:
        effects = [found.effect for found in self.effects]
        errors = [self.standard_error[key] for key in KEYS[:2]]
        found = effect_rows(effects, [found.standard_error for found in self.effects])
        return (*linear_rows(self.motor.linear, errors), *found)

    def _remarks(self) -> tuple[str, ...]:
        before, after = self.held_out.before, self.held_out.after
        chi2 = f"{before.chi2_per_sample:.3g} -> {after.chi2_per_sample:.3g}"
        # Of readings that do not change no part is predicted.
        is_defined = math.isfinite(before.fit_percent)
        fit = f"fit {before.fit_percent:.1f} -> {after.fit_percent:.1f} %, " if is_defined else ""
        score = f"held out: {fit}chi2 {chi2} (1 = noise)"
        dependence = [] if self.looks_like is None else [f"the unexplained residual looks like {self.looks_like.text}"]
        left_open = allowing(self)
        return (score, *dependence, *([left_open] if left_open else []))


@in_float64
def extended_model(diagnosis: Diagnosis) -> Model:
    """The motor of `diagnosis` with the effects that were named, fitted to the whole recording.

    Its `covariance` (p, p) is of gain [rad/s/V], pole [rad/s] and, where the motor has one, L/R [s].
    """
    fit, linear, covariance = diagnosis.fit, diagnosis.motor.linear, diagnosis.covariance
    values = [float(linear.gain), float(linear.pole)]
    lag = float(getattr(linear, "electrical_time_constant", 0.0))
    if lag > SHORTEST_LAG_S:
        # Whoever draws motors from the covariance draws the lag's logarithm.
        shrink = np.array([1.0, 1.0, min(1.0, lag / max(float(np.sqrt(covariance[2, 2])), 1e-300))])
        values, covariance = [*values, lag], covariance * np.outer(shrink, shrink)
    return Model(
        linear_motor(values),
        covariance[: len(values), : len(values)],
        0.0,
        fit.period_s,
        diagnosis.recording,
        frozenset(fit.fingerprints),
        fit.source,
        tuple(to_numpy(found.effect) for found in diagnosis.effects),
        tuple(found.standard_error for found in diagnosis.effects),
        fit.frequency_response,
        viscous_share=float(diagnosis.motor.viscous_share),
        joint=_joint(diagnosis, len(values)) if diagnosis.effects else None,
        rig=fit.rig,
        average=diagnosis.average,
    )


def _joint(diagnosis: Diagnosis, order: int) -> Joint | None:
    """Of what the model has: without a lag that is none, and without a viscous share of nothing."""
    effects = names_of([found.effect for found in diagnosis.effects])
    share = [SHARE] if float(diagnosis.motor.viscous_share) else []
    joint = diagnosis.joint.of([*KEYS[:order], *share, *effects])
    return joint if joint.names[:order] == KEYS[:order] else None
