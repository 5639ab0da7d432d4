"""Counts that are latched a part of a tick off, in the emulated bench's plant: the log's own, and no effect."""

import functools

import pytest
from timing import late_recording

from jaxmotor import diagnose
from jaxmotor.diagnosis import extended_model, to_json

pytestmark = pytest.mark.usefixtures("plant_library")


@functools.cache
def of(seed):
    recording, truth = late_recording(seed)
    return truth, diagnose(recording)


@pytest.mark.parametrize("seed", [1, 3])
def test_the_offset_is_the_logs_and_the_motor_is_complete(seed):
    truth, found = of(seed)
    assert found.verdict == "complete" and not found.effects
    assert found.timing is not None
    error = abs(found.timing.offset_s - truth.offset_s)
    assert error < min(0.02 * truth.period_s, 1.96 * found.timing.standard_error_s)
    linear, stated = found.motor.linear, found.standard_error
    assert abs(float(linear.gain) - truth.gain) < 1.96 * stated["gain_rad_s_V"]
    assert abs(float(linear.pole) - truth.pole) < 1.96 * stated["pole_rad_s"] < 0.02 * truth.pole
    assert sum("property of the log" in note for note in found.notes) == 1
    assert to_json(found)["timing"]["offset_s"] == found.timing.offset_s
    assert not extended_model(found).effects and not found.motor.effects and not found.linear.effects


def test_an_offset_that_does_not_show_is_within_the_errors():
    """Half a percent of a tick: L/R takes it up, and moves the pole by twenty of the errors that it would have."""
    truth, found = of(9)
    assert not found.effects and found.timing is None
    assert (
        abs(float(found.motor.linear.pole) - truth.pole) < 1.96 * found.standard_error["pole_rad_s"] < 0.01 * truth.pole
    )
    assert found.standard_error["pole_rad_s"] >= float(found.fit.standard_error.pole)
