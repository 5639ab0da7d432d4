"""A linear motor and a log whose rows were read somewhat off the moments at which voltages change."""

import numpy as np

from jaxmotor.diagnosis._found import FINE, NEARLY
from jaxmotor.diagnosis._free import with_effect
from jaxmotor.diagnosis._request import Request
from jaxmotor.diagnosis._solve import Fitted
from jaxmotor.diagnosis._study import Study, study_of
from jaxmotor.diagnosis._trial import rig_of
from jaxmotor.estimate import Fit, Timing
from jaxmotor.motor import Motor
from jaxmotor.motor.effects import ElectricalPole, LogFilter, SensorLag, TimingOffset
from jaxmotor.recording import Recording

TIE = 0.003
"""Difference of chi2 that decides nothing."""
LIKE = (ElectricalPole, SensorLag)
"""Effects that a reading before its voltage changes may be mistaken for."""


def timed(recording: Recording, fit: Fit, first: Motor, request: Request) -> tuple[Study, Fitted] | None:
    """The linear motor with the timing offset and the filter that `fit` found, where it leaves nothing over; None where
    it does.

    A lag of the current or of the reading explains no less, if that is what it is: it is an effect then.
    """
    offset = fit.timing.offset_s if fit.timing is not None else 0.0
    average = fit.average if fit.average is not None and fit.average.kind == "filter" else None
    if fit.timing is average is None:
        return None
    motor = first
    study = study_of(recording, float(first.linear.pole), timed=True, request=request)
    if fit.timing is not None:
        motor = with_effect(motor, TimingOffset.of(offset_s=offset))
    if average is not None:
        motor = with_effect(motor, LogFilter.of(time_constant_s=average.length_s))
    fitted = study.solver.fit(motor, tolerance=FINE)
    if not fitted.chi2 < NEARLY:
        return None
    rig = rig_of(recording, study.trial)
    lags = [] if fit.average is not None or offset > 0 else [effect.starts(rig)[0] for effect in LIKE]
    others = [study.solver.fit(with_effect(first, lag), fitted) for lag in lags]
    return None if any(other.chi2 < fitted.chi2 - TIE for other in others) else (study, fitted)


def with_average(spread: np.ndarray, fit: Fit) -> np.ndarray:
    """`spread` (p, p) of the free numbers, wider by what a window of another length would move gain and pole."""
    average = fit.average
    if average is None or average.kind == "filter":
        return spread
    moved = np.zeros(len(spread))
    moved[:2] = average.gain_per_s / float(fit.motor.gain), average.pole_per_s / float(fit.motor.pole)
    return spread + np.outer(moved, moved) * average.standard_error_s**2


def timing_of(fitted: Fitted, spread: np.ndarray) -> Timing | None:
    """Of a motor with a timing offset, whose free numbers have the covariance `spread`."""
    if TimingOffset.name not in fitted.names:
        return None
    at = fitted.layout.names.index(f"{TimingOffset.name}.offset_s")
    return Timing(offset_of(fitted.motor), float(np.sqrt(spread[at, at])))


def offset_of(motor: Motor) -> float:
    """Its timing offset, zero where it has none [s]."""
    return sum((float(effect.offset_s) for effect in motor.effects if isinstance(effect, TimingOffset)), 0.0)
