import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from figures import bands, check, labels, line

from jaxmotor.estimate import FrequencyResponse
from jaxmotor.motor import SecondOrder, mean_speed_response, paper_response, unmodelled_by_paper
from jaxmotor.present import bode, bode_models


def dB(response) -> np.ndarray:
    return 20 * np.log10(np.abs(np.asarray(response)))


def turned(response) -> np.ndarray:
    return np.rad2deg(np.unwrap(np.angle(np.asarray(response))))


def exactly(function, motor, frequency_Hz):
    with jax.enable_x64(True):
        motor = jax.tree.map(jnp.asarray, motor)
        return np.asarray(function(motor, jnp.asarray(frequency_Hz), jnp.asarray(0.005)))


def test_bode_shows_the_measured_numbers(exact):
    measured = exact.frequency_response
    figure = bode(measured)
    check(figure)
    assert labels(figure) == [
        ("", "Gain (dB re 1 rad/s/V)"),
        ("", "Phase (degrees)"),
        ("Frequency (Hz)", "Half-width (95 %)"),
    ]
    gain, phase, _ = figure.axes
    for ax, values in ((gain, dB(measured.response)), (phase, turned(measured.response))):
        (points,) = [each for each in ax.get_lines() if each.get_marker() == "o"]
        np.testing.assert_allclose(points.get_xdata(), measured.frequency_Hz)
        np.testing.assert_allclose(points.get_ydata(), values)


def test_bands_are_the_covariance_s(exact):
    measured = exact.frequency_response
    response, covariance = np.asarray(measured.response), np.asarray(measured.covariance)
    # d log V = dV/V: its real part is the relative gain, its imaginary part the phase.
    turn = (
        np.stack([np.stack([response.real, response.imag], -1), np.stack([-response.imag, response.real], -1)], -2)
        / (np.abs(response) ** 2)[:, None, None]
    )
    errors = np.sqrt(np.einsum("fij,fjk,fik->fi", turn, covariance, turn))
    half = 1.96 * errors * np.array([20 / np.log(10), 180 / np.pi])
    gain, phase, width = bode(measured).axes
    np.testing.assert_allclose(line(width, "gain (dB)").get_ydata(), half[:, 0], rtol=1e-9)
    np.testing.assert_allclose(line(width, "phase (degrees)").get_ydata(), half[:, 1], rtol=1e-9)
    np.testing.assert_allclose(np.diff(bands(gain)[0], axis=1)[:, 0], 2 * half[:, 0], rtol=1e-6)
    np.testing.assert_allclose(np.diff(bands(phase)[0], axis=1)[:, 0], 2 * half[:, 1], rtol=1e-6)


def test_frequencies_may_come_in_any_order(exact):
    measured = exact.frequency_response
    order = np.array([3, 0, 5, 1, 4, 2])
    mixed = jax.tree.map(lambda leaf: leaf[order] if np.ndim(leaf) else leaf, measured)
    for one, other in zip(bode(measured).axes, bode(mixed).axes, strict=True):
        for a, b in zip(one.get_lines(), other.get_lines(), strict=True):
            np.testing.assert_array_equal(a.get_xydata(), b.get_xydata())


def test_models_and_what_they_leave(exact, paper):
    measured = exact.frequency_response
    figure = bode_models(measured, [exact, paper])
    check(figure)
    assert labels(figure) == [
        ("", "Gain (dB re 1 rad/s/V)"),
        ("", "Phase (degrees)"),
        ("", "Residual (dB)"),
        ("Frequency (Hz)", "Residual (degrees)"),
    ]
    gain, phase, _, _ = figure.axes
    for name, function, fit in (
        ("exact model", mean_speed_response, exact),
        ("paper model", paper_response, paper),
    ):
        curve = line(gain, name)
        model = exactly(function, fit.motor, curve.get_xdata())
        np.testing.assert_allclose(curve.get_ydata(), dB(model), atol=1e-9)
        np.testing.assert_allclose(line(phase, name).get_ydata(), turned(model), atol=1e-9)
    for method, fit in (("exact", exact), ("paper", paper)):
        points = line(phase, f"measured, {method} reading")
        np.testing.assert_allclose(points.get_ydata(), turned(fit.frequency_response.response))


def left(ax, label: str) -> np.ndarray:
    (container,) = [each for each in ax.containers if each.get_label() == label]
    return np.asarray(container.lines[0].get_ydata())


def test_the_paper_s_extra_delay_is_the_count_difference(exact, paper):
    """What is left at the exact pole is what the theory says, and follows -ωT/2.

    To a degree with the paper's own sine fits, which take the start of these short sines for sine.
    """
    *_, gain_left, phase_left = bode_models(exact.frequency_response, [exact, paper]).axes
    frequency = np.asarray(exact.frequency_response.frequency_Hz)
    theory = exactly(unmodelled_by_paper, exact.motor, frequency)
    label = "paper model at the exact pole"
    np.testing.assert_allclose(left(phase_left, label), turned(theory), atol=0.8)
    np.testing.assert_allclose(left(phase_left, label), -180 * frequency * 0.005, atol=0.8)
    assert abs(left(phase_left, label)[-1]) > 8
    without_start = dataclasses.replace(paper, frequency_response=None)
    phase = bode_models(exact.frequency_response, [exact, without_start]).axes[-1]
    np.testing.assert_allclose(left(phase, label), turned(theory), atol=0.05)
    reference = [each for each in phase_left.get_lines() if "ωT/2" in str(each.get_label())]
    np.testing.assert_allclose(reference[0].get_ydata(), -180 * np.asarray(reference[0].get_xdata()) * 0.005)
    assert np.abs(left(phase_left, "exact model")).max() < 0.1
    assert np.abs(left(gain_left, "exact model")).max() < 0.02
    assert np.abs(left(phase_left, "paper model")).max() > 1


