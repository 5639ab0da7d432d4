"""Gain and pole from a frequency response, by Levenberg-Marquardt on complex residuals in standard errors."""

import equinox as eqx
import jax
import jax.numpy as jnp
import optimistix as optx
from jaxtyping import Array, Bool, Float, Int

from jaxmotor._arguments import taken
from jaxmotor._errors import JaxmotorError
from jaxmotor._sentences import shown
from jaxmotor.estimate._frequency_response import FrequencyResponse
from jaxmotor.estimate._sine_fit import linear_start
from jaxmotor.motor import AbstractLinearMotor, FirstOrder, SecondOrder, phasor

TOLERANCE = 1e-6
"""In standard errors of the residuals and in logarithms of the parameters, as optimistix counts them."""


class ResponseFit(eqx.Module):
    """A motor fitted to a frequency response."""

    motor: AbstractLinearMotor
    covariance: Float[Array, "p p"]
    """Of (log |K|, log a [, log τ]) [1], scaled up where the residuals are larger than their standard errors."""
    cost: Float[Array, ""]
    """Sum of squared residuals in standard errors."""
    freedom: Int[Array, ""]
    """Number of residuals less number of parameters."""
    solved: Bool[Array, ""]
    """The solver ended by itself, and the gradient has vanished."""


def fit_response(measured: FrequencyResponse, order: int = 1) -> ResponseFit:
    """Least squares of `measured` minus the exact response of a motor of `order` 1 or 2, weighted by its covariance.

    Needs at least as many numbers (two per frequency) as parameters. The start is linear least squares; a second order
    starts from a slow and from a fast electrical part, and the better end is kept.

    **Raises:** `JaxmotorError` where `measured` is no response, or `order` another.
    """
    taken(measured, FrequencyResponse, "a FrequencyResponse (such as the frequency_response of a Fit)")
    if order not in (1, 2):
        raise JaxmotorError(f"order is {shown(order)}; a motor is of order 1 or 2")
    return _fit_response(measured, order)


@eqx.filter_jit
def _fit_response(measured: FrequencyResponse, order: int) -> ResponseFit:
    every = jnp.ones(measured.frequency_Hz.shape, bool)
    logs, sign = _start(measured, every)
    if order == 1:
        return _fit(measured, every, logs, sign)
    shifts = jnp.asarray([-1.5, -4.0], logs.dtype)
    fits = jax.lax.map(lambda shift: _fit(measured, every, jnp.append(logs, shift - logs[1]), sign), shifts)
    best = jnp.argmin(jnp.where(jnp.isfinite(fits.cost), fits.cost, jnp.inf))
    return jax.tree.map(lambda leaf: leaf[best], fits)


def fit_used(measured: FrequencyResponse, used: Bool[Array, " f"]) -> ResponseFit:
    """`fit_response` of first order to the frequencies that are `used`."""
    return _fit(measured, used, *_start(measured, used))


def _start(measured: FrequencyResponse, used: Bool[Array, " f"]) -> tuple[Float[Array, " 2"], Float[Array, ""]]:
    """Logarithms of gain and pole to start from, and the gain's sign."""
    start = linear_start(measured.frequency_Hz, _about_mean_speed(measured), measured.period_s, used)
    return jnp.stack([jnp.log(jnp.abs(start.gain)), jnp.log(start.pole)]), jnp.sign(start.gain)


def _fit(
    measured: FrequencyResponse, used: Bool[Array, " f"], start: Float[Array, " p"], sign: Float[Array, ""]
) -> ResponseFit:
    weight = jax.vmap(lambda c: jnp.linalg.inv(jnp.linalg.cholesky(c)))(measured.covariance)
    weight = jnp.where(used[:, None, None], weight, 0.0)

    def residual(logs: Float[Array, " p"], args: None) -> Float[Array, "f 2"]:
        del args
        left = measured.response - measured.of(motor_from_logs(logs, sign))
        return jnp.einsum("fij,fj->fi", weight, jnp.stack([left.real, left.imag], axis=-1))

    solver = optx.LevenbergMarquardt(rtol=TOLERANCE, atol=TOLERANCE)
    solution = optx.least_squares(residual, solver, start, max_steps=256, throw=False)
    left = residual(solution.value, None)
    jacobian = jax.jacfwd(residual)(solution.value, None).reshape(-1, len(start))
    inverse = jnp.linalg.inv(jacobian.T @ jacobian)
    cost, freedom = (left**2).sum(), 2 * used.sum() - len(start)
    # What is still to gain, in standard errors; the solver's own word is not enough.
    gradient = jacobian.T @ left.reshape(-1)
    solved = (solution.result == optx.RESULTS.successful) & (gradient @ inverse @ gradient < 1e-4 * (1 + cost))
    scale = jnp.maximum(cost / jnp.maximum(freedom, 1).astype(cost.dtype), 1.0)
    return ResponseFit(motor_from_logs(solution.value, sign), inverse * scale, cost, freedom, solved)


def motor_from_logs(logs: Float[Array, " p"], sign: Float[Array, ""]) -> AbstractLinearMotor:
    """The motor whose (log |K|, log a [, log τ]) are `logs`."""
    gain, pole = sign * jnp.exp(logs[0]), jnp.exp(logs[1])
    return FirstOrder(gain, pole) if len(logs) == 2 else SecondOrder(gain, pole, jnp.exp(logs[2]))


def _about_mean_speed(measured: FrequencyResponse):
    """V(z), to second order in the tick where another speed was measured."""
    if measured.window_s is None:
        return measured.response
    return measured.response * phasor(measured.frequency_Hz * (measured.period_s + measured.window_s) / 2)
