"""What a short L/R adds to a prediction, in closed form: against the derivative of a simulation with one."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from speed_logs import speed_log
from testing.made import recording

from jaxmotor.estimate._uncertainty import lagging_of
from jaxmotor.motor import FirstOrder, SecondOrder
from jaxmotor.prediction import as_problem, observe, pack

PSI = (11.0, 0.3, np.log(40.0))


def made(seen: str):
    """A log whose readings are `seen` so."""
    return recording(0) if seen == "counts" else speed_log(np.random.default_rng([7, 3]), seen).recording


@pytest.mark.usefixtures("x64")
@pytest.mark.parametrize(("seen", "kind"), [("counts", "turn"), ("one row", "turn"), ("instantaneous", "speed")])
def test_the_first_of_a_lag_is_known_without_a_simulation(seen, kind):
    log = made(seen)
    problem = as_problem(pack(log, tuple(range(len(log.segments)))))
    assert problem.kind == kind
    gain, offset, log_pole = map(jnp.asarray, PSI)
    drive = gain * jnp.asarray(problem.batch.volts) + offset
    rest, one = jnp.zeros_like(drive), jnp.ones_like(gain)

    def first_order(log_pole):
        return observe(FirstOrder(one, jnp.exp(log_pole)), problem, drive, rest)

    def with_lag(lag):
        return observe(SecondOrder(one, jnp.exp(log_pole), lag), problem, drive, rest)

    value, by_pole = jax.jvp(first_order, (log_pole,), (one,))
    found = np.asarray(lagging_of(jnp.exp(log_pole), drive, value + by_pole, problem))
    lags = jnp.array([1e-5, 1e-6])
    simulated = [np.asarray(jax.jvp(with_lag, (lag,), (one,))[1]) for lag in lags]
    valid = np.asarray(problem.batch.valid)
    off = [np.linalg.norm((found - own)[valid]) / np.linalg.norm(own[valid]) for own in simulated]
    # What is left is the lag's own length, not the closed form's.
    assert off[1] < 1e-3 and off[1] < 0.2 * off[0]
