"""The sine fit against the paper's simplex search, and freed of what biases it."""

import dataclasses

import equinox as eqx
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.optimize import minimize
from testing.made import COUNTS, FREQUENCIES, PERIOD, counted, held, motion, plan, recording, sine, step

from jaxmotor.estimate import fit_response
from jaxmotor.estimate._paper import fit_paper, fit_paper_pole
from jaxmotor.estimate._sine_data import sine_data
from jaxmotor.estimate._sine_fit import fit_sines
from jaxmotor.motor import FirstOrder, paper_response

pytestmark = pytest.mark.usefixtures("x64")
TIGHT = {"xatol": 1e-11, "fatol": 1e-13, "maxiter": 4000, "maxfev": 8000}


def response_of(recorded):
    data = sine_data(recorded, tuple(range(len(recorded.segments))))
    return eqx.filter_jit(fit_sines)(data)[0]


def true_motor(gain=11.0, pole=40.0):
    return FirstOrder(jnp.asarray(gain), jnp.asarray(pole))


def relative_error(response, motor=None):
    return np.abs(np.asarray(response.response / response.of(motor or true_motor())) - 1)


def noise_free(runs, speeds=None, offset=0.0):
    """Exact angles as a log of `angle_rad`, each run starting at its speed."""
    made = counted([np.zeros(len(run[2])) for run in runs], runs, np.random.default_rng(0))
    speeds = speeds or [0.0] * len(runs)
    segments = []
    for segment, (_, _, volts), speed in zip(made.segments, runs, speeds, strict=True):
        turn = motion(volts + offset, 11.0, 40.0, speed=speed)[1]
        angle = np.concatenate([[0.0], np.cumsum(turn)[:-1]])
        segments.append(dataclasses.replace(segment, count=None, angle_rad=angle, at_rest=speed == 0.0))
    return dataclasses.replace(made, segments=tuple(segments), counts_per_rev=None)


def test_it_is_the_simplex_searchs_answer_at_every_frequency():
    """Amplitude and phase of eq. 12-14 from scipy's Nelder-Mead, on the paper's own speed and cost."""
    recorded = recording(0)
    response = fit_paper(recorded, tuple(range(len(recorded.segments)))).response
    for index in range(len(FREQUENCIES)):
        segment = recorded.segments[index]
        speed = np.diff(segment.count) * 2 * np.pi / (COUNTS * PERIOD)
        time = np.arange(1, len(segment)) * PERIOD
        omega = 2 * np.pi * segment.parameters["frequency_Hz"]

        def cost(x, omega=omega, time=time, speed=speed):
            return np.sum((speed - x[0] * np.sin(omega * time + x[1])) ** 2)

        start = minimize(cost, [40.0, -1.0], method="Nelder-Mead", options=TIGHT).x
        amplitude, phase = minimize(cost, start, method="Nelder-Mead", options=TIGHT).x
        ours = complex(response.response[index]) * 5.1
        assert abs(ours) == pytest.approx(abs(amplitude), rel=1e-6)
        turn = np.angle(ours / (amplitude * np.exp(1j * phase)))
        assert abs(turn) < 1e-6


def test_the_papers_pole_is_the_simplex_searchs_answer():
    recorded = recording(1)
    fit = fit_paper(recorded, tuple(range(len(recorded.segments))))
    measured, frequency = np.asarray(fit.response.response), np.asarray(fit.response.frequency_Hz)
    gain, s = float(fit.motor.gain), 2j * np.pi * frequency

    def cost(x):
        model = gain * x[0] / (s + x[0]) * (1 - np.exp(-s * PERIOD)) / (s * PERIOD)
        in_dB = 20 * np.log10(np.abs(measured)) - 20 * np.log10(np.abs(model))
        return np.sum(in_dB**2 + np.rad2deg(np.angle(measured / model)) ** 2)

    expected = minimize(cost, [40.0], method="Nelder-Mead", options=TIGHT).x[0]
    assert float(fit.motor.pole) == pytest.approx(expected, rel=1e-6)


def test_the_papers_gain_is_the_steady_speed_over_the_nominal_voltage():
    recorded = recording(2, runs=[sine(1.003), sine(5.017), step(5.1, 400)])
    fit = fit_paper(recorded, (0, 1, 2))
    assert float(fit.motor.gain) == pytest.approx(11.0 * held(5.1) / 5.1, rel=1e-4)


