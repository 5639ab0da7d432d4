"""Counts that are latched a part of a tick before or after the voltage changes, in logs that do not say so."""

import dataclasses

import numpy as np
import pytest
from testing.made import FINE as PARTS
from testing.made import PERIOD, latched

from jaxmotor import identify
from jaxmotor.estimate import to_json
from jaxmotor.prediction import pack

GAIN, POLE = 11.0, 40.0


@pytest.mark.parametrize("parts", [-25, -8, 4, 20])
def test_the_offset_is_found_beside_gain_and_pole(parts):
    fit = identify(latched(parts))
    offset = parts / PARTS * PERIOD
    assert fit.timing is not None
    assert abs(fit.timing.offset_s - offset) < min(1.96 * fit.timing.standard_error_s, 0.02 * PERIOD)
    assert abs(float(fit.motor.gain) - GAIN) < 3 * float(fit.standard_error.gain)
    assert abs(float(fit.motor.pole) - POLE) < 1.96 * float(fit.standard_error.pole) < 0.02 * POLE
    assert fit.chi2_per_sample < 1.05
    [note] = [note for note in fit.notes if "property of the log" in note]
    assert ("after" if parts > 0 else "before") in note and len(note) < 300
    assert to_json(fit)["timing"]["offset_s"] == fit.timing.offset_s


def test_no_offset_is_found_where_there_is_none_or_the_header_states_the_timing():
    assert identify(latched(0)).timing is None
    stated = identify(latched(-5, duty_delay_s=5 / PARTS * PERIOD))
    assert stated.timing is None and stated.chi2_per_sample < 1.05


def test_what_is_more_than_half_a_tick_late_is_a_delay():
    late = latched(-45)
    assert identify(late).timing is None
    segments = tuple(
        dataclasses.replace(segment, volts=np.concatenate([[0.0], segment.volts[:-1]])) for segment in late.segments
    )
    shifted = identify(dataclasses.replace(late, segments=segments))
    assert shifted.timing is not None and shifted.timing.offset_s == pytest.approx(PERIOD / 10, abs=0.02 * PERIOD)


def test_a_row_of_rest_comes_before_a_piece_that_is_driven_at_once():
    made = latched(10)
    plain, rested = (pack(made, (0, 1), rest_before=rest) for rest in (False, True))
    driven = sum(made.segments[index].volts[0] != 0 for index in (0, 1))
    assert rested.batch.reset.sum() == plain.batch.reset.sum()
    assert (rested.segment_of >= 0).sum() == (plain.segment_of >= 0).sum() + driven
    np.testing.assert_array_equal(
        np.sort(rested.batch.observed[rested.batch.valid]), np.sort(plain.batch.observed[plain.batch.valid])
    )
    assert not rested.batch.volts[rested.batch.reset].any() or not driven
