"""The extended motor as a model, to keep, to simulate and to validate."""

import numpy as np

from jaxmotor._precision import in_float64, to_numpy
from jaxmotor.diagnosis._diagnosis import Diagnosis
from jaxmotor.estimate import KEYS, SHARE, Joint, Model, names_of
from jaxmotor.motor import linear_motor

SHORTEST_LAG_S = 1e-7
"""A lag that ended at its lower bound, zero, is none."""


@in_float64
def extended_model(diagnosis: Diagnosis) -> Model:
    """The motor of `diagnosis` with the effects that were named, fitted to the whole recording."""
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
