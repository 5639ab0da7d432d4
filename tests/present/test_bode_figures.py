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
