"""Scores of both motors on held-out segments."""

import dataclasses
import math

import numpy as np

from jaxmotor.diagnosis._before_after import BeforeAfter, Intervals
from jaxmotor.diagnosis._found import EXPLAINED, FINE, Found
from jaxmotor.diagnosis._free import without_effect
from jaxmotor.diagnosis._score import Scored, chi2_interval, scored, speed_intervals
from jaxmotor.diagnosis._solve import Fitted, Solver
from jaxmotor.diagnosis._split import split
from jaxmotor.diagnosis._study import Study
from jaxmotor.motor import Motor
from jaxmotor.motor.effects import AbstractDisturbance, AbstractLearnedEffect
from jaxmotor.validation import Interval


@dataclasses.dataclass(frozen=True, eq=False)
class HeldOut:
    """Motors refitted to a part of the recording, scored on the rest."""

    segments: tuple[int, ...]
    in_part: tuple[int, ...]
    """Those of which only a part is held out."""
    own: bool
    """The recording was long enough for it."""
    train: Solver
    test: Solver
    study: Study
    linear: Fitted
    fitted: Fitted
    before: Scored
    after: Scored
    shorter: dict[str, float] = dataclasses.field(default_factory=dict)
    """chi2 without each effect that was asked for (`without`)."""

    @property
    def is_worse(self) -> bool:
        """The extended motor predicts what it was not fitted to worse than the linear one does, and not well."""
        return self.own and self.after.drift > max(self.before.drift, EXPLAINED)

    def drift(self, motor: Motor, start: Fitted, bar: float = math.inf) -> float:
        """chi2 of `motor`, refitted to the fitted part, on the part held out; roughly where it is above `bar`."""
        refitted = self.train.fit(motor, start, 2e-5, bar=bar)
        return _scored(self.study, self.test, refitted).drift

    def without(self, name: str) -> float:
        """chi2 of the extended motor without the effect `name`, refitted to the fitted part, on the part held out."""
        if len(self.fitted.names) == 1:
            return self.before.drift
        if name not in self.shorter:
            self.shorter[name] = self.drift(without_effect(self.fitted.motor, name), self.fitted)
        return self.shorter[name]


def hold_out(study: Study, found: Found) -> HeldOut:
    """The motors of `found` refitted to two thirds of the recording (`split`)."""
    study.solver.request.tell(2)
    parts, runs = split(study.recording), study.recording.segments
    segments = tuple(part.segment for part in parts)
    in_part = tuple(part.segment for part in parts if len(part.rows) < len(runs[part.segment]))
    if parts:
        out = study.rows(parts)
        train, test = (Solver(study.trial, rows, study.solver.noise_known) for rows in (~out, out))
    else:
        segments = tuple(int(k) for k in np.unique(study.packed.segment_of[study.trial.valid]))
        train = test = study.solver
    linear, fitted = (train.fit(one.motor, one, FINE) for one in (found.linear, found.fitted))
    before, after = (_scored(study, test, one) for one in (linear, fitted))
    return HeldOut(segments, in_part, bool(parts), train, test, study, linear, fitted, before, after)


def _scored(study: Study, test: Solver, fitted: Fitted) -> Scored:
    """`fitted` on the rows of `test`, without what it learned over the time of others: nothing of that is known."""
    motor = fitted.motor
    for effect in motor.effects:
        if isinstance(effect, AbstractDisturbance) and isinstance(effect, AbstractLearnedEffect):
            motor = without_effect(motor, effect.name)
    return scored(test, motor, study.recording, study.packed, fitted.speeds)


def before_after(
    segments: tuple[int, ...], before: Scored, after: Scored, seed: int, in_part: tuple[int, ...] = ()
) -> BeforeAfter:
    def intervals(one: Scored) -> Intervals:
        rmse, fit = speed_intervals(one.traces, seed)
        return Intervals(
            Interval(one.score.chi2_per_sample, *chi2_interval(one.by_segment, seed)),
            Interval(one.score.rmse_rad_s, *rmse),
            Interval(one.score.fit_percent, *fit),
        )

    return BeforeAfter(
        segments,
        in_part,
        before.score,
        after.score,
        intervals(before),
        intervals(after),
        before.drift,
        after.drift,
        before.traces,
        after.traces,
    )
