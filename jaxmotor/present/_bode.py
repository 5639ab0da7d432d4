"""Measured frequency responses, and the models fitted to them (the paper's Fig. 8 and 9).

A response measured to a thousandth has bands narrower than a printed line: they have a panel of their own, and
models are compared by their residuals, in panels below.
"""

from collections.abc import Sequence
from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator

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
    OnAxes,
    Style,
    frequency_axis,
    legend_above,
    panels,
    plain_numbers,
    styled,
)
from jaxmotor.present._zoh import decibel, degrees

BAND_SE = 1.96
"""Standard errors each way that hold the truth 95 times of 100."""
SAME_VOLTS = 0.1
"""Part by which amplitudes that count as the same may differ."""
MARKERS, FILLS = ("o", "s", "^"), ("white", GREY, BLACK)
MOST_AMPLITUDES = len(MARKERS)
"""That are told apart in a figure."""
DB_PER_RELATIVE = 20 / np.log(10)
MOST_FREQUENCIES, MOST_TICKS = 300, 5
VISIBLE = 0.01
"""Width of a band, of its panel's height, that can be seen."""
STYLES: dict[tuple[str, int], tuple[Style, str]] = {
    ("exact", 1): (EXACT, "o"),
    ("paper", 1): (PAPER, "s"),
    ("exact", 2): (SECOND, "D"),
}
"""Of a model by the fit's method and order."""


class Band(NamedTuple):
    """Half-widths of the 95 % bands of a response."""

    gain_dB: np.ndarray
    phase_deg: np.ndarray


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
    groups = by_amplitude(measured)
    _banded(gain, frequency, decibel(response), band.gain_dB, groups)
    _banded(phase, frequency, degrees(response), band.phase_deg, groups)
    gain.set_ylabel("Gain (dB re 1 rad/s/V)")
    phase.set_ylabel("Phase (degrees)")
    joined = {} if len(groups) == 1 else {"linestyle": "none"}
    for half, marker, label, style in (
        (band.gain_dB, "o", "gain (dB)", EXACT),
        (band.phase_deg, "s", "phase (degrees)", PAPER),
    ):
        width.plot(frequency, half, marker=marker, markerfacecolor="white", label=label, **(style | joined))
    width.set(yscale="log", ylabel="Half-width\n(95 %)", xlabel="Frequency (Hz)")
    low, high = width.get_ylim()
    width.yaxis.set_major_locator(LogLocator(subs=(1.0, 3.0) if high < 100 * low else (1.0,), numticks=MOST_TICKS))
    plain_numbers(width.yaxis)
    legend_above(width)
    legend_above(gain, columns=3)
    frequency_axis(width)
    return figure


@styled
@in_float64
def bode_models(
    frequency_response: FrequencyResponse,
    fits: Sequence[Fit],
    *,
    extended: np.ndarray | None = None,
    axes: OnAxes = None,
) -> Figure:
    """A measured response with the models of `fits` (one of each kind), and the residual of each.

    A fit by the paper's method is held against what that method reads: the difference to the *previous* count.
    Where there is an exact fit too, the paper's formula is also drawn with the exact motor: what is left then is not
    the pole's fault, and follows the -ωT/2 of that difference, which the paper's model lacks. `extended` (f,) is the
    response [rad/s/V] of a motor with effects under the very sines of `frequency_response`, NaN where it is not known:
    it depends on the amplitude, so it has residuals but no curve. At most 300 frequencies are drawn.
    """
    figure, axes = panels(4, 5.6, heights=(3, 3, 2, 2.4), axes=axes)
    gain, phase, gain_left, phase_left = axes[:, 0]
    measured, order = _few(in_order(frequency_response)), np.argsort(np.asarray(frequency_response.frequency_Hz))
    frequency = np.asarray(measured.frequency_Hz)
    nyquist_Hz = 0.5 / float(measured.period_s)
    fine = np.geomspace(frequency[0] / 1.15, min(frequency[-1] * 1.15, 0.99 * nyquist_Hz), 200)
    readings = {fit.method: as_paper_reads(measured, fit) if fit.method == "paper" else measured for fit in fits}
    for method, seen in readings.items():
        _draw_points(gain, phase, seen, method, f", {method} reading" if "paper" in readings else "")
    residuals = []
    for fit in fits:
        label, (style, marker) = _name(fit, fits), STYLES[fit.method, fit.motor.order]
        seen = readings[fit.method]
        model = model_response(seen, fit.motor, fit.method, fine)
        gain.plot(fine, decibel(model), label=label, **style)
        phase.plot(fine, degrees(model), label=label, **style)
        residuals.append((seen, model_response(seen, fit.motor, fit.method, frequency), label, style, marker))
    exact = [fit for fit in fits if fit.method == "exact"]
    if exact and "paper" in readings:
        seen = readings["paper"]
        model = model_response(seen, exact[0].motor, "paper", frequency)
        residuals.append((seen, model, "paper model at the exact pole", OTHER, "^"))
    if extended is not None:
        residuals.append((measured, np.asarray(extended)[order][: len(frequency)], "extended model", PAPER, "s"))
    for seen, model, label, style, marker in residuals:
        _draw_residuals((gain_left, phase_left), seen, model, label, style | {"marker": marker})
    for ax in (gain_left, phase_left):
        ax.axhline(0, color=GREY, linewidth=0.6)
    if "paper" in readings:
        lag = -180 * fine * float(measured.period_s)
        (line,) = phase_left.plot(fine, lag, label="\N{MINUS SIGN}ωT/2, the count difference", **REFERENCE)
        phase_left.legend(handles=[line], loc="lower left")
    gain.set_ylabel("Gain\n(dB re 1 rad/s/V)")
    phase.set_ylabel("Phase (degrees)")
    gain_left.set_ylabel("Residual\n(dB)")
    phase_left.set(ylabel="Residual\n(degrees)", xlabel="Frequency (Hz)")
    legend_above(gain, columns=2 if "paper" in readings else 3)
    legend_above(gain_left)
    frequency_axis(phase_left)
    return figure


