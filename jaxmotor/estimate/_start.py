"""Where the fit starts when there are no sines: the best of a row of poles."""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxmotor.estimate._trajectory import least_squares, whitened
from jaxmotor.motor import FirstOrder
from jaxmotor.prediction import Batch, Problem, bucket, observe, start_columns

POLES = 24
"""From which a fit may start; the best one is taken."""


def pole_range(batch: Batch) -> np.ndarray:
    """Logarithms of `POLES` poles [rad/s], from one hardly seen in the longest sequence to one faster than a tick."""
    shortest = float(np.min(batch.duration))
    longest = shortest * bucket(int(np.flatnonzero(batch.valid.any(axis=0)).max(initial=0)) + 2)
    return np.linspace(np.log(0.1 / longest), np.log(3.0 / shortest), POLES)


def data_start(problem: Problem, log_poles: Float[Array, " k"]) -> Float[Array, " 3"]:
    """(K, b, log a): K and b by linear least squares for each of `log_poles`, and the pole that fits best.

    The cost with K and b profiled out has one minimum in log a, so a coarse row of poles finds its basin.
    """
    volts, valid = jnp.asarray(problem.batch.volts), jnp.asarray(problem.batch.valid)
    observed = jnp.where(valid, jnp.asarray(problem.batch.observed), 0.0)
    rest = jnp.zeros_like(volts)
    differences_only = jnp.asarray(1e6, volts.dtype)

    def at(log_pole: Float[Array, ""]):
        motor = FirstOrder(jnp.ones_like(log_pole), jnp.exp(log_pole))
        columns = [observed] + [observe(motor, problem, drive, rest) for drive in (volts, jnp.ones_like(volts))]
        columns = jnp.where(valid[..., None], jnp.stack(columns, axis=-1), 0.0)
        starts = start_columns(jnp.stack([motor.gain, motor.gain, log_pole]), problem)
        white, _, _ = whitened(columns, starts, differences_only, problem)
        left, linear, _ = least_squares(white)
        return (left**2).sum(), jnp.append(linear, log_pole)

    cost, psi = jax.lax.map(at, log_poles)
    return psi[jnp.argmin(jnp.where(jnp.isfinite(cost), cost, jnp.inf))]
