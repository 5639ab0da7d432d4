"""The paper's eq. 10: may the electrical time constant be neglected?"""

import math

from jaxmotor._errors import JaxmotorError
from jaxmotor.estimate._sine_data import sine_segments
from jaxmotor.recording import Recording

PAPER_TOP_HZ = 50.0
"""The highest frequency the paper considers, a quarter of its sampling rate."""


def electrical_check(recording: Recording, resistance_ohm: float, inductance_H: float) -> str:
    """A sentence on 2πf L/R for measured R [ohm] and L [H], at the recording's highest test frequency."""
    for name, value in (("resistance", resistance_ohm), ("inductance", inductance_H)):
        if not (math.isfinite(value) and value > 0):
            raise JaxmotorError(f"the {name} is {value:g}; a measured one is positive")
    tau = inductance_H / resistance_ohm
    frequency, share = electrical_share(recording, tau)
    verdict = "may be neglected" if share < 0.05 else "should not be neglected: try --model second"
    return (
        f"measured L/R is {1e3 * tau:.3g} ms: 2 pi f L/R (eq. 10) is {share:.3g} at {frequency:g} Hz, a phase of "
        f"{math.degrees(math.atan(share)):.2g} degrees; it {verdict}"
    )


def electrical_share(recording: Recording, tau_s: float) -> tuple[float, float]:
    """The recording's highest test frequency [Hz], 50 Hz where there are no sines, and 2πf τ there [1]."""
    sines = sine_segments(recording, tuple(range(len(recording.segments))))
    frequencies = [recording.segments[index].sine_Hz or 0.0 for index in sines]
    frequency = max(frequencies, default=PAPER_TOP_HZ)
    return frequency, 2 * math.pi * frequency * tau_s
