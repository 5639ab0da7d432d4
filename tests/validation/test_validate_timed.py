"""A recording whose counts were latched a part of a tick off, validated with a motor that knows nothing of it."""

import dataclasses

import numpy as np
import pytest
from testing.made import FINE, PERIOD, latched

from jaxmotor import identify
from jaxmotor.estimate import model_of
from jaxmotor.validation import validate


@pytest.mark.parametrize("parts", [-20, 12])
def test_the_offset_is_fitted_to_the_data_and_said(parts):
    model, other = model_of(identify(latched(0, seed=1))), latched(parts, seed=2)
    found = validate(model, other, simulations=64)
    assert found.open_loop.pooled.chi2_per_sample < 1.05
    [note] = [note for note in found.notes if "rows of this recording are read" in note]
    assert ("after" if parts > 0 else "before") in note
    offset = float(note.split("read ")[1].split(" ms")[0]) * 1e-3
    assert offset == pytest.approx(abs(parts) / FINE * PERIOD, abs=0.02 * PERIOD)
    assert np.mean([step.inside_percent for step in found.steps]) > 85
    stated = validate(model, dataclasses.replace(other, duty_delay_s=0.0), simulations=64)
    assert stated.open_loop.pooled.chi2_per_sample > 1.3
    assert not any("rows of this recording are read" in note for note in stated.notes)


def test_a_recording_that_is_as_it_should_be_has_none():
    found = validate(model_of(identify(latched(0, seed=1))), latched(0, seed=2), simulations=64)
    assert not any("rows of this recording are read" in note for note in found.notes)
