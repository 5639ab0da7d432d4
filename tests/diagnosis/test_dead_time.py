"""A dead time of many rows: steps that the motor follows a third of a second late."""

import dataclasses

import numpy as np
import pytest
from testing.made import PERIOD, recording

from jaxmotor.diagnosis import diagnose

ROWS = 66


@pytest.mark.usefixtures("x64")
def test_it_is_found_in_even_rows():
    heights = (5.1, -4.2, 3.4, -2.7, 2.0, 4.6)
    volts = np.repeat(heights, 100)
    late = recording(0, 11.0, 20.0, runs=[("other", {}, np.concatenate([np.zeros(ROWS), volts[:-ROWS]]))])
    asked = dataclasses.replace(late.segments[0], volts=volts, duty=None)
    found = diagnose(
        dataclasses.replace(late, segments=(asked,)), effects=("coulomb_friction", "sensor_lag", "transport_delay")
    )
    [effect] = found.effects
    assert found.verdict == "extended" and effect.name == "transport_delay" and effect.is_named
    assert effect.parameters["delay_s"] == pytest.approx(ROWS * PERIOD, abs=3e-4)
    assert float(found.motor.linear.pole) == pytest.approx(20.0, rel=0.02)
