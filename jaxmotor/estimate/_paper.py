"""Gain and pole exactly as Okuyama, Maximo and Pinto published them, for comparison.

Speed is the difference to the previous count (eq. 1), stamped at the tick it ends at. Each sine is fitted with
A sin(2πft + φ) over all rows (eq. 12-14: the simplex search's answer, by linear least squares). The gain is a step's
final speed over its voltage (eq. 15). With the gain known the pole minimises

    J_B(a) = Σ_f e_g² + e_φ²,   e_g = 20 log10 |V(f)| - 20 log10 |G ZOH| [dB],   e_φ = arg V(f) - arg(G ZOH) [degrees]

(eq. 16-19) where G ZOH is the continuous approximation of eq. 4. Voltages are the nominal ones of the header.
"""

import dataclasses
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import optimistix as optx
from jaxtyping import Array, Complex, Float

from jaxmotor._errors import JaxmotorError
from jaxmotor.estimate._frequency_response import FrequencyResponse
from jaxmotor.estimate._sine_data import sine_data, sine_segments
from jaxmotor.estimate._sine_fit import fit_phasors, linear_start
from jaxmotor.motor import FirstOrder, paper_response, phasor, to_complex
from jaxmotor.recording import Recording, Segment, angle_of


class PaperFit(NamedTuple):
    """What the paper's method finds."""

    motor: FirstOrder
    standard_error: FirstOrder
    response: FrequencyResponse
    """Of the speed over the previous tick; its covariance assumes white errors, as the paper's cost does."""


def fit_paper(recording: Recording, segments: tuple[int, ...]) -> PaperFit:
    """The paper's method on `segments` of `recording`: sines for the pole, steps for the gain.

    **Raises:** `JaxmotorError` where there are no sines, no steps, or no even ticks.
    """
    if len(sine_segments(recording, segments)) < 2:
        raise JaxmotorError(
            f"{recording.name}: the paper's method needs sine segments of at least two frequencies with even ticks; "
            "use --method exact, or record sines"
        )
    response = _paper_sines(recording, segments)
    gain, gain_error = _gain(recording, segments)
    z = phasor(response.frequency_Hz * response.period_s)
    start = linear_start(response.frequency_Hz, response.response * z, response.period_s)
    pole, pole_error = fit_paper_pole(response, jnp.asarray(gain), start.pole)
    return PaperFit(FirstOrder(jnp.asarray(gain), pole), FirstOrder(jnp.asarray(gain_error), pole_error), response)


def fit_paper_sines(
    frequency_Hz: Float[Array, " f"], time: Float[Array, "f n"], speed: Float[Array, "f n"], valid
) -> tuple[Complex[Array, " f"], Float[Array, "f 2 2"]]:
    """A exp(jφ) that minimises Σ (speed - A sin(2πft + φ))² (eq. 12-14), and its covariance for white errors."""
    angle = 2 * jnp.pi * frequency_Hz[:, None] * time
    phasors = fit_phasors(jnp.stack([jnp.sin(angle), jnp.cos(angle)], axis=-1), speed, valid)
    return phasors.phasor, phasors.covariance * phasors.variance[:, None, None]


@eqx.filter_jit
def fit_paper_pole(
    response: FrequencyResponse, gain: Float[Array, ""], start: Float[Array, ""]
) -> tuple[Float[Array, ""], Float[Array, ""]]:
    """The pole [rad/s] that minimises eq. 18 for a known `gain`, and its standard error from the residuals."""

    def residual(log_pole: Float[Array, " 1"], args: None) -> Float[Array, " r"]:
        del args
        model = paper_response(FirstOrder(gain, jnp.exp(log_pole[0])), response.frequency_Hz, response.period_s)
        # The angle of the ratio, so that a phase beyond ±180 degrees is no jump.
        ratio = response.response / model
        return jnp.concatenate([20 * jnp.log10(jnp.abs(ratio)), jnp.rad2deg(jnp.angle(ratio))])

    solver = optx.LevenbergMarquardt(rtol=1e-10, atol=1e-10)
    log_pole = optx.least_squares(residual, solver, jnp.log(start)[None], max_steps=512, throw=False).value
    left, slope = residual(log_pole, None), jax.jacfwd(residual)(log_pole, None)[:, 0]
    variance = (left**2).sum() / (left.size - 1) / (slope**2).sum()
    pole = jnp.exp(log_pole[0])
    return pole, pole * jnp.sqrt(variance)


def _paper_sines(recording: Recording, segments: tuple[int, ...]) -> FrequencyResponse:
    # As published: of when a duty acts after its count it knows nothing.
    sines = sine_data(dataclasses.replace(recording, duty_delay_s=None), segments)
    speed, valid = sines.measured * sines.unit, sines.valid.copy()
    if sines.kind == "position":
        speed = np.diff(speed, axis=1, prepend=0.0) / sines.period
        valid &= np.pad(sines.valid[:, :-1], ((0, 0), (1, 0)))
    runs = [recording.segments[index] for index in sine_segments(recording, segments)]
    amplitude = jnp.asarray([float(run.parameters.get("amplitude_V", 1.0)) for run in runs])
    phasor, covariance = fit_paper_sines(*map(jnp.asarray, (sines.frequency_Hz, sines.time, speed, valid)))
    return FrequencyResponse(
        jnp.asarray(sines.frequency_Hz),
        phasor / to_complex(amplitude),
        covariance / (amplitude**2)[:, None, None],
        jnp.abs(amplitude),
        jnp.asarray(sines.period),
        window_s=float(sines.period),
    )


def _gain(recording: Recording, segments: tuple[int, ...]) -> tuple[float, float]:
    """Mean over the steps of final speed over voltage (eq. 15), and its standard error [rad/s/V]."""
    steps = [recording.segments[index] for index in segments if recording.segments[index].kind == "step"]
    gains = [gain for gain in (_step_gain(recording, step) for step in steps) if gain is not None]
    if not gains:
        raise JaxmotorError(
            f"{recording.name}: the paper's method takes the gain from a step's final speed (eq. 15), and no segment "
            "of kind 'step' holds its voltage to the end; use --method exact, or record a step"
        )
    error = float(np.std(gains, ddof=1) / np.sqrt(len(gains))) if len(gains) > 1 else 0.0
    return float(np.mean(gains)), error


def _step_gain(recording: Recording, step: Segment) -> float | None:
    """From the second half of the rows that hold the last voltage."""
    driven = np.flatnonzero(step.volts != step.volts[-1])
    first = int(driven[-1]) + 1 if driven.size else 0
    half = first + (len(step) - first) // 2
    if step.volts[-1] == 0.0 or len(step) - half < 3:
        return None
    volts = step.parameters.get("amplitude_V", step.volts[-1])
    return _mean_speed(recording, step, half) / float(volts)


def _mean_speed(recording: Recording, segment: Segment, first: int) -> float:
    if segment.speed_rad_s is not None:
        return float(segment.speed_rad_s[first:].mean())
    angle = angle_of(recording, segment)
    return float((angle[-1] - angle[first]) / (segment.time_s[-1] - segment.time_s[first]))
