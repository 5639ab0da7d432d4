import jax
import jax.numpy as jnp
import numpy as np
import pytest
from figures import check, labels, line

from jaxmotor.motor import FirstOrder, unmodelled_by_paper, zoh_factor
from jaxmotor.present import zoh_bode

EXACT = "hold and count difference, exact"


def first_order(gain: float, pole: float) -> FirstOrder:
    with jax.enable_x64(True):
        return FirstOrder(jnp.asarray(gain), jnp.asarray(pole))


@pytest.mark.parametrize("period", [0.001, 0.005, 0.02])
def test_the_hold_is_eq_4(period):
    figure = zoh_bode(period)
    check(figure)
    assert labels(figure) == [("", "Gain (dB)"), ("Frequency (Hz)", "Phase (degrees)")]
    curve = line(figure.axes[0], "hold alone (eq. 4)")
    s = 2j * np.pi * curve.get_xdata()
    factor = (1 - np.exp(-s * period)) / (s * period)
    np.testing.assert_allclose(curve.get_ydata(), 20 * np.log10(np.abs(factor)), atol=1e-9)


def test_the_exact_curve_is_the_paper_s_model_times_what_it_lacks():
    motor = first_order(11.0, 40.0)
    curve = line(zoh_bode(0.005, motor).axes[0], EXACT)
    with jax.enable_x64(True):
        frequency, period = jnp.asarray(curve.get_xdata()), jnp.asarray(0.005)
        both = np.asarray(unmodelled_by_paper(motor, frequency, period) * zoh_factor(frequency, period))
    np.testing.assert_allclose(curve.get_ydata(), 20 * np.log10(np.abs(both)), atol=1e-9)


def test_a_slow_motor_shows_the_limit():
    """For a T -> 0 the ratio is exp(-jωT) x/tan x with x = ωT/2."""
    figure = zoh_bode(0.005, first_order(1.0, 1e-4))
    curve = line(figure.axes[0], EXACT)
    x = np.pi * curve.get_xdata() * 0.005
    np.testing.assert_allclose(curve.get_ydata(), 20 * np.log10(x / np.tan(x)), atol=1e-4)
