"""What an extended motor is worth on data that it was not fitted to, where that is less than nothing."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest
from testing.made import recording, sine, step

from jaxmotor.diagnosis._diagnose import _notes
from jaxmotor.diagnosis._errors import covariance
from jaxmotor.diagnosis._explain import _Searched, _validated
from jaxmotor.diagnosis._found import Found, Named
from jaxmotor.diagnosis._free import linear_of, with_effect
from jaxmotor.diagnosis._held_out import hold_out
from jaxmotor.diagnosis._solve import Fitted
from jaxmotor.diagnosis._split import split
from jaxmotor.diagnosis._study import Study, study_of
from jaxmotor.diagnosis._weighed import found_effects
from jaxmotor.motor.effects import BUILT_IN, LoadTorque, TransportDelay, VoltageOffset

GAIN, POLE = 11.0, 40.0
RUNS = [sine(f) for f in (0.7, 1.1, 1.9, 2.3, 3.1, 4.3)] + [step(h, 300) for h in (5.1, -4.2, 3.4, -2.7, 2.0, 4.6)]


def mixed(offset_V: float, offset_of_held_out_V: float):
    """A study of a motor whose offset is another one in the segments that are held out, and its linear motor."""
    there, apart = (recording(0, GAIN, POLE, offset=volts, runs=RUNS) for volts in (offset_V, offset_of_held_out_V))
    out = [part.segment for part in split(there)]
    segments = tuple((apart if k in out else there).segments[k] for k in range(len(RUNS)))
    study = study_of(dataclasses.replace(there, segments=segments), POLE)
    return study, study.solver.fit(linear_of(GAIN, POLE))


def held(offset_V: float, offset_of_held_out_V: float):
    """Motors without and with an offset, fitted to the segments that are not held out."""
    study, linear = mixed(offset_V, offset_of_held_out_V)
    fitted = study.solver.fit(with_effect(linear.motor, VoltageOffset.start()))
    return hold_out(study, Found(linear, fitted, (), {}, {}))


def taken(study: Study, first: Fitted, weight: dict[Fitted, float]) -> Fitted:
    """Of motors of these weights, where the search has found the `first` one."""
    fitted = {frozenset(one.names): one for one in weight}
    weights = {frozenset(one.names): own for one, own in weight.items()}
    linear = fitted[frozenset()]
    named = tuple(Named(name, (), 1.0, 1.0, frozenset(), 0.0, 1.0) for name in first.names)
    visited = SimpleNamespace(fitted=fitted, weights=lambda: weights)
    at = SimpleNamespace(visited=visited, found_at=lambda one: Found(linear, one, (), {}, {}))
    known = _Searched(None, study, at, Found(linear, first, named, {}, {}), None)  # pyright: ignore[reportArgumentType]
    return _validated(known)[0].found.fitted


@pytest.mark.usefixtures("x64")
def test_an_offset_that_changes_its_sign_does_not_carry_over():
    found = held(0.3, -0.3)
    assert found.after.drift > 2 * found.before.drift > 2
    assert found.is_worse
    assert any(
        "do not carry over" in note for note in _notes((), found, Found(found.linear, found.fitted, (), {}, {}), ())
    )


@pytest.mark.usefixtures("x64")
@pytest.mark.parametrize("other", [-0.3, 0.3])
def test_an_effect_without_which_held_out_rows_are_predicted_better_is_not_named(other):
    found = held(0.3, other)
    sure = Named("voltage_offset", (), 1.0, 1.0, frozenset(), 0.0, 1.0)
    named = Found(found.linear, found.fitted, (sure,), {}, {"direction": 1.0})
    [effect] = found_effects(found.study, found, named, covariance(found.fitted, found.train.block))
    assert effect.is_named == effect.is_told == (not found.is_worse) == (other > 0)
    assert effect.probability == effect.family_probability == effect.of_family == (other > 0)


@pytest.mark.usefixtures("x64")
def test_of_motors_about_as_likely_the_one_that_predicts_held_out_rows_best_is_taken():
    """Only where the likeliest predicts them worse than the linear one does."""
    study, linear = mixed(0.3, -0.3)
    worse, offset_once = (
        study.solver.fit(with_effect(linear.motor, one)) for one in (VoltageOffset.start(), LoadTorque.start())
    )
    lag = study.solver.fit(with_effect(linear.motor, TransportDelay.start()))
    held = hold_out(study, Found(linear, worse, (), {}, {}))
    drifts = {one: held.drift(one.motor, one) for one in (worse, offset_once, lag)}
    assert held.is_worse and drifts[lag] < held.before.drift < drifts[offset_once]

    assert taken(study, worse, {linear: 0.0, worse: 0.6, offset_once: 0.3, lag: 0.1}) is lag
    assert taken(study, worse, {linear: 0.0, worse: 0.6, offset_once: 0.39, lag: 0.01}) is worse
    assert taken(study, linear, {linear: 0.6, offset_once: 0.3, lag: 0.1}) is linear


@pytest.mark.usefixtures("x64")
@pytest.mark.parametrize(("offset_V", "weight", "carries"), [(0.3, 0.1, True), (0.3, 0.01, False), (-0.3, 0.1, False)])
def test_where_no_effect_is_likely_one_that_carries_over_makes_the_motor_better(offset_V, weight, carries):
    study, linear = mixed(0.3, offset_V)
    offset = study.solver.fit(with_effect(linear.motor, VoltageOffset.start()))
    assert taken(study, linear, {linear: 0.9, offset: weight}) is (offset if carries else linear)


@pytest.mark.usefixtures("x64")
def test_where_no_effect_is_likely_a_disturbance_is_no_part_of_the_motor():
    study, linear = mixed(0.3, 0.3)
    # From before the first row on it is an offset.
    begun = with_effect(linear.motor, BUILT_IN["load_step"].start().but(moment_s=0.0))
    disturbed = study.solver.fit(begun)
    assert disturbed.chi2 < 0.5 * linear.chi2
    assert taken(study, linear, {linear: 0.6, disturbed: 0.4}) is linear


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
