"""Motors with effects, against the emulated bench's plant with the same effects in it, and against linear motors."""

import dataclasses
import functools
import json

import jax
import numpy as np
import pytest
from hidden import draw
from rigs import Rig, closed_loop, model, open_loop, recording, step

from jaxmotor._precision import in_float64, to_numpy
from jaxmotor.cli import main
from jaxmotor.estimate import Joint, Model, model_to_json, read_model
from jaxmotor.motor import EFFECTS, linear_motor
from jaxmotor.motor.effects import parameters
from jaxmotor.recording import write
from jaxmotor.validation import draw_motors, validate

ELSEWHERE = 1.3
"""By which the zero of the model's angle is another than the recording's [rad]."""
NEUTRAL = {"dead_zone": {"volts_V": 0.0}}


@in_float64
def effect_of(name, **values):
    return to_numpy(EFFECTS[name].of(**values))


@in_float64
def true_model(hidden):
    """The plant's own motor, as known as a diagnosis would know it."""
    effects = []
    for name, sizes in hidden.truth.items():
        turned = {"phase_rad": sizes["phase_rad"] + ELSEWHERE} if "phase_rad" in sizes else {}
        effects.append(effect_of(name, **sizes | turned))
    errors = tuple({name: 0.002 * abs(float(getattr(one, name))) for name in parameters(one)} for one in effects)
    values = np.array([hidden.gain, hidden.pole, hidden.electrical_time_constant])
    return Model(
        linear_motor(values.tolist()),
        np.diag((1e-3 * values) ** 2),
        0.0,
        hidden.recording.period_s,
        "other.csv",
        frozenset({"other"}),
        "true.json",
        tuple(effects),
        errors,
        viscous_share=hidden.viscous_share,
    )


def without_effects(known):
    return dataclasses.replace(known, effects=(), effect_errors=())


@functools.cache
def of_plant(kind):
    """A motor of the plant, what ran of its loop as its header has it, and both validations."""
    hidden = draw((kind,), 7)
    held = tuple(first_reference(one, hidden.recording.period_s) for one in hidden.recording.segments)
    rec = dataclasses.replace(hidden.recording, segments=held)
    known = true_model(hidden)
    return rec, known, *(validate(one, rec, simulations=64) for one in (known, without_effects(known)))


def first_reference(segment, period):
    """A closed loop as long as its reference is the header's; the rig's is a square."""
    if segment.kind != "closed_loop":
        return segment
    rows = int(segment.parameters["half_period_s"] / period)
    names = ("time_s", "volts", "tick", "duty", "count")
    return dataclasses.replace(segment, **{name: getattr(segment, name)[:rows] for name in names})


KINDS = ("coulomb_friction", "coast_drive", "winding_heating", "encoder_eccentricity")


@pytest.mark.usefixtures("plant_library")
@pytest.mark.parametrize("kind", KINDS)
def test_the_extended_motor_reaches_the_floor_where_the_linear_one_does_not(kind):
    _, _, extended, linear = of_plant(kind)
    assert 0.9 < extended.open_loop.pooled.chi2_per_sample < 1.06
    assert linear.open_loop.pooled.chi2_per_sample > 1.9
    inside = np.mean([steps.inside_percent for steps in extended.steps])
    assert inside > 88 and inside > np.mean([steps.inside_percent for steps in linear.steps]) + 5
    [loop] = extended.closed_loop
    assert loop.speed_inside_percent > 95 and loop.volts_inside_percent > 95


@pytest.mark.usefixtures("plant_library")
def test_the_loop_knows_the_friction():
    _, known, extended, linear = of_plant("coulomb_friction")
    [loop], [without] = extended.closed_loop, linear.closed_loop
    assert loop.steady_error_rad_s.inside
    assert loop.rise_time_s.inside and not without.rise_time_s.inside
    assert loop.volts_inside_percent > without.volts_inside_percent + 30
    assert extended.model is known


@pytest.mark.usefixtures("plant_library")
def test_another_zero_of_the_angle_is_found_and_said():
    rec, known, extended, _ = of_plant("encoder_eccentricity")
    assert any("encoder_eccentricity stands in this recording's angle is fitted" in note for note in extended.notes)
    # Counts that begin anew say nothing of the shaft.
    lost = validate(known, dataclasses.replace(rec, count_resets=True), simulations=64)
    assert any("it is left out" in note for note in lost.notes)
    assert lost.open_loop.pooled.chi2_per_sample > 1.9


