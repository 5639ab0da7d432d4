"""Whether a log holds the input that was applied until each row, where a recording has the one from it on."""

import dataclasses

import numpy as np

from jaxmotor.diagnosis._solve import Fitted
from jaxmotor.diagnosis._study import study_of
from jaxmotor.recording import Recording, Segment

MUCH = 0.5
"""Of chi2, that the other reading leaves."""


def is_applied_until_row(recording: Recording, fitted: Fitted) -> bool:
    """The motor, fitted again with each input one row earlier, leaves much less over."""
    earlier = dataclasses.replace(recording, segments=tuple(map(_earlier, recording.segments)))
    solver = study_of(earlier, float(fitted.motor.linear.pole)).solver
    if len(solver.cells) != len(fitted.residual):
        return False
    return solver.fit(fitted.motor, fitted).chi2 < MUCH * fitted.chi2


def _earlier(segment: Segment) -> Segment:
    return dataclasses.replace(segment, volts=np.append(segment.volts[1:], segment.volts[-1]))
