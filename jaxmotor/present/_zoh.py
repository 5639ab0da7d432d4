"""The hold and the count difference: what they do to gain and phase (the paper's Fig. 3, and what it left out)."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from matplotlib.figure import Figure

from jaxmotor._arguments import check_positive
from jaxmotor._precision import in_float64
from jaxmotor.motor import AbstractLinearMotor, FirstOrder, mean_speed_response, to_complex, zoh_factor
from jaxmotor.present._style import EXACT, GREY, PAPER, REFERENCE, OnAxes, frequency_axis, legend_above, panels, styled


@styled
@in_float64
def zoh_bode(period_s: float | int, motor: AbstractLinearMotor | None = None, *, axes: OnAxes = None) -> Figure:
    """Gain and phase that sampling with `period_s` [s] adds to a motor: as eq. 4 has it, and exactly.

    The exact curve is z⁻¹V(z)/G(jω): the hold *and* the count difference that the speed is read from. It depends
    little on the motor; without one, it is drawn for a pole of 0.2/T.
    """
    check_positive("period_s", period_s)
    given = FirstOrder(jnp.asarray(1.0), jnp.asarray(0.2 / period_s)) if motor is None else motor
    given = jax.tree.map(jnp.asarray, given)
    rate = 1 / period_s
    hold_Hz = np.geomspace(0.005 * rate, 0.97 * rate, 400)
    exact_Hz = np.geomspace(0.005 * rate, 0.49 * rate, 400)
    hold = np.asarray(zoh_factor(jnp.asarray(hold_Hz), jnp.asarray(period_s)))
    exact = exact_sampling(given, exact_Hz, period_s)
    figure, axes = panels(2, 3.6, axes=axes)
    gain, phase = axes[:, 0]
    gain.plot(hold_Hz, decibel(hold), label="hold alone (eq. 4)", **PAPER)
    gain.plot(exact_Hz, decibel(exact), label="hold and count difference, exact", **EXACT)
    gain.set(ylabel="Gain (dB)", ylim=(-26, 2))
    phase.plot(hold_Hz, degrees(hold), **PAPER)
    phase.plot(exact_Hz, degrees(exact), **EXACT)
    phase.plot(exact_Hz, -360 * exact_Hz * period_s, label="\N{MINUS SIGN}ωT, twice the hold's lag", **REFERENCE)
    phase.set(ylabel="Phase (degrees)", xlabel="Frequency (Hz)", ylim=(-190, 8), yticks=(0, -45, -90, -135, -180))
    phase.legend(loc="lower left")
    frequency_axis(phase)
    for part in (5, 2):
        for ax in (gain, phase):
            ax.axvline(rate / part, color=GREY, linewidth=0.7)
        style = {"xytext": (-2, 3), "textcoords": "offset points", "ha": "right", "fontsize": 7}
        gain.annotate(f"1/({part}T)", (rate / part, -26), **style)
    legend_above(gain)
    return figure


def exact_sampling(motor: AbstractLinearMotor, frequency_Hz: np.ndarray, period_s: float) -> np.ndarray:
    """z⁻¹V(z)/G(jω) [1]: what is read from the counts, over what the motor alone would show."""
    frequency, period = jnp.asarray(frequency_Hz), jnp.asarray(period_s)
    seen, alone = _seen_and_alone(motor, frequency, period)
    return np.asarray(seen) * np.exp(-2j * np.pi * frequency_Hz * period_s) / np.asarray(alone)


@eqx.filter_jit
def _seen_and_alone(motor: AbstractLinearMotor, frequency_Hz: jax.Array, period: jax.Array):
    return mean_speed_response(motor, frequency_Hz, period), motor.transfer(2j * jnp.pi * to_complex(frequency_Hz))


def decibel(response: np.ndarray) -> np.ndarray:
    """20 log10 of the absolute value."""
    return 20 * np.log10(np.abs(response))


def degrees(response: np.ndarray) -> np.ndarray:
    """Phase along the last axis, without jumps of 360 degrees."""
    return np.rad2deg(np.unwrap(np.angle(response)))
