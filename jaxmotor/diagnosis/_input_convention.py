"""Whether a log holds the input that was applied until each row, where a recording has the one from it on."""

import dataclasses

import numpy as np

from jaxmotor.diagnosis._request import Request
from jaxmotor.diagnosis._solve import Fitted
from jaxmotor.diagnosis._study import Study, study_of
from jaxmotor.recording import Segment

MUCH = 0.5
"""Of chi2, that the other reading leaves."""


def is_applied_until_row(study: Study, fitted: Fitted) -> bool:
    """The motor, fitted again with each input one row earlier, leaves much less over, in the same noise."""
    recording, noise, much = study.recording, study.packed.observation.noise, MUCH * fitted.chi2
    earlier = dataclasses.replace(recording, segments=tuple(map(_earlier, recording.segments)))
    request = Request()
    request.seeks_window = study.solver.request.seeks_window
    solver = study_of(earlier, study.pole_rad_s, study.timed, request, noise).solver
    if len(solver.cells) != len(fitted.residual):
        return False
    return solver.fit(fitted.motor, fitted, bar=much).chi2 < much


def _earlier(segment: Segment) -> Segment:
    return dataclasses.replace(segment, volts=np.append(segment.volts[1:], segment.volts[-1]))
