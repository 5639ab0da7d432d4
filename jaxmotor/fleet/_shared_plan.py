"""Sine fit, gain and pole of many motors that were driven through one plan: one pass over their data.

With the plan shared, the sine fit of every motor is one matrix: the rows of (XᵀX)⁻¹Xᵀ for the columns sin ωt, cos ωt, 1
and t of each frequency. The same matrix applied to an exact simulation of the plan gives what the fit would read of a
motor with pole a, start from rest and duty steps included; tabulated over log a as a Chebyshev series it is exact to
rounding and shared, too. Gain and pole are then least squares on a few numbers per motor, K in closed form and log a by
Gauss-Newton from the best entry of the table. With h(log a) the model of gain 1 they need y·h, whose series each motor
gets by one matrix product, and h·h and the like, which are shared: some hundred numbers a step, and no matrices.

Data are (frequency, motor, tick): each frequency is one matrix product, as fast as the memory.
"""

import functools
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from numpy.polynomial.chebyshev import chebder, chebval

from jaxmotor._precision import in_float64, to_jax
from jaxmotor.motor import FirstOrder, simulate

NODES = 48
"""Of the Chebyshev series over log a."""
POLES_RAD_S = (1.0, 2000.0)
"""That the series hold for; others are fitted one by one."""
MIDDLE, HALF = float(np.log(np.prod(POLES_RAD_S)) / 2), float(np.log(POLES_RAD_S[1] / POLES_RAD_S[0]) / 2)
"""Of the range of log a: the series' argument is (log a - MIDDLE)/HALF."""
STEPS, LONGEST = 4, 1 / HALF
"""Of Gauss-Newton; from a node they reach rounding. None is longer than 1 in log a."""
BLOCKS = 8
"""A sine fit of data in single precision is summed in so many blocks of rows, and these in double precision: one sum of
all rows loses up to a fifth of a standard error, and how much depends on the order that a processor adds them in."""


class SharedPlan(eqx.Module):
    """What the motors have in common."""

    frequency_Hz: Float[Array, " f"]
    project: Float[Array, "f n 2"]
    """From positions [counts] to the coefficients of sin and cos, in standard errors of them."""
    colour: Float[Array, "f 2 2"]
    """From standard errors back to coefficients [counts]."""
    series: Float[Array, "k f 2"]
    """Chebyshev series, over log a, of `project` applied to a motor with gain 1."""
    nodes: Float[Array, "k f 2"]
    """Its values at the nodes."""
    log_pole_nodes: Float[Array, " k"]
    square: Float[Array, " l"]
    """Series of h·h, h what `series` gives."""
    bend: Float[Array, " k"]
    """Series of dh·dh less the part of dh along h, both over the series' argument."""


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
    logs = to_jax(_log_pole(_nodes(NODES)))
    project, colour, nodes = _tables(frequency, drive, period, unit, logs)
    series = _series(np.asarray(nodes))
    square, bend = _shared_sums(series.reshape(NODES, -1))
    return SharedPlan(frequency, project, colour, to_jax(series), nodes, logs, to_jax(square), to_jax(bend))


def _nodes(number: int) -> np.ndarray:
    """Of a Chebyshev series of `number` terms, on [-1, 1]."""
    return np.cos(np.pi * (np.arange(number) + 0.5) / number)


def _series(values: np.ndarray) -> np.ndarray:
    """The series (k, ...) of a function with `values` (k, ...) at its nodes."""
    number = len(values)
    terms = np.cos(np.outer(np.arange(number), np.pi * (np.arange(number) + 0.5) / number)) * 2 / number
    terms[0] /= 2
    return np.tensordot(terms, values, 1)


def _log_pole(x: Any) -> Any:
    """log a of the series' argument."""
    return MIDDLE + HALF * x


