"""What was measured, as it stood when the voltage of its row took effect."""

import numpy as np

from jaxmotor.recording._recording import Recording


def at_duty(recording: Recording, column: np.ndarray, time_s: np.ndarray) -> np.ndarray:
    """(n,) `column`, measured at (n,) `time_s` [s], as it was `Recording.duty_delay_s` later, in its unit.

    A board reads its encoder at the tick and sets the duty that much after it, so that between rows the voltage is not
    constant, but between the moments at which duties act it is. x(t + d) = x(t) + d x'(t), with x' from central
    differences: what is left out is d² x''/2, for 40 µs and 10⁴ rad/s² a hundredth of a millirad.
    Where no delay is stated it is `column` itself.
    """
    late = recording.duty_delay_s
    return column + late * np.gradient(column, time_s) if late and len(column) > 1 else column
