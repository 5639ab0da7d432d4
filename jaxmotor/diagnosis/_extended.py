"""The extended motor as a model, to keep, to simulate and to validate."""

import numpy as np

from jaxmotor._precision import in_float64, to_numpy
from jaxmotor.diagnosis._diagnosis import Diagnosis
from jaxmotor.estimate import Model
from jaxmotor.motor import linear_motor

SHORTEST_LAG_S = 1e-7
"""A lag that ended at its lower bound, zero, is none."""


@in_float64
def extended_model(diagnosis: Diagnosis) -> Model:
    """The motor of `diagnosis` with the effects that were named, fitted to the whole recording.

    Its covariance is that of the stated standard errors: how gain, pole and lag go together is not kept. The viscous
    share has no place in a model file, and is left out.
    """
    fit, linear, error = diagnosis.fit, diagnosis.motor.linear, diagnosis.standard_error
    values = [float(linear.gain), float(linear.pole)]
    errors = [error["gain_rad_s_V"], error["pole_rad_s"]]
    lag = float(getattr(linear, "electrical_time_constant", 0.0))
    if lag > SHORTEST_LAG_S:
        # Whoever draws motors from the covariance draws the lag's logarithm.
        values, errors = [*values, lag], [*errors, min(error["electrical_time_constant_s"], lag)]
    return Model(
        linear_motor(values),
        np.diag(np.square(errors)),
        0.0,
        fit.period_s,
        diagnosis.recording,
        frozenset(fit.fingerprints),
        fit.source,
        tuple(to_numpy(found.effect) for found in diagnosis.effects),
        tuple(found.standard_error for found in diagnosis.effects),
        fit.frequency_response,
    )
