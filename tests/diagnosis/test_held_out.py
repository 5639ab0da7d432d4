"""What an extended motor is worth on data that it was not fitted to, where that is less than nothing."""

import dataclasses

import numpy as np
import pytest
from testing.made import recording, sine, step

from jaxmotor.diagnosis._diagnose import _notes
from jaxmotor.diagnosis._found import Found
from jaxmotor.diagnosis._free import linear_of, with_effect
from jaxmotor.diagnosis._held_out import hold_out
from jaxmotor.diagnosis._split import split
from jaxmotor.diagnosis._study import study_of
from jaxmotor.motor.effects import TransportDelay, VoltageOffset

GAIN, POLE = 11.0, 40.0
RUNS = [sine(f) for f in (0.7, 1.1, 1.9, 2.3, 3.1, 4.3)] + [step(h, 300) for h in (5.1, -4.2, 3.4, -2.7, 2.0, 4.6)]


def held(offset_V: float, offset_of_held_out_V: float):
    """Motors without and with an offset, fitted to the segments that are not held out."""
    there, apart = (recording(0, GAIN, POLE, offset=volts, runs=RUNS) for volts in (offset_V, offset_of_held_out_V))
    out = [part.segment for part in split(there)]
    mixed = tuple((apart if k in out else there).segments[k] for k in range(len(RUNS)))
    study = study_of(dataclasses.replace(there, segments=mixed), POLE)
    linear = study.solver.fit(linear_of(GAIN, POLE))
    fitted = study.solver.fit(with_effect(linear.motor, VoltageOffset.start()))
    return hold_out(study, Found(linear, fitted, (), {}, {}))


@pytest.mark.usefixtures("x64")
def test_an_offset_that_changes_its_sign_does_not_carry_over():
    found = held(0.3, -0.3)
    assert found.after.drift > 2 * found.before.drift > 2
    assert found.is_worse
    assert any(
        "do not carry over" in note for note in _notes((), found, Found(found.linear, found.fitted, (), {}, {}), ())
    )


@pytest.mark.usefixtures("x64")
def test_a_part_of_one_long_segment_knows_what_was_applied_before_it():
    """A voltage that acts rows later was applied in the part that the motor is fitted to."""
    rng = np.random.default_rng(0)
    volts = np.repeat(rng.choice([-5.1, 2.0, 5.1], 150), 9)
    late = recording(0, GAIN, POLE, runs=[("prbs", {}, np.concatenate([np.zeros(3), volts[:-3]]))])
    asked = dataclasses.replace(late.segments[0], volts=volts, duty=None)
    study = study_of(dataclasses.replace(late, segments=(asked,)), POLE)
    linear = study.solver.fit(linear_of(GAIN, POLE))
    fitted = study.solver.fit(with_effect(linear.motor, TransportDelay.of(delay_s=0.012)))
    found = hold_out(study, Found(linear, fitted, (), {}, {}))
    assert found.segments == found.in_part == (0,)
    assert found.after.drift < 1.1 < found.before.drift
    assert len(found.after.traces[0].time_s) == pytest.approx(150 * 9 / 3, abs=2)


@pytest.mark.usefixtures("x64")
def test_an_offset_that_stays_carries_over():
    found = held(0.3, 0.3)
    assert found.after.drift < 1.1 < found.before.drift
    assert not found.is_worse