@pytest.mark.usefixtures("plant_library")
def test_a_segment_that_begins_in_motion_begins_at_its_speed():
    rec, known, _, _ = of_plant("coulomb_friction")
    index = next(k for k, one in enumerate(rec.segments) if one.kind == "sine")
    names = ("time_s", "volts", "tick", "duty", "count")
    whole = rec.segments[index]
    later = dataclasses.replace(whole, at_rest=False, **{name: getattr(whole, name)[101:] for name in names})
    score = validate(known, dataclasses.replace(rec, segments=(later,)), simulations=64).open_loop
    assert score.initial_speed_estimated == (0,)
    assert score.pooled.chi2_per_sample < 1.1


@pytest.mark.usefixtures("plant_library")
def test_the_command_reads_what_a_diagnosis_writes(tmp_path, capsys, monkeypatch):
    monkeypatch.setenv("JAXMOTOR_CACHE", "")
    rec, known, extended, _ = of_plant("coulomb_friction")
    write(rec, tmp_path / "rec.csv")
    (tmp_path / "m-extended.json").write_text(json.dumps(model_to_json(known)))
    read = read_model(tmp_path / "m-extended.json")
    assert read.viscous_share == known.viscous_share and float(read.whole.viscous_share) == known.viscous_share
    arguments = ["validate", str(tmp_path / "m-extended.json"), str(tmp_path / "rec.csv")]
    assert main([*arguments, "--json"]) == 0
    content = json.loads(capsys.readouterr().out)
    assert [effect["name"] for effect in content["effects"]] == ["coulomb_friction"]
    chi2 = content["open_loop"]["pooled"]["chi2_per_sample"]
    assert chi2 == pytest.approx(extended.open_loop.pooled.chi2_per_sample, rel=1e-6)
    assert main(arguments) == 0
    text = capsys.readouterr().out
    volts = 1e3 * float(known.effects[0].volts_V)
    assert f"with coulomb_friction: dry friction takes {volts:.1f} ± {0.00392 * volts:.1f} mV" in " ".join(text.split())
    assert "steady error of the linear part of" in text
    assert max(map(len, text.splitlines())) <= 120


def as_speeds(rec, window):
    """`rec` as a log of speeds, each the mean over `window` ticks before its row, and no encoder.

    Without a window the header says that they are those at the tick.
    """
    segments = []
    for one in rec.segments:
        turned = (one.count - one.count[0]) / rec.counts_per_rev * 2 * np.pi
        ticks = max(window, 1)
        before = np.maximum(np.arange(len(turned)) - ticks, 0)
        speed = (turned - turned[before]) / (ticks * rec.period_s)
        segments.append(dataclasses.replace(one, speed_rad_s=speed, count=None))
    changes = {"counts_per_rev": None, "speed_window_s": window * rec.period_s}
    return dataclasses.replace(rec, segments=tuple(segments), **changes)


@pytest.mark.parametrize("window", [None, 0, 1, 3])
def test_an_effect_that_does_nothing_changes_nothing(window):
    runs = [open_loop(Rig(encoder=c), step(5.1)) for c in (0.1, 0.6)]
    moving = open_loop(Rig(speed=40.0), step(3.3), at_rest=False)
    rec = recording(*runs, moving, closed_loop(Rig(), 150, 37.7, 0.4, 2.0))
    rec = rec if window is None else as_speeds(rec, window)
    plain = model(tau=0.0005)
    neutral = dataclasses.replace(plain, effects=tuple(effect_of(name, **of) for name, of in NEUTRAL.items()))
    one, other = (validate(each, rec, simulations=64) for each in (plain, neutral))
    for first, second in zip(one.open_loop.traces, other.open_loop.traces, strict=True):
        np.testing.assert_allclose(second.simulated_rad_s, first.simulated_rad_s, rtol=1e-7, atol=1e-7)
    for first, second in zip(one.steps, other.steps, strict=True):
        np.testing.assert_allclose(second.predicted.mean, first.predicted.mean, rtol=1e-7, atol=1e-7)
    [first], [second] = one.closed_loop, other.closed_loop
    np.testing.assert_allclose(second.speed.mean, first.speed.mean, rtol=1e-7, atol=1e-7)
    np.testing.assert_allclose(second.volts.mean, first.volts.mean, rtol=1e-7, atol=1e-7)


