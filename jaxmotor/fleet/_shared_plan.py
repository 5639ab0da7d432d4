"""Sine fit, gain and pole of many motors that were driven through one plan: one pass over their data.

With the plan shared, the sine fit of every motor is one matrix: the rows of (XᵀX)⁻¹Xᵀ for the columns sin ωt, cos ωt, 1
and t of each frequency. The same matrix applied to an exact simulation of the plan gives what the fit would read of a
motor with pole a, start from rest and duty steps included; tabulated over log a as a Chebyshev series it is exact to
rounding and shared, too. Gain and pole are then least squares on a few numbers per motor, K in closed form and log a by
Gauss-Newton from the best entry of the table.

Data are (frequency, motor, tick): each frequency is one matrix product, as fast as the memory.
"""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from jaxmotor._precision import in_float64, to_jax
from jaxmotor.motor import FirstOrder, simulate

NODES = 48
"""Of the Chebyshev series over log a."""
POLES_RAD_S = (1.0, 2000.0)
STEPS = 4
"""Of Gauss-Newton; from a node they reach rounding."""


class SharedPlan(eqx.Module):
    """What the motors have in common."""

    frequency_Hz: Float[Array, " f"]
    project: Float[Array, "f n 2"]
    """From positions [counts] to the coefficients of sin and cos, in standard errors of them."""
    whiten: Float[Array, "f 2 2"]
    """From coefficients [counts] to standard errors."""
    series: Float[Array, "k f 2"]
    """Chebyshev series, over log a, of `project` applied to a motor with gain 1."""
    nodes: Float[Array, "k f 2"]
    """Its values at the nodes."""
    log_pole_nodes: Float[Array, " k"]


class SharedFit(NamedTuple):
    """Of all motors."""

    coefficients: Float[Array, "m f 2"]
    """Of sin and cos [counts]."""
    gain: Float[Array, " m"]
    """[rad/s/V]."""
    pole: Float[Array, " m"]
    """[rad/s]."""
    gain_error: Float[Array, " m"]
    """Standard error relative to the gain, for white rounding errors and a linear motor [1]."""
    pole_error: Float[Array, " m"]
    """The same of the pole [1]."""
    chi2: Float[Array, " m"]
    """Mean squared residual of the coefficients in standard errors; 1 where the motor is linear."""


@in_float64
def shared_plan(frequency_Hz: np.ndarray, volts: np.ndarray, period_s: float, counts_per_rev: float) -> SharedPlan:
    """The plan in which motors at rest get `volts` (frequency, tick) [V], a sine of each of `frequency_Hz`."""
    frequency, drive, period, unit = to_jax((frequency_Hz, volts, period_s, 2 * np.pi / counts_per_rev))
    node = np.cos(np.pi * (np.arange(NODES) + 0.5) / NODES)
    low, high = np.log(POLES_RAD_S)
    logs = to_jax((low + high) / 2 + (high - low) / 2 * node)
    # Values at the nodes to coefficients of the series.
    order = np.cos(np.outer(np.arange(NODES), np.pi * (np.arange(NODES) + 0.5) / NODES)) * 2 / NODES
    order[0] /= 2
    return _shared_plan(frequency, drive, period, unit, logs, to_jax(order))


@eqx.filter_jit
def _shared_plan(frequency, volts, period, unit, logs, order) -> SharedPlan:
    length = volts.shape[1]
    tick = jnp.arange(length, dtype=volts.dtype)
    angle = 2 * jnp.pi * frequency[:, None] * period * tick[None]
    more = [jnp.ones_like(angle), jnp.broadcast_to((2 * tick / length - 1)[None], angle.shape)]
    columns = jnp.stack([jnp.sin(angle), jnp.cos(angle), *more], axis=-1)
    inverse = jnp.linalg.inv(jnp.einsum("fnc,fnd->fcd", columns, columns))
    fit = jnp.einsum("fcd,fnd->fnc", inverse, columns)[..., :2]
    whiten = jax.vmap(lambda covariance: jnp.linalg.inv(jnp.linalg.cholesky(covariance)))(inverse[:, :2, :2] / 12)
    project = jnp.einsum("fij,fnj->fni", whiten, fit)
    reset = jnp.zeros(length, bool).at[0].set(True)

    def at(log_pole):
        motor = FirstOrder(jnp.ones_like(log_pole), jnp.exp(log_pole))
        turn = jax.vmap(lambda u: simulate(motor, u, reset, jnp.zeros_like(u), period).turn)(volts) / unit
        return jnp.einsum("fnc,fn->fc", project, jnp.cumsum(turn, axis=1) - turn)

    nodes = jax.lax.map(at, logs)
    return SharedPlan(frequency, project, whiten, jnp.einsum("jk,kfc->jfc", order, nodes), nodes, logs)


