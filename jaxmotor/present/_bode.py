"""Measured frequency responses, and the models fitted to them (the paper's Fig. 8 and 9).

A response measured to a thousandth has bands narrower than a printed line: they have a panel of their own, and
models are told apart by what they leave over, in panels below.
"""

from collections.abc import Sequence
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from jaxmotor._precision import in_float64
from jaxmotor.estimate import Fit, FrequencyResponse
from jaxmotor.motor import AbstractLinearMotor, paper_response
from jaxmotor.present._style import (
    BAND,
    BLACK,
    EXACT,
    GREY,
    MEASURED,
    OTHER,
    PAPER,
    REFERENCE,
    SECOND,
    Look,
    OnAxes,
    frequency_axis,
    legend_above,
    panels,
    styled,
)
from jaxmotor.present._zoh import decibel, degrees

BAND_SE = 1.96
"""Standard errors each way that hold the truth 95 times of 100."""
DB_PER_RELATIVE = 20 / np.log(10)
LOOKS: dict[str, tuple[Look, str]] = {
    "exact model": (EXACT, "o"),
    "paper model": (PAPER, "s"),
    "exact model, second order": (SECOND, "D"),
}


class Band(NamedTuple):
    """Half-widths of the 95 % bands of a response."""

    gain_dB: np.ndarray
    phase_deg: np.ndarray


class Left(NamedTuple):
    """What a model leaves of a measurement."""

    label: str
    gain_dB: np.ndarray
    phase_deg: np.ndarray
    band: Band
    look: Look
    marker: str


def response_band(measured: FrequencyResponse) -> Band:
    """95 % half-widths of gain and phase, from the covariance of real and imaginary part."""
    gain, phase = map(np.asarray, _standard_errors(measured))
    return Band(BAND_SE * DB_PER_RELATIVE * gain, np.rad2deg(BAND_SE * phase))


@eqx.filter_jit
def _standard_errors(measured: FrequencyResponse):
    return measured.gain_standard_error, measured.phase_standard_error


@styled
@in_float64
def bode(frequency_response: FrequencyResponse, *, axes: OnAxes = None) -> Figure:
    """Gain and phase of a measured response with its 95 % bands, and the bands' half-widths below."""
    figure, axes = panels(3, 4.4, heights=(3, 3, 2), axes=axes)
    gain, phase, width = axes[:, 0]
    measured = in_order(frequency_response)
    frequency, response = np.asarray(measured.frequency_Hz), np.asarray(measured.response)
    band = response_band(measured)
    _banded(gain, frequency, decibel(response), band.gain_dB)
    _banded(phase, frequency, degrees(response), band.phase_deg)
    gain.set_ylabel("Gain (dB re 1 rad/s/V)")
    phase.set_ylabel("Phase (degrees)")
    width.plot(frequency, band.gain_dB, marker="o", markerfacecolor="white", label="gain (dB)", **EXACT)
    width.plot(frequency, band.phase_deg, marker="s", markerfacecolor="white", label="phase (degrees)", **PAPER)
    width.set(yscale="log", ylabel="95 % half-\nwidth", xlabel="Frequency (Hz)")
    legend_above(width)
    legend_above(gain)
    frequency_axis(width)
    return figure


@styled
@in_float64
def bode_models(frequency_response: FrequencyResponse, fits: Sequence[Fit], *, axes: OnAxes = None) -> Figure:
    """A measured response with the models of `fits` (one of each kind), and what each leaves over.

    A fit by the paper's method is held against what that method reads: the difference to the *previous* count.
    Where there is an exact fit too, the paper's formula is also drawn with the exact motor: what is left then is not
    the pole's fault, and follows the -ωT/2 of that difference, which the paper's model lacks.
    """
    figure, axes = panels(4, 5.6, heights=(3, 3, 2, 2.4), axes=axes)
    gain, phase, gain_left, phase_left = axes[:, 0]
    measured = in_order(frequency_response)
    frequency = np.asarray(measured.frequency_Hz)
    nyquist_Hz = 0.5 / float(measured.period_s)
    fine = np.geomspace(frequency[0] / 1.15, min(frequency[-1] * 1.15, 0.99 * nyquist_Hz), 200)
    readings = {fit.method: as_paper_reads(measured, fit) if fit.method == "paper" else measured for fit in fits}
    for method, seen in readings.items():
        _draw_points(gain, phase, seen, method)
    for fit in fits:
        _draw_model(gain, phase, readings[fit.method], fit, fine)
    leftovers = [_left(readings[fit.method], fit.motor, fit.method, name(fit), *LOOKS[name(fit)]) for fit in fits]
    exact = [fit for fit in fits if fit.method == "exact"]
    if exact and "paper" in readings:
        motor, label = exact[0].motor, "paper model at the exact pole"
        leftovers.append(_left(readings["paper"], motor, "paper", label, OTHER, "^"))
    for left in leftovers:
        look = {**left.look, "marker": left.marker, "markerfacecolor": "white", "linewidth": 0.9, "capsize": 2}
        gain_left.errorbar(frequency, left.gain_dB, left.band.gain_dB, label=left.label, **look)
        phase_left.errorbar(frequency, left.phase_deg, left.band.phase_deg, label=left.label, **look)
    for ax in (gain_left, phase_left):
        ax.axhline(0, color=GREY, linewidth=0.6)
    if "paper" in readings:
        lag = -180 * fine * float(measured.period_s)
        (line,) = phase_left.plot(fine, lag, label="\N{MINUS SIGN}ωT/2, the count difference", **REFERENCE)
        phase_left.legend(handles=[line], loc="lower left")
    gain.set_ylabel("Gain\n(dB re 1 rad/s/V)")
    phase.set_ylabel("Phase (degrees)")
    gain_left.set_ylabel("Gain left\n(dB)")
    phase_left.set(ylabel="Phase left\n(degrees)", xlabel="Frequency (Hz)")
    legend_above(gain)
    legend_above(gain_left)
    frequency_axis(phase_left)
    return figure