def _shared_sums(series: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """`square` and `bend` of the model that `series` (k, c) gives."""
    square = (chebval(_nodes(2 * NODES - 1), series) ** 2).sum(0)
    model, slope = chebval(_nodes(NODES), series), chebval(_nodes(NODES), chebder(series))
    bend = (slope**2).sum(0) - (model * slope).sum(0) ** 2 / (model**2).sum(0)
    return _series(square), _series(bend)


@eqx.filter_jit
def _tables(frequency, volts, period, unit, logs) -> tuple[Array, Array, Array]:
    """`project`, `colour` and `nodes`."""
    length = volts.shape[1]
    tick = jnp.arange(length, dtype=volts.dtype)
    angle = 2 * jnp.pi * frequency[:, None] * period * tick[None]
    more = [jnp.ones_like(angle), jnp.broadcast_to((2 * tick / length - 1)[None], angle.shape)]
    columns = jnp.stack([jnp.sin(angle), jnp.cos(angle), *more], axis=-1)
    inverse = jnp.linalg.inv(jnp.einsum("fnc,fnd->fcd", columns, columns))
    fit = jnp.einsum("fcd,fnd->fnc", inverse, columns)[..., :2]
    colour = jnp.linalg.cholesky(inverse[:, :2, :2] / 12)
    project = jnp.einsum("fij,fnj->fni", jnp.linalg.inv(colour), fit)
    reset = jnp.zeros(length, bool).at[0].set(True)

    def at(log_pole):
        motor = FirstOrder(jnp.ones_like(log_pole), jnp.exp(log_pole))
        turn = jax.vmap(lambda u: simulate(motor, u, reset, jnp.zeros_like(u), period).turn)(volts) / unit
        return jnp.einsum("fnc,fn->fc", project, jnp.cumsum(turn, axis=1) - turn)

    return project, colour, jax.lax.map(at, logs)


def fit_shared(plan: SharedPlan, position: Float[Array, "f m n"]) -> SharedFit:
    """Sine fit, gain and pole of each motor from its `position` since the segment's start [counts].

    Any precision: the pass over the data runs in that of `position`. The rest takes double precision where that is on.
    """
    return fit_projected(plan, project(plan, position))


def project(plan: SharedPlan, position: Float[Array, "f m n"]) -> Float[Array, "f m 2"]:
    """The sine fit: coefficients of sin and cos, in standard errors."""
    fit = plan.project.astype(position.dtype)
    fit = fit if position.dtype == jnp.float64 else _in_blocks(fit)
    read = jnp.einsum("fmn,fnc->fmc", position, fit).reshape(*position.shape[:2], -1, 2)
    return read.astype(plan.project.dtype).sum(2).astype(position.dtype)


def _in_blocks(fit: Float[Array, "f n 2"]) -> Float[Array, "f n c"]:
    """`fit` with columns of their own for each block of rows, so that one product gives the sum over each block."""
    length = fit.shape[1]
    own = jax.nn.one_hot(jnp.arange(length) * BLOCKS // length, BLOCKS, dtype=fit.dtype)
    return (own[None, :, :, None] * fit[:, :, None]).reshape(len(fit), length, -1)


def fit_projected(plan: SharedPlan, read: Float[Array, "f m 2"]) -> SharedFit:
    """Gain and pole from the sine fit."""
    read = read.astype(plan.series.dtype)
    flat = jnp.swapaxes(read, 1, 2).reshape(-1, read.shape[1])
    series, table = plan.series.reshape(NODES, -1), plan.nodes.reshape(NODES, -1)
    best = jnp.argmax((table @ flat) ** 2 / (table**2).sum(1)[:, None], axis=0)
    x = _refined(plan, series @ flat, (plan.log_pole_nodes[best] - MIDDLE) / HALF)
    terms, slopes = _chebyshev(x, len(plan.square))
    square, square_slope, bend = _shared(plan, terms, slopes)
    model = series.T @ jnp.stack(terms[:NODES])
    gain = (model * flat).sum(0) / square
    chi2 = ((flat - gain[None] * model) ** 2).sum(0) / (flat.shape[0] - 2)
    # The information on log K and log a is K² [hh, hd; hd, dd], with d the derivative of h by log a.
    noise = jnp.maximum(chi2, 1.0) / gain**2
    pole_error = jnp.sqrt(noise / bend) * HALF
    gain_error = jnp.sqrt(noise * (1 / square + (square_slope / square) ** 2 / (4 * bend)))
    coefficients = jnp.einsum("fij,fmj->mfi", plan.colour, read)
    return SharedFit(coefficients, gain, jnp.exp(_log_pole(x)), gain_error, pole_error, chi2)


def _refined(plan: SharedPlan, series: Float[Array, "k m"], x: Float[Array, " m"]) -> Float[Array, " m"]:
    """The series' argument after `STEPS` Gauss-Newton steps from `x`; `series` is that of b = y·h.

    With s = h·h and e the bend, K is at its best b/s for every a, and the step is (db - b ds/2s) s/(b e).
    """

    def step(_, x):
        terms, slopes = _chebyshev(x, len(plan.square))
        along, along_slope = _sum(series, terms), _sum(series, slopes)
        square, square_slope, bend = _shared(plan, terms, slopes)
        delta = (along_slope * square - along * square_slope / 2) / (along * bend)
        return jnp.clip(x + jnp.clip(delta, -LONGEST, LONGEST), -1.0, 1.0)

    return jax.lax.fori_loop(0, STEPS, step, x)


def _shared(plan: SharedPlan, terms: list[Float[Array, " m"]], slopes: list[Float[Array, " m"]]):
    """h·h, its derivative, and the bend."""
    return _sum(plan.square, terms), _sum(plan.square, slopes), _sum(plan.bend, terms)


def _sum(series: Float[Array, "k ..."], terms: list[Float[Array, " m"]]) -> Float[Array, " m"]:
    return functools.reduce(jnp.add, (series[k] * term for k, term in enumerate(terms[: len(series)])))


def _chebyshev(x: Float[Array, " m"], number: int) -> tuple[list[Float[Array, " m"]], list[Float[Array, " m"]]]:
    """T_k(x) and its derivative k U_{k-1}(x), by their recurrence: cheaper than cosines, and exact on [-1, 1]."""
    one, none = jnp.ones_like(x), jnp.zeros_like(x)
    first, second = [one, x], [none, one]
    for _ in range(2, number):
        first.append(2 * x * first[-1] - first[-2])
        second.append(2 * x * second[-1] - second[-2])
    return first, [k * each for k, each in enumerate(second)]
