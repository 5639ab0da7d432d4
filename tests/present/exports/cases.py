"""Models to export."""

import numpy as np

from jaxmotor._precision import in_float64, to_numpy
from jaxmotor.control import Hardware
from jaxmotor.estimate import FrequencyResponse, Model
from jaxmotor.motor import EFFECTS, linear_motor

HARDWARE = Hardware(0.005, 617.4, 7.4, 250, 40e-6)


@in_float64
def made(*effects, gain=10.6, lag=None, offset=0.0, recording="m1.csv", response=False):
    """A model with `effects` as (name, {parameter: value})."""
    values = [gain, 40.0] if lag is None else [gain, 40.0, lag]
    errors = np.square([0.03, 0.6, 1e-4][: len(values)])
    measured = None
    if response:
        from jax import numpy as jnp

        frequency = jnp.asarray([1.0, 3.0, 7.0])
        covariance = jnp.asarray(np.tile(0.01 * np.eye(2), (3, 1, 1)))
        amplitude, period = jnp.full(3, 5.0), jnp.asarray(0.005)
        measured = FrequencyResponse(frequency, jnp.asarray([9.0 - 2j, 7 - 4j, 3 - 4j]), covariance, amplitude, period)
        measured = to_numpy(measured)
    return Model(
        linear_motor(values),
        np.diag(errors),
        offset,
        0.005,
        recording,
        frozenset(),
        "m1.json",
        tuple(to_numpy(EFFECTS[name].of(**parameters)) for name, parameters in effects),
        tuple({key: 0.02 * abs(value) for key, value in parameters.items()} for _, parameters in effects),
        measured,
    )


@in_float64
def simulated(model, volts, period_s=0.005, supply=7.4, steps=40):
    """(n,) speed at each tick and (n,) angle turned until the next, by jaxmotor's own simulation."""
    import jax.numpy as jnp

    from jaxmotor._precision import to_jax
    from jaxmotor.motor import Rows, simulate_motor

    volts = jnp.asarray(np.asarray(volts, float))
    none = jnp.zeros_like(volts)
    rows = Rows(volts, none.astype(bool).at[0].set(True), none, jnp.arange(len(volts), dtype=float) * period_s)
    run = simulate_motor(to_jax(model.whole), rows, jnp.asarray(period_s), jnp.asarray(supply), steps)
    return np.asarray(run.speed), np.asarray(run.turn)


VOLTS = 5 * np.sin(2 * np.pi * 1.3 * np.arange(400) * 0.005) + 2 * np.sign(
    np.sin(2 * np.pi * 4.1 * np.arange(400) * 0.005)
)
