"""A log whose rows hold the input that was applied until them is told from one whose motor is late."""

import jax
import numpy as np
import pytest
from diagnosed import GAIN, MADE, POLE, hidden

from jaxmotor.diagnosis._free import linear_of
from jaxmotor.diagnosis._input_convention import is_applied_until_row
from jaxmotor.diagnosis._study import study_of

LOGS = {
    "early": lambda: hidden(0, lambda volts, time: np.append(volts[1:], volts[-1])),
    "as it was": MADE["clean"],
    "late": MADE["delay"],
}


@pytest.mark.parametrize(("name", "early"), [("early", True), ("as it was", False), ("late", False)])
def test_only_a_shaft_that_moves_before_it_is_driven_is_early(name, early):
    recording = LOGS[name]()
    with jax.enable_x64(True):
        study = study_of(recording, POLE)
        linear = study.solver.fit(linear_of(GAIN, POLE))
        assert is_applied_until_row(study, linear) is early
