"""Response at all test frequencies of a recording at once, by linear least squares.

With the frequency known, A sin(ωt + φ) = (A cos φ) sin ωt + (A sin φ) cos ωt is linear: one small system per frequency
gives what the paper's simplex search (eq. 14) converges to. The columns

    sin ωt,  cos ωt,  1,  t,  exp(-a t)

are complete for the position of a first-order motor that starts at rest or at speed, with an offset of the voltage
(the drift of the paper's Fig. 6): nothing has to die out first. For a logged speed the drift is not there.
The sine fit needs the pole a, and the pole comes from the response: three rounds suffice (each gains a factor 1000).
In a last round the fit is to what an exact simulation with the real duty leaves over, which frees the response
from the harmonics of the duty's steps.
"""

from typing import Any, Literal, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Complex, Float

from jaxmotor.estimate._frequency_response import FrequencyResponse
from jaxmotor.motor import (
    FirstOrder,
    mean_speed_response,
    phasor,
    position_response,
    simulate,
    speed_response,
    to_complex,
)

ROUNDS = 4
"""Of weighing the frequencies by the motor found and fitting it again."""


class Sines(eqx.Module):
    """The sine segments of one recording, padded to one length, and perhaps with frequencies that have no rows."""

    frequency_Hz: Float[Any, " f"]
    time: Float[Any, "f n"]
    """Since the segment's first row [s]."""
    volts: Float[Any, "f n"]
    measured: Float[Any, "f n"]
    """Position since the segment's first row [units], or speed [units/s]."""
    valid: Bool[Any, "f n"]
    unit: Float[Any, ""]
    """One unit [rad]."""
    period: Float[Any, ""]
    """Of the ticks [s]."""
    kind: Literal["position", "mean_speed", "speed"] = eqx.field(static=True)
    """Position; mean speed over the previous tick; mean speed over `window_s` before the row."""
    window_s: float = eqx.field(static=True)
    floor_known: bool = eqx.field(static=True)
    """A unit is one count, so that a position's error has variance 1/12."""

    @property
    def used(self) -> Bool[Array, " f"]:
        """The frequency has rows."""
        return self.valid.any(axis=1)

    @property
    def z(self) -> Complex[Array, " f"]:
        """exp(jωT)."""
        return phasor(self.frequency_Hz * self.period)


class Phasors(NamedTuple):
    """A fit of sin, cos and other columns to each row of a block."""

    phasor: Complex[Array, " f"]
    """A exp(jφ) of A sin(ωt + φ)."""
    covariance: Float[Array, "f 2 2"]
    """(XᵀX)⁻¹ of sin and cos with the other columns at their best: the phasor's covariance for residuals of size 1."""
    variance: Float[Array, " f"]
    """Mean squared residual, corrected for the number of columns."""


def fit_phasors(columns: Float[Array, "f n c"], values: Float[Array, "f n"], valid: Bool[Array, "f n"]) -> Phasors:
    """Least squares of `values` on `columns`, of which the first two are sin ωt and cos ωt."""
    weight = valid.astype(values.dtype)
    columns = columns * weight[..., None]
    gram = jnp.einsum("fnc,fnd->fcd", columns, columns)
    right = jnp.einsum("fnc,fn->fc", columns, values)
    scale = jnp.sqrt(jnp.diagonal(gram, axis1=1, axis2=2))
    scale = jnp.where(scale > 0, scale, 1.0)
    balanced = gram / (scale[:, :, None] * scale[:, None, :])
    inverse = jnp.linalg.inv(balanced + 1e-13 * jnp.eye(gram.shape[-1], dtype=gram.dtype)[None])
    coefficients = jnp.einsum("fcd,fd->fc", inverse, right / scale) / scale
    residual = weight * (values - jnp.einsum("fnc,fc->fn", columns, coefficients))
    freedom = jnp.maximum(weight.sum(1) - columns.shape[-1], 1.0)
    covariance = (inverse / (scale[:, :, None] * scale[:, None, :]))[:, :2, :2]
    phasor = jax.lax.complex(coefficients[:, 0], coefficients[:, 1])
    return Phasors(phasor, covariance, (residual**2).sum(1) / freedom)


def sine_columns(sines: Sines) -> Float[Array, "f n 2"]:
    """sin ωt and cos ωt."""
    angle = 2 * jnp.pi * sines.frequency_Hz[:, None] * sines.time
    return jnp.stack([jnp.sin(angle), jnp.cos(angle)], axis=-1)


def fit_sines(sines: Sines) -> tuple[FrequencyResponse, FirstOrder]:
    """Response at every frequency, and the first-order motor that its last round was based on.

    Needs two frequencies or more: with one, the pole that describes the transient is not determined.
    """
    wave = sine_columns(sines)
    constant = jnp.ones((*sines.time.shape, 1), sines.time.dtype)
    drive = fit_phasors(jnp.concatenate([wave, constant], axis=-1), sines.volts, sines.valid).phasor
    drive = jnp.where(sines.used, drive, jnp.ones_like(drive))
    middle = jnp.exp(jnp.log(sines.frequency_Hz).mean(where=sines.used))
    start = FirstOrder(jnp.ones_like(sines.unit), 2 * jnp.pi * middle)

    def again(_, motor: FirstOrder) -> FirstOrder:
        output = _fit_output(sines, wave, sines.measured, motor.pole).phasor / drive
        response = _mean_speed(output, sines) * to_complex(sines.unit)
        return linear_start(sines.frequency_Hz, response, sines.period, sines.used)

    motor = jax.lax.fori_loop(0, ROUNDS, again, start)
    known, own = jnp.zeros_like(sines.measured), jnp.zeros_like(drive)
    if sines.kind != "speed" or sines.window_s == 0:
        known = _simulated(sines, motor, drive, wave) / sines.unit
        own = _response(motor, sines) / to_complex(sines.unit)
    phasors = _fit_output(sines, wave, sines.measured - known, motor.pole)
    return _frequency_response(phasors.phasor / drive + own, phasors, drive, sines), motor