def fit_shared(plan: SharedPlan, position: Float[Array, "f m n"]) -> SharedFit:
    """Sine fit, gain and pole of each motor from its `position` since the segment's start [counts].

    Any precision: the pass over the data runs in that of `position`. The rest takes double precision where that is on.
    """
    return fit_projected(plan, project(plan, position))


def project(plan: SharedPlan, position: Float[Array, "f m n"]) -> Float[Array, "f m 2"]:
    """The sine fit: coefficients of sin and cos, in standard errors."""
    return jnp.einsum("fmn,fnc->fmc", position, plan.project.astype(position.dtype))


def fit_projected(plan: SharedPlan, read: Float[Array, "f m 2"]) -> SharedFit:
    """Gain and pole from the sine fit."""
    read = jnp.swapaxes(read.astype(plan.series.dtype), 0, 1)
    flat = read.reshape(read.shape[0], -1)
    table = plan.nodes.reshape(NODES, -1)
    along = flat @ table.T
    best = jnp.argmax(along**2 / (table**2).sum(1)[None], axis=1)
    gain, log_pole, model, slope = _refined(plan, flat, plan.log_pole_nodes[best])
    left = flat - gain[:, None] * model
    chi2 = (left**2).sum(1) / (flat.shape[1] - 2)
    # Information on log K and log a.
    gg, ga, aa = (model**2).sum(1), (model * slope).sum(1), (slope**2).sum(1)
    rest = gain**2 * (gg * aa - ga**2) / jnp.maximum(chi2, 1.0)
    whitened = jnp.linalg.inv(plan.whiten)
    coefficients = jnp.einsum("fij,mfj->mfi", whitened, read)
    return SharedFit(coefficients, gain, jnp.exp(log_pole), jnp.sqrt(aa / rest), jnp.sqrt(gg / rest), chi2)


def _refined(plan: SharedPlan, flat: Float[Array, "m c"], log_pole: Float[Array, " m"]):
    """Gain, log a, and the model of gain 1 with its derivative by log a, after `STEPS` Gauss-Newton steps."""
    low, high = np.log(POLES_RAD_S)
    series = plan.series.reshape(NODES, -1)

    def at(log_pole):
        x = jnp.clip((2 * log_pole - (low + high)) / (high - low), -1.0, 1.0)
        first, second = _chebyshev(x)
        return first @ series, second @ series * (2 / (high - low))

    def step(_, log_pole):
        model, slope = at(log_pole)
        gain = (model * flat).sum(1) / (model**2).sum(1)
        left = flat - gain[:, None] * model
        # K at its best for every a: what of the slope K cannot do.
        own = slope - ((slope * model).sum(1) / (model**2).sum(1))[:, None] * model
        delta = (own * left).sum(1) / (gain * (own**2).sum(1))
        return log_pole + jnp.clip(delta, -1.0, 1.0)

    log_pole = jax.lax.fori_loop(0, STEPS, step, log_pole)
    model, slope = at(log_pole)
    return (model * flat).sum(1) / (model**2).sum(1), log_pole, model, slope


def _chebyshev(x: Float[Array, " m"]) -> tuple[Float[Array, "m k"], Float[Array, "m k"]]:
    """T_k(x) and its derivative k U_{k-1}(x), by their recurrence: cheaper than cosines, and exact on [-1, 1]."""
    one, none = jnp.ones_like(x), jnp.zeros_like(x)
    first, second = [one, x], [none, one]
    for _ in range(2, NODES):
        first.append(2 * x * first[-1] - first[-2])
        second.append(2 * x * second[-1] - second[-2])
    slopes = [k * each for k, each in enumerate(second)]
    return jnp.stack(first, axis=1), jnp.stack(slopes, axis=1)
