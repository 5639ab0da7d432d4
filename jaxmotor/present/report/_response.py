"""The measured frequency response with its intervals, the models beside it, and their residuals."""

from typing import NamedTuple

import numpy as np

from jaxmotor._precision import in_float64
from jaxmotor.estimate import FrequencyResponse, Trace
from jaxmotor.present._bode import SAME_VOLTS, Band, bode_models, in_order, model_response, response_band
from jaxmotor.present._zoh import degrees
from jaxmotor.present.report._drawing import drawing
from jaxmotor.present.report._html import Content, Html, details, number, paragraph, table
from jaxmotor.present.report._page import figure
from jaxmotor.present.report._story import Story
from jaxmotor.text import plainly

MOST = 300
"""Frequencies that are tabled."""
SETTLED = 5.0
"""Time constants after which a sine has settled."""


class Responses(NamedTuple):
    """Measured and modelled at the measured frequencies, the lowest first."""

    measured: FrequencyResponse
    frequency_Hz: np.ndarray
    response: np.ndarray
    linear: np.ndarray
    """Of the identified motor, exact."""
    extended: np.ndarray | None
    """Of the extended motor under the very sines of the recording; NaN where that is not known."""
    half: Band


def response_section(story: Story) -> Content:
    """Gain and phase against frequency; nothing without sines."""
    found = story.diagnosis.fit.frequency_response
    if found is None:
        return paragraph(
            "The recording has no sines of two frequencies or more, so there is no frequency response. "
            "The motor was identified in the time domain."
        )
    seen = responses(story, found)
    return [
        paragraph(
            "Speed over voltage at each frequency, from the sines alone, with 95 % intervals. The linear model is "
            "exact for a voltage that is held from tick to tick. Its response does not depend on the amplitude of the "
            "voltage; that of a motor with friction does."
        ),
        figure(_drawing(story, seen), _caption(seen)),
        details("The numbers", _table(seen)),
    ]


@in_float64
def responses(story: Story, found: FrequencyResponse) -> Responses:
    """`found` with what the motors of the diagnosis say of it."""
    measured = in_order(found)
    frequency, response = np.asarray(measured.frequency_Hz), np.asarray(measured.response)
    linear = model_response(measured, story.diagnosis.fit.motor, "exact", frequency)
    extended = response * _ratios(story, measured) if story.diagnosis.named else None
    return Responses(measured, frequency, response, linear, extended, response_band(measured))


def _ratios(story: Story, measured: FrequencyResponse) -> np.ndarray:
    """Response of the extended motor over the measured one [1], from both speeds in the same rows of the same sine."""
    frequencies, volts = np.asarray(measured.frequency_Hz), np.asarray(measured.amplitude_V)
    ratios = np.full(len(frequencies), np.nan, complex)
    for trace in story.diagnosis.whole.traces_after:
        segment = story.recording.segments[trace.segment]
        frequency, amplitude = segment.sine_Hz, float(segment.parameters.get("amplitude_V", np.nan))
        if frequency is None:
            continue
        off = np.abs(volts - amplitude) / amplitude
        same = (np.abs(frequencies / frequency - 1) < 1e-6) & (~(off > SAME_VOLTS))
        if same.sum() == 1:
            ratios[same] = _ratio(trace, frequency, float(story.diagnosis.motor.linear.pole))
    return ratios


def _ratio(trace: Trace, frequency_Hz: float, pole_rad_s: float) -> complex:
    """Simulated over measured, at `frequency_Hz`, after the start has died away."""
    rows = trace.time_s > SETTLED / pole_rad_s
    if rows.sum() < 20 or np.ptp(trace.time_s[rows]) < 1 / frequency_Hz:
        return complex(np.nan)
    turn = 2 * np.pi * frequency_Hz * trace.time_s[rows]
    basis = np.stack([np.cos(turn), np.sin(turn), np.ones_like(turn)], axis=1)
    speeds = np.stack([trace.simulated_rad_s[rows], trace.measured_rad_s[rows]], axis=1)
    parts, *_ = np.linalg.lstsq(basis, speeds, rcond=None)
    simulated, measured = parts[0] - 1j * parts[1]
    return complex(simulated / measured) if abs(measured) > 0 else complex(np.nan)


def _drawing(story: Story, seen: Responses) -> Html:
    frequency = seen.frequency_Hz
    alt = (
        f"Bode plot of {len(frequency)} measured frequencies from {frequency[0]:.3g} to {frequency[-1]:.3g} Hz with "
        "the linear model, and below the residuals of the models. The table under it has the numbers."
    )
    drawn = bode_models(seen.measured, [story.diagnosis.fit], extended=seen.extended)
    return drawing(drawn, "response", alt=alt)


def _caption(seen: Responses) -> str:
    text = (
        "Above gain and phase, below their residuals (measured over modelled) with the 95 % interval of the "
        "measurement: where that holds 0 they are noise."
    )
    if seen.extended is not None:
        text += " The extended motor was simulated under the sines that were recorded, at their amplitudes."
    return text


def _table(seen: Responses) -> Content:
    amplitude = np.asarray(seen.measured.amplitude_V)
    gain, phase = np.abs(seen.response), degrees(seen.response)
    relative = seen.half.gain_dB * np.log(10) / 20
    rows = [
        (
            number(frequency, f"frequency_response.frequency_Hz.{k}", f"{frequency:.5g}"),
            plainly(float(amplitude[k])),
            f"{gain[k]:.5g} ± {gain[k] * relative[k]:.2g}",
            f"{phase[k]:.2f} ± {seen.half.phase_deg[k]:.2f}",
            f"{abs(seen.linear[k]):.5g}",
            f"{np.angle(seen.linear[k], deg=True):.2f}",
        )
        for k, frequency in enumerate(seen.frequency_Hz[:MOST].tolist())
    ]
    head = ("Hz", "amplitude (V)", "gain (rad/s/V)", "phase (°)", "linear gain", "linear phase")
    return table("Measured response, ± 95 %, and the linear model's", head, rows)