def _few(measured: FrequencyResponse) -> FrequencyResponse:
    """Its lowest `MOST_FREQUENCIES`."""
    return jax.tree.map(lambda leaf: leaf[:MOST_FREQUENCIES] if np.ndim(leaf) else leaf, measured)


def _name(fit: Fit, fits: Sequence[Fit]) -> str:
    """Of the model of `fit`, for legends: by its method where there are two."""
    kind = fit.method if len({one.method for one in fits}) > 1 or fit.method == "paper" else "linear"
    return f"{kind} model{', second order' if fit.motor.order == 2 else ''}"


def _draw_residuals(
    axes: tuple[Axes, Axes], seen: FrequencyResponse, model: np.ndarray, label: str, style: Style
) -> None:
    """Gain and phase of measured over modelled, with the measurement's 95 % intervals."""
    known = np.isfinite(model)
    ratio, at = np.asarray(seen.response)[known] / model[known], np.asarray(seen.frequency_Hz)[known]
    for (amplitude, rows), fill in zip(by_amplitude(seen), FILLS, strict=False):
        fill = style["color"] if fill == GREY else fill
        drawn = style | {"markerfacecolor": fill, "label": f"{label}{amplitude}", "linewidth": 0.9, "capsize": 2}
        rows = rows[known]
        for ax, value, half in zip(axes, (decibel(ratio), degrees(ratio)), response_band(seen), strict=True):
            ax.errorbar(at[rows], value[rows], half[known][rows], **drawn)


def _draw_points(gain: Axes, phase: Axes, seen: FrequencyResponse, method: str, reading: str) -> None:
    frequency, response, band = np.asarray(seen.frequency_Hz), np.asarray(seen.response), response_band(seen)
    size, markers = (5.5, "sss") if method == "paper" else (3, "o^D")
    for ax, value, half in ((gain, decibel(response), band.gain_dB), (phase, degrees(response), band.phase_deg)):
        for (amplitude, rows), fill, marker in zip(by_amplitude(seen), FILLS, markers, strict=False):
            at, middle, around = frequency[rows], value[rows], half[rows]
            ax.fill_between(at, middle - around, middle + around, **BAND)
            label = f"measured{amplitude}{reading}"
            style = MEASURED | {"marker": marker, "markersize": size, "markerfacecolor": fill}
            ax.plot(at, middle, label=label, **style)


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


def by_amplitude(measured: FrequencyResponse) -> list[tuple[str, np.ndarray]]:
    """A name for legends and the rows (n,) of each amplitude; all under no name where it is one, under the range of
    amplitudes where they are more than `MOST_AMPLITUDES`."""
    amplitude = np.asarray(measured.amplitude_V, dtype=float)
    volts = np.sort(amplitude[np.isfinite(amplitude)])[::-1]
    levels = [one for k, one in enumerate(volts) if k == 0 or one < (1 - SAME_VOLTS) * volts[k - 1]]
    everything = np.ones(len(amplitude), bool)
    if len(levels) < 2 or not np.isfinite(amplitude).all():
        return [("", everything)]
    if len(levels) > MOST_AMPLITUDES:
        return [(f" at {volts[-1]:.3g} to {volts[0]:.3g} V", everything)]
    nearest = np.argmin(np.abs(np.log(amplitude[:, None] / np.array(levels))), axis=1)
    return [(f" at {level:.3g} V", nearest == k) for k, level in enumerate(levels)]


def in_order(measured: FrequencyResponse) -> FrequencyResponse:
    """`measured` as JAX arrays, lowest frequency first."""
    order = np.argsort(np.asarray(measured.frequency_Hz))
    return jax.tree.map(lambda leaf: jnp.asarray(leaf)[order] if np.ndim(leaf) else jnp.asarray(leaf), measured)


def _banded(
    ax: Axes, frequency: np.ndarray, value: np.ndarray, half: np.ndarray, groups: list[tuple[str, np.ndarray]]
) -> None:
    seen = half[np.isfinite(half)].max(initial=0.0) > VISIBLE * np.ptp(value)
    for (name, rows), marker in zip(groups, MARKERS, strict=False):
        at, middle, around = frequency[rows], value[rows], half[rows]
        band = "95 % band" if seen and not ax.collections else None
        ax.fill_between(at, middle - around, middle + around, label=band, **BAND)
        ax.plot(at, middle, color=BLACK, linewidth=0.6)
        style = {**MEASURED, "marker": marker}
        ax.errorbar(at, middle, around, label=f"measured{name}", capsize=2, elinewidth=0.8, **style)
