"""Measured frequency responses, and the models fitted to them (the paper's Fig. 8 and 9).

A response measured to a thousandth has bands narrower than a printed line: they have a panel of their own, and
models are told apart by what they leave over, in panels below.
"""

from collections.abc import Sequence
from typing import NamedTuple

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
    frequency_axis,
    legend_above,
    panels,
    styled,
)
from jaxmotor.present._zoh import decibel, degrees

BAND_SE = 1.96
"""Standard errors each way that hold the truth 95 times of 100."""
DB_PER_RELATIVE = 20 / np.log(10)


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
    look: dict
    marker: str


def response_band(measured: FrequencyResponse) -> Band:
    """95 % half-widths of gain and phase, from the covariance of real and imaginary part."""
    gain, phase = np.asarray(measured.gain_standard_error), np.asarray(measured.phase_standard_error)
    return Band(BAND_SE * DB_PER_RELATIVE * gain, np.rad2deg(BAND_SE * phase))


@styled
@in_float64
def bode(frequency_response: FrequencyResponse) -> Figure:
    """Gain and phase of a measured response with its 95 % bands, and the bands' half-widths below."""
    figure, axes = panels(3, 4.4, heights=(3, 3, 2))
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
def bode_models(frequency_response: FrequencyResponse, fits: Sequence[Fit]) -> Figure:
    """A measured response with the models of `fits`, and what each leaves over in gain and phase.

    A fit by the paper's method is held against what that method reads: the difference to the *previous* count.
    Where there is an exact fit too, the paper's formula is also drawn with the exact motor: what is left then is not
    the pole's fault, and follows the -ωT/2 of that difference, which the paper's model lacks.
    """
    figure, axes = panels(4, 5.6, heights=(3, 3, 2, 2.4))
    gain, phase, gain_left, phase_left = axes[:, 0]
    measured = in_order(frequency_response)
    frequency = np.asarray(measured.frequency_Hz)
    fine = np.geomspace(frequency[0] / 1.15, frequency[-1] * 1.15, 200)
    leftovers = [_draw_fit(gain, phase, measured, fit, fine) for fit in fits]
    exact = [fit for fit in fits if fit.method == "exact"]
    if exact and len(exact) < len(fits):
        leftovers.append(_formula_left(measured, fits, exact[0].motor))
    for left in leftovers:
        look = {**left.look, "marker": left.marker, "markerfacecolor": "white", "linewidth": 0.9, "capsize": 2}
        gain_left.errorbar(frequency, left.gain_dB, left.band.gain_dB, label=left.label, **look)
        phase_left.errorbar(frequency, left.phase_deg, left.band.phase_deg, label=left.label, **look)
    _reference_lag(phase_left, fine, float(measured.period_s))
    gain.set_ylabel("Gain\n(dB re 1 rad/s/V)")
    phase.set_ylabel("Phase (degrees)")
    gain_left.set_ylabel("Gain left\n(dB)")
    phase_left.set(ylabel="Phase left\n(degrees)", xlabel="Frequency (Hz)")
    legend_above(gain)
    legend_above(gain_left)
    phase_left.legend(*_last_entry(phase_left), loc="lower left")
    frequency_axis(phase_left)
    return figure


def _draw_fit(gain: Axes, phase: Axes, measured: FrequencyResponse, fit: Fit, fine: np.ndarray) -> Left:
    """The points that the fit's method read, its model, and what is left between them."""
    seen = as_paper_reads(measured, fit) if fit.method == "paper" else measured
    frequency, response = np.asarray(seen.frequency_Hz), np.asarray(seen.response)
    band = response_band(seen)
    look, marker, name = (PAPER, "s", "paper") if fit.method == "paper" else (EXACT, "o", "exact")
    reading = "from the previous count" if fit.method == "paper" else "over the tick"
    model = model_response(seen, fit.motor, fit.method, fine)
    points = {**MEASURED, "marker": marker}
    for ax, of, half in ((gain, decibel, band.gain_dB), (phase, degrees, band.phase_deg)):
        ax.fill_between(frequency, of(response) - half, of(response) + half, **BAND)
        ax.plot(frequency, of(response), label=f"measured, {reading}", **points)
        ax.plot(fine, of(model), label=f"{name} model", **look)
    ratio = response / model_response(seen, fit.motor, fit.method, frequency)
    return Left(f"{name} model", decibel(ratio), degrees(ratio), band, dict(look), marker)


