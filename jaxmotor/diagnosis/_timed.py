"""A linear motor and a log whose rows were read somewhat off the moments at which voltages change."""

import numpy as np

from jaxmotor.diagnosis._free import OWN, with_effect
from jaxmotor.diagnosis._search import FINE, NEARLY, TIE
from jaxmotor.diagnosis._solve import Fitted
from jaxmotor.diagnosis._study import Study, study_of
from jaxmotor.diagnosis._trial import rig_of
from jaxmotor.estimate import Fit, Timing
from jaxmotor.motor import Motor
from jaxmotor.motor.effects import EFFECTS, TimingOffset
from jaxmotor.recording import Recording

LIKE = ("electrical_pole", "sensor_lag")
"""Effects that a reading before its voltage changes may be mistaken for."""


def timed(recording: Recording, fit: Fit, first: Motor) -> tuple[Study, Fitted] | None:
    """The linear motor with the timing offset that `fit` found, where it leaves nothing over; None where it does.

    A lag of the current or of the reading explains no less, if that is what it is: it is an effect then.
    """
    if fit.timing is None:
        return None
    study = study_of(recording, float(first.linear.pole), timed=True)
    offset = TimingOffset.of(offset_s=fit.timing.offset_s)
    fitted = study.solver.fit(with_effect(first, offset), tolerance=FINE)
    if not fitted.chi2 < NEARLY:
        return None
    rig = rig_of(recording, study.trial)
    lags = [] if fit.timing.offset_s > 0 else [EFFECTS[name].starts(rig)[0] for name in LIKE]
    others = [study.solver.fit(with_effect(first, lag), fitted.speeds) for lag in lags]
    return None if any(other.chi2 < fitted.chi2 - TIE for other in others) else (study, fitted)


def timing_of(fitted: Fitted, spread: np.ndarray) -> Timing | None:
    """Of a motor with a timing offset, whose free numbers have the covariance `spread`."""
    offsets = [effect for effect in fitted.motor.effects if isinstance(effect, TimingOffset)]
    return Timing(float(offsets[0].offset_s), float(np.sqrt(spread[OWN, OWN]))) if offsets else None
