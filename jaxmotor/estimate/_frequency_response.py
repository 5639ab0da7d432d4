"""Response per frequency, with the uncertainty that travels with it."""

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Complex, Float

from jaxmotor.motor import AbstractLinearMotor, mean_speed_response, readable, speed_response


class FrequencyResponse(eqx.Module):
    """Complex response of the speed to the held voltage, measured frequency by frequency."""

    frequency_Hz: Float[Array, " f"]
    response: Complex[Array, " f"]
    """Speed over voltage [rad/s/V]; of which speed, see `window_s`."""
    covariance: Float[Array, "f 2 2"]
    """Of the real and the imaginary part [(rad/s/V)²]."""
    amplitude_V: Float[Array, " f"]
    """Amplitude of the voltage that it was measured at [V]."""
    period_s: Float[Array, ""]
    window_s: float | None = eqx.field(static=True, default=None)
    """None: V(z), the mean speed over the tick in which the voltage is held, what counts give. Else the mean over
    this long before the tick, 0 being the speed at the tick."""

    __repr__ = readable

    @property
    def standard_error(self) -> Float[Array, " f"]:
        """Root mean square of the two parts' standard errors [rad/s/V]."""
        return jnp.sqrt(jnp.trace(self.covariance, axis1=1, axis2=2) / 2)

    @property
    def gain_standard_error(self) -> Float[Array, " f"]:
        """Of the absolute value, relative to it [1]."""
        return jnp.sqrt(_along(self, self.response)) / jnp.abs(self.response)

    @property
    def phase_standard_error(self) -> Float[Array, " f"]:
        """Of the phase [rad]."""
        return jnp.sqrt(_along(self, 1j * self.response)) / jnp.abs(self.response)

    def of(self, motor: AbstractLinearMotor, frequency_Hz: Float[Array, " g"] | None = None) -> Complex[Array, " g"]:
        """What this measurement would have given for `motor` [rad/s/V], at its own or at other frequencies."""
        frequency = self.frequency_Hz if frequency_Hz is None else frequency_Hz
        if self.window_s is None:
            return mean_speed_response(motor, frequency, self.period_s)
        return speed_response(motor, frequency, self.period_s, self.window_s)


def _along(measured: FrequencyResponse, direction: Complex[Array, " f"]) -> Float[Array, " f"]:
    """Variance [(rad/s/V)²] along `direction` in the complex plane, which need not have unit length."""
    unit = direction / jnp.abs(direction).astype(direction.dtype)
    vector = jnp.stack([unit.real, unit.imag], axis=-1)
    return jnp.einsum("fi,fij,fj->f", vector, measured.covariance, vector)