def name(fit: Fit) -> str:
    """Of the model of `fit`, for legends."""
    order = ", second order" if fit.motor.order == 2 else ""
    return f"{fit.method} model{order}"


def _draw_points(gain: Axes, phase: Axes, seen: FrequencyResponse, method: str) -> None:
    frequency, response, band = np.asarray(seen.frequency_Hz), np.asarray(seen.response), response_band(seen)
    marker, size = ("s", 5.5) if method == "paper" else ("o", 3)
    look = {**MEASURED, "marker": marker, "markersize": size, "markerfacecolor": "none"}
    for ax, value, half in ((gain, decibel(response), band.gain_dB), (phase, degrees(response), band.phase_deg)):
        ax.fill_between(frequency, value - half, value + half, **BAND)
        ax.plot(frequency, value, label=f"measured, {method} reading", **look)


def _draw_model(gain: Axes, phase: Axes, seen: FrequencyResponse, fit: Fit, fine: np.ndarray) -> None:
    model = model_response(seen, fit.motor, fit.method, fine)
    look, _ = LOOKS[name(fit)]
    gain.plot(fine, decibel(model), label=name(fit), **look)
    phase.plot(fine, degrees(model), label=name(fit), **look)


def _left(
    seen: FrequencyResponse, motor: AbstractLinearMotor, method: str, label: str, look: Look, marker: str
) -> Left:
    """Measured over modelled, in dB and degrees."""
    ratio = np.asarray(seen.response) / model_response(seen, motor, method, np.asarray(seen.frequency_Hz))
    return Left(label, decibel(ratio), degrees(ratio), response_band(seen), look, marker)


def as_paper_reads(measured: FrequencyResponse, fit: Fit) -> FrequencyResponse:
    """The response as the paper's method read it: its own measurement, or `measured` turned by z⁻¹."""
    own = None if fit.frequency_response is None else in_order(fit.frequency_response)
    if own is not None and np.array_equal(own.frequency_Hz, measured.frequency_Hz):
        return own
    if measured.window_s is not None:
        return measured
    lag = -2 * np.pi * np.asarray(measured.frequency_Hz) * float(measured.period_s)
    turn = np.stack([np.stack([np.cos(lag), -np.sin(lag)], -1), np.stack([np.sin(lag), np.cos(lag)], -1)], -2)
    covariance = np.einsum("fij,fjk,flk->fil", turn, np.asarray(measured.covariance), turn)
    return FrequencyResponse(
        measured.frequency_Hz,
        jnp.asarray(np.asarray(measured.response) * np.exp(1j * lag)),
        jnp.asarray(covariance),
        measured.amplitude_V,
        measured.period_s,
        float(measured.period_s),
    )


def model_response(
    seen: FrequencyResponse, motor: AbstractLinearMotor, method: str, frequency_Hz: np.ndarray
) -> np.ndarray:
    """What `method` says that `seen` would be of `motor`: exact, or the paper's G(jω) ZOH(jω)."""
    return np.asarray(_modelled(seen, jax.tree.map(jnp.asarray, motor), method == "paper", jnp.asarray(frequency_Hz)))


@eqx.filter_jit
def _modelled(seen: FrequencyResponse, motor: AbstractLinearMotor, paper: bool, frequency_Hz: jax.Array):
    if paper:
        return paper_response(motor, frequency_Hz, seen.period_s)
    return seen.of(motor, frequency_Hz)


def in_order(measured: FrequencyResponse) -> FrequencyResponse:
    """`measured` as JAX arrays, lowest frequency first."""
    order = np.argsort(np.asarray(measured.frequency_Hz))
    return jax.tree.map(lambda leaf: jnp.asarray(leaf)[order] if np.ndim(leaf) else jnp.asarray(leaf), measured)


def _banded(ax: Axes, frequency: np.ndarray, value: np.ndarray, half: np.ndarray) -> None:
    ax.fill_between(frequency, value - half, value + half, label="95 % band", **BAND)
    ax.plot(frequency, value, color=BLACK, linewidth=0.6)
    ax.errorbar(frequency, value, half, label="measured", capsize=2, elinewidth=0.8, **MEASURED)
