"""Models of known motors."""

import numpy as np

from jaxmotor._precision import in_float64, to_numpy
from jaxmotor.control import Hardware
from jaxmotor.estimate import Model
from jaxmotor.motor import EFFECTS, linear_motor

HARDWARE = Hardware(0.005, 617.4, 7.4, 250, 40e-6)


@in_float64
def model(*effects, gain=10.6, pole=40.0, lag=None, errors=(0.03, 0.6, 1e-4), offset=0.0):
    """A model with `effects` as (name, {parameter: value})."""
    values = [gain, pole] if lag is None else [gain, pole, lag]
    return Model(
        linear_motor(values),
        np.diag(np.square(errors[: len(values)])),
        offset,
        0.005,
        "made.csv",
        frozenset(),
        "made.json",
        tuple(to_numpy(EFFECTS[name].of(**parameters)) for name, parameters in effects),
        tuple({key: 0.02 * abs(value) for key, value in parameters.items()} for _, parameters in effects),
    )