def test_one_exact_fit_needs_no_reference(exact):
    figure = bode_models(exact.frequency_response, [exact])
    check(figure)
    assert not any("ωT/2" in str(each.get_label()) for each in figure.axes[-1].get_lines())


def test_first_and_second_order_are_told_apart(exact):
    with jax.enable_x64(True):
        second = SecondOrder(*map(jnp.asarray, (exact.motor.gain, exact.motor.pole, 0.0005)))
    figure = bode_models(exact.frequency_response, [exact, dataclasses.replace(exact, motor=second)])
    check(figure)
    assert line(figure.axes[0], "linear model, second order") is not None
    assert line(figure.axes[0], "linear model") is not None


@pytest.mark.parametrize("window", [None, 0.005])
def test_a_paper_fit_without_its_own_response(exact, paper, window):
    """Then the measured response is turned by z⁻¹, unless it was read from the previous count already."""
    with jax.enable_x64(True):
        measured = jax.tree.map(jnp.asarray, exact.frequency_response)
    fields = {name: getattr(measured, name) for name in measured.__dataclass_fields__} | {"window_s": window}
    measured = FrequencyResponse(**fields)
    figure = bode_models(measured, [dataclasses.replace(paper, frequency_response=None)])
    check(figure)
    late = 0 if window else -360 * np.asarray(measured.frequency_Hz) * 0.005
    shown = line(figure.axes[1], "measured, paper reading").get_ydata()
    np.testing.assert_allclose(shown, turned(measured.response) + late, atol=1e-9)


def changed(measured: FrequencyResponse, **fields) -> FrequencyResponse:
    """`measured` as JAX arrays, with these fields."""
    with jax.enable_x64(True):
        measured = jax.tree.map(jnp.asarray, measured)
        return dataclasses.replace(measured, **{name: jnp.asarray(value) for name, value in fields.items()})


def two_amplitudes(measured: FrequencyResponse) -> FrequencyResponse:
    """Every frequency at 5.1 V, and with 1 dB less gain at 1.7 V."""
    names = ("frequency_Hz", "response", "covariance")
    fields = {name: np.concatenate([np.asarray(getattr(measured, name))] * 2) for name in names}
    size = len(measured.frequency_Hz)
    fields["response"][size:] *= 10 ** (-1 / 20)
    return changed(measured, **fields, amplitude_V=np.repeat([5.1, 1.7], size))


def test_amplitudes_are_told_apart_in_every_panel(exact):
    measured = two_amplitudes(exact.frequency_response)
    model = np.asarray(measured.response) * np.where(np.asarray(measured.amplitude_V) > 3, 10**0.01, np.nan)
    figure = bode_models(measured, [exact], extended=model)
    check(figure)
    gain, _, gain_left, phase_left = figure.axes
    both = ("at 5.1 V", "at 1.7 V")
    assert [text.get_text() for text in gain.get_legend().get_texts()] == [
        *(f"measured {volts}" for volts in both), "linear model",
    ]  # fmt: skip
    names = [f"{kind} model {volts}" for kind in ("linear", "extended") for volts in both]
    assert [text.get_text() for text in gain_left.get_legend().get_texts()] == names
    np.testing.assert_allclose(left(gain_left, names[2]), -0.2, atol=1e-9)
    np.testing.assert_allclose(left(phase_left, names[2]), 0.0, atol=1e-9)
    assert not len(left(gain_left, names[3])), "where the extended motor is not known there is no residual"
    np.testing.assert_allclose(left(gain_left, names[1]), left(gain_left, names[0]) - 1, atol=1e-9)
    fills = {each.lines[0].get_markerfacecolor() for each in gain_left.containers[:2]}
    assert len(fills) == 2


def test_a_band_that_cannot_be_seen_has_no_entry(exact):
    wide = changed(exact.frequency_response, covariance=1e6 * np.asarray(exact.frequency_response.covariance))
    for measured, entry in ((exact.frequency_response, []), (wide, ["95 % band"])):
        legend = bode(measured).axes[0].get_legend()
        assert [text.get_text() for text in legend.get_texts()] == [*entry, "measured"]


def test_the_lowest_panel_has_room_for_its_numbers(exact):
    response = exact.frequency_response
    steep = np.geomspace(1, 1e10, len(response.frequency_Hz))[:, None, None]
    for factor in (1.0, steep):
        width = bode(changed(response, covariance=np.asarray(response.covariance) * factor)).axes[2]
        low, high = width.get_ylim()
        shown = [tick for tick in width.get_yticks() if low <= tick <= high]
        assert 2 <= len(shown) <= 5