def linear_start(
    frequency_Hz: Float[Array, " f"],
    response: Complex[Array, " f"],
    period: Float[Array, ""],
    used: Bool[Array, " f"] | None = None,
) -> FirstOrder:
    """First-order motor near the mean-speed response V, where `used`: V z = p V + b1 z + b0 is linear in p, b1, b0."""
    z = phasor(frequency_Hz * period)
    columns = jnp.stack([response, z, jnp.ones_like(z)], axis=-1)
    right = response * z
    if used is not None:
        columns, right = jnp.where(used[:, None], columns, 0.0), jnp.where(used, right, 0.0)
    stacked = jnp.concatenate([columns.real, columns.imag])
    (p, b1, b0), *_ = jnp.linalg.lstsq(stacked, jnp.concatenate([right.real, right.imag]))
    p = jnp.clip(p, jnp.exp(-20.0), 1 - 1e-7)
    return FirstOrder((b1 + b0) / (1 - p), -jnp.log(p) / period)


def _fit_output(
    sines: Sines, wave: Float[Array, "f n 2"], values: Float[Array, "f n"], pole: Float[Array, ""]
) -> Phasors:
    length = jnp.max(jnp.where(sines.valid, sines.time, sines.period), axis=1, keepdims=True)
    more = [jnp.ones_like(sines.time), jnp.exp(-pole * sines.time)]
    if sines.kind == "position":
        more.append(2 * sines.time / length - 1)
    return fit_phasors(jnp.concatenate([wave, jnp.stack(more, axis=-1)], axis=-1), values, sines.valid)


def _mean_speed(output: Complex[Array, " f"], sines: Sines) -> Complex[Array, " f"]:
    """V(z) from the response of what was measured; for a speed over another window than the tick to second order."""
    if sines.kind == "position":
        return output * (sines.z - 1) / to_complex(sines.period)
    if sines.kind == "mean_speed":
        return output * sines.z
    return output * phasor(sines.frequency_Hz * (sines.period + sines.window_s) / 2)


def _response(motor: FirstOrder, sines: Sines) -> Complex[Array, " f"]:
    """Of what was measured, in rad/V or rad/s/V."""
    if sines.kind == "position":
        return position_response(motor, sines.frequency_Hz, sines.period)
    if sines.kind == "mean_speed":
        return mean_speed_response(motor, sines.frequency_Hz, sines.period) / sines.z
    return speed_response(motor, sines.frequency_Hz, sines.period)


def _simulated(
    sines: Sines, motor: FirstOrder, drive: Complex[Array, " f"], wave: Float[Array, "f n 2"]
) -> Float[Array, "f n"]:
    """What `motor` would show [rad or rad/s] under the real voltages; a lost row's is taken from the fitted sine."""
    fitted = wave[..., 0] * drive.real[:, None] + wave[..., 1] * drive.imag[:, None]
    volts = jnp.where(sines.valid, sines.volts, fitted)
    reset = jnp.zeros(sines.time.shape[1], bool).at[0].set(True)

    def one(volts: Float[Array, " n"]) -> Float[Array, " n"]:
        motion = simulate(motor, volts, reset, jnp.zeros_like(volts), sines.period)
        if sines.kind == "position":
            return jnp.cumsum(motion.turn) - motion.turn
        return jnp.roll(motion.turn, 1) / sines.period if sines.kind == "mean_speed" else motion.speed

    return jax.vmap(one)(volts)


def _frequency_response(
    output: Complex[Array, " f"], phasors: Phasors, drive: Complex[Array, " f"], sines: Sines
) -> FrequencyResponse:
    """From what was measured to the speed, with the covariance carried along."""
    to_speed = to_complex(sines.unit)
    if sines.kind == "speed":
        to_speed = jnp.broadcast_to(to_speed, drive.shape)
    else:
        to_speed = _mean_speed(jnp.broadcast_to(to_speed, drive.shape), sines)
    variance = jnp.maximum(phasors.variance, 1 / 12) if sines.floor_known else phasors.variance
    factor = to_speed / drive
    rows = [jnp.stack([factor.real, -factor.imag], axis=-1), jnp.stack([factor.imag, factor.real], axis=-1)]
    turn = jnp.stack(rows, axis=-2)
    covariance = jnp.einsum("fij,fjk,flk->fil", turn, phasors.covariance * variance[:, None, None], turn)
    window = sines.window_s if sines.kind == "speed" else None
    return FrequencyResponse(sines.frequency_Hz, output * to_speed, covariance, jnp.abs(drive), sines.period, window)