def _formula_left(measured: FrequencyResponse, fits: Sequence[Fit], motor: AbstractLinearMotor) -> Left:
    """What the paper's formula leaves at the exact motor."""
    seen = as_paper_reads(measured, next(fit for fit in fits if fit.method == "paper"))
    frequency, response = np.asarray(seen.frequency_Hz), np.asarray(seen.response)
    ratio = response / model_response(seen, motor, "paper", frequency)
    label = "paper's model with the exact gain and pole"
    return Left(label, decibel(ratio), degrees(ratio), response_band(seen), dict(OTHER), "^")


def as_paper_reads(measured: FrequencyResponse, fit: Fit) -> FrequencyResponse:
    """The response as the paper's method read it: its own measurement, or `measured` turned by z⁻¹."""
    own = None if fit.frequency_response is None else in_order(fit.frequency_response)
    if own is not None and np.array_equal(own.frequency_Hz, measured.frequency_Hz):
        return own
    if measured.window_s is not None:
        return measured
    late = np.exp(-2j * np.pi * np.asarray(measured.frequency_Hz) * float(measured.period_s))
    turn = np.stack([np.stack([late.real, -late.imag], -1), np.stack([late.imag, late.real], -1)], -2)
    covariance = np.einsum("fij,fjk,flk->fil", turn, np.asarray(measured.covariance), turn)
    return FrequencyResponse(
        measured.frequency_Hz,
        jnp.asarray(np.asarray(measured.response) * late),
        jnp.asarray(covariance),
        measured.amplitude_V,
        measured.period_s,
        float(measured.period_s),
    )


def model_response(
    seen: FrequencyResponse, motor: AbstractLinearMotor, method: str, frequency_Hz: np.ndarray
) -> np.ndarray:
    """What `method` says that `seen` would be of `motor`: exact, or the paper's G(jω) ZOH(jω)."""
    motor = jax.tree.map(jnp.asarray, motor)
    frequency = jnp.asarray(frequency_Hz)
    if method == "paper":
        return np.asarray(paper_response(motor, frequency, jnp.asarray(seen.period_s)))
    return np.asarray(seen.of(motor, frequency))


def in_order(measured: FrequencyResponse) -> FrequencyResponse:
    """`measured` as JAX arrays, lowest frequency first."""
    order = np.argsort(np.asarray(measured.frequency_Hz))
    return jax.tree.map(lambda leaf: jnp.asarray(leaf)[order] if np.ndim(leaf) else jnp.asarray(leaf), measured)


def _banded(ax: Axes, frequency: np.ndarray, value: np.ndarray, half: np.ndarray) -> None:
    ax.fill_between(frequency, value - half, value + half, label="95 % band", **BAND)
    ax.plot(frequency, value, color=BLACK, linewidth=0.6)
    ax.errorbar(frequency, value, half, label="measured", capsize=2, elinewidth=0.8, **MEASURED)


def _reference_lag(ax: Axes, frequency: np.ndarray, period_s: float) -> None:
    ax.axhline(0, color=GREY, linewidth=0.6)
    ax.plot(frequency, -180 * frequency * period_s, label="−ωT/2, the count difference", **REFERENCE)


def _last_entry(ax: Axes) -> tuple[list, list[str]]:
    handles, labels = ax.get_legend_handles_labels()
    last = next(index for index, label in enumerate(labels) if label.startswith("−"))
    return [handles[last]], [labels[last]]
