"""Logs whose header does not state how their speeds were averaged: the log's own, and no effect of the motor."""

import numpy as np
import pytest
from speed_logs import speed_log

from jaxmotor import diagnose
from jaxmotor.diagnosis import extended_model, to_json


@pytest.mark.parametrize(("seen", "seed"), [("window", 1), ("filter", 2)])
def test_the_average_is_the_logs_and_the_motor_is_complete(seen, seed):
    log = speed_log(np.random.default_rng([5, seed]), seen)
    found = diagnose(log.unstated)
    assert found.verdict == "complete" and not found.effects
    assert found.average is not None and found.average.kind == seen
    stated = found.standard_error
    pole = min(log.pole, 1 / log.length_s) if seen == "filter" else log.pole
    assert abs(float(found.motor.linear.gain) - log.gain) < 3 * stated["gain_rad_s_V"]
    assert abs(float(found.motor.linear.pole) - pole) < 3 * stated["pole_rad_s"] < 0.3 * pole
    assert sum("property of the log" in note for note in found.notes) == 1
    assert not any("it is not known over how long" in note for note in found.notes)
    assert to_json(found)["speed_average"]["kind"] == seen
    assert not extended_model(found).effects and not found.motor.effects and not found.linear.effects