def test_the_papers_method_is_biased_as_published():
    """-17 % in the pole: the difference to the previous count is half a tick later than its model."""
    recorded = recording(3)
    fit = fit_paper(recorded, tuple(range(len(recorded.segments))))
    assert -0.21 < float(fit.motor.pole) / 40.0 - 1 < -0.13


def test_a_perfect_response_gives_the_papers_fit_the_true_pole():
    frequency = jnp.asarray(FREQUENCIES)
    response = dataclasses.replace(
        response_of(recording(0)),
        response=paper_response(true_motor(), frequency, jnp.asarray(PERIOD)),
        window_s=PERIOD,
    )
    pole, _ = fit_paper_pole(response, jnp.asarray(11.0), jnp.asarray(15.0))
    assert float(pole) == pytest.approx(40.0, rel=1e-8)


def test_nothing_has_to_die_out_first():
    """Start-up transient, a start at speed, a drift from an offset, and duty steps: none biases the response."""
    runs = [sine(f, ticks) for f, ticks in zip(FREQUENCIES, (800, 700, 650, 800, 500, 400, 300, 230), strict=True)]
    still = response_of(noise_free(runs))
    assert relative_error(still).max() < 2e-5
    moving = response_of(noise_free(runs, speeds=[30.0, -20.0, 5.0, 0.0, 50.0, -50.0, 1.0, 9.0], offset=0.05))
    assert relative_error(moving).max() < 5e-5


def test_lost_ticks_bias_nothing():
    recorded = noise_free([sine(f) for f in FREQUENCIES])
    rng = np.random.default_rng(5)
    segments = []
    for segment in recorded.segments:
        kept = np.sort(rng.permutation(800)[:740])
        kept = kept[(kept < 300) | (kept > 340)]
        kept = np.union1d([0], kept)
        columns = {name: getattr(segment, name)[kept] for name in ("time_s", "volts", "tick", "angle_rad")}
        segments.append(dataclasses.replace(segment, **columns))
    gappy = dataclasses.replace(recorded, segments=tuple(segments))
    assert relative_error(response_of(gappy)).max() < 1e-3


@pytest.mark.parametrize("window", [PERIOD, 0.0])
def test_logged_speeds_give_the_same_response(window):
    made = recording(0)
    segments = []
    for segment in made.segments:
        at, turn = motion(segment.volts, 11.0, 40.0)
        mean = np.concatenate([[0.0], turn[:-1]]) / PERIOD
        segments.append(dataclasses.replace(segment, count=None, speed_rad_s=mean if window else at))
    logged = dataclasses.replace(made, segments=tuple(segments), speed_window_s=window, counts_per_rev=None)
    response = response_of(logged)
    assert response.window_s == (None if window else 0.0)
    assert relative_error(response).max() < 1e-4


def test_the_covariance_is_the_scatter():
    """Whitened errors of real and imaginary part have variance one over frequencies and seeds."""
    scores = []
    for seed in range(12):
        response = response_of(recording(100 + seed))
        error = np.asarray(response.response - response.of(true_motor()))
        white = np.linalg.inv(np.linalg.cholesky(response.covariance))
        scores.append(np.einsum("fij,fj->fi", white, np.stack([error.real, error.imag], axis=-1)))
    assert 0.85 < np.std(scores) < 1.15
    assert abs(np.mean(scores)) < 0.25


@pytest.mark.parametrize("gain, pole", [(11.0, 40.0), (-7.0, 5.0), (2.0, 250.0)])
def test_the_response_fit_recovers_the_motor(gain, pole):
    fit = fit_response(response_of(recording(7, gain=gain, pole=pole)))
    assert bool(fit.solved)
    errors = np.array([float(fit.motor.gain) / gain - 1, np.log(float(fit.motor.pole) / pole)])
    assert (np.abs(errors) < 4 * np.sqrt(np.diag(fit.covariance))).all()
    assert (np.abs(errors) < 2e-3).all()


def test_short_recordings_of_few_periods_are_fitted():
    recorded = recording(8, runs=[sine(f, ticks=460) for f in (1.003, 3.011, 8.027)] + plan()[-2:])
    assert relative_error(response_of(recorded)).max() < 3e-3