@in_float64
def test_motors_are_drawn_as_their_errors_say():
    known = dataclasses.replace(
        model(),
        effects=(effect_of("coulomb_friction", volts_V=0.3), effect_of("load_torque", volts_V=-0.1)),
        effect_errors=({"volts_V": 0.01}, {"volts_V": float("nan")}),
        offset_V=0.02,
    )
    drawn = draw_motors(known, 4000, jax.random.key(0))
    friction, load, offset = (np.asarray(effect.volts_V) for effect in drawn.effects)
    assert friction[0] == 0.3 and float(drawn.linear.gain[0]) == 11.0
    assert friction[1:].std() == pytest.approx(0.01, rel=0.05)
    assert np.asarray(drawn.linear.pole).std() == pytest.approx(0.05, rel=0.05)
    assert (load == -0.1).all() and (offset == 0.02).all()


def known_together(correlation):
    """A gain and a friction whose errors go together."""
    known = dataclasses.replace(
        model(errors=(0.3, 0.05)),
        effects=(effect_of("coulomb_friction", volts_V=1.0),),
        effect_errors=({"volts_V": 0.1},),
    )
    covariance = np.diag(np.square([0.3, 0.05, 0.1]))
    covariance[0, 2] = covariance[2, 0] = correlation * 0.3 * 0.1
    names = ("gain_rad_s_V", "pole_rad_s", "coulomb_friction.volts_V")
    return known, dataclasses.replace(known, joint=Joint(names, covariance))


@in_float64
def test_what_is_known_together_is_drawn_together():
    alone, together = (draw_motors(each, 4000, jax.random.key(0)) for each in known_together(0.98))
    for drawn, correlation in ((alone, 0.0), (together, 0.98)):
        gain, friction = np.asarray(drawn.linear.gain), np.asarray(drawn.effects[0].volts_V)
        assert gain[0] == 11.0 and friction[0] == 1.0
        assert gain.std() == pytest.approx(0.3, rel=0.05)
        # Drawn in the logarithm: 1 V times exp(N(0, 0.1)).
        logarithm = np.log(friction[1:])
        assert logarithm.std() == pytest.approx(0.1, rel=0.05)
        assert np.corrcoef(gain[1:], logarithm)[0, 1] == pytest.approx(correlation, abs=0.05)
    less = draw_motors(dataclasses.replace(known_together(0.98)[1], effects=()), 4000, jax.random.key(0))
    assert less.effects == () and np.asarray(less.linear.gain).std() == pytest.approx(0.3, rel=0.05)


def test_bands_hold_what_goes_together():
    """The speed K (u - v) is known better than gain and friction where their errors make up for each other."""
    rec = recording(open_loop(Rig(encoder=0.1), step(5.1)), closed_loop(Rig(), 150, 37.7, 0.4))
    widths = []
    for correlation in (0.98, -0.98):
        alone, together = known_together(correlation)
        for known in (alone, together):
            result = validate(known, rec, simulations=256)
            [loop], [steps] = result.closed_loop, result.steps
            bands = (steps.final_speed_rad_s.predicted, loop.steady_error_rad_s.predicted)
            widths.append([band.high - band.low for band in bands])
    (alone, helped), (same, hurt) = np.array(widths).reshape(2, 2, 2)
    np.testing.assert_allclose(alone, same, rtol=1e-9)
    volts = round(5.1 / 7.4 * 255) / 255 * 7.4
    parts = np.array([0.3 * (volts - 1.0), 11.0 * 0.1])
    said = [3.92 * np.sqrt(parts @ parts - 2 * rho * parts.prod()) for rho in (0.98, 0.0, -0.98)]
    assert [helped[0], alone[0], hurt[0]] == pytest.approx(said, rel=0.2)
    assert helped[1] < 0.8 * alone[1] < 0.8 * hurt[1]
