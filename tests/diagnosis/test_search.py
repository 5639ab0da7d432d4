"""Causes in logs of noisy speeds: a finely integrated motor, its speed averaged over each row, coloured noise on it."""

import dataclasses
import os
from pathlib import Path

import numpy as np
import pytest
from hidden import draw
from real_data import measured
from scipy.signal import lfilter

from jaxmotor import diagnose
from jaxmotor.diagnosis._extension import _without_gone
from jaxmotor.diagnosis._free import linear_of, with_effect
from jaxmotor.diagnosis._json import to_json
from jaxmotor.diagnosis._score_test import candidates, effect_columns
from jaxmotor.diagnosis._search import Search
from jaxmotor.diagnosis._study import study_of
from jaxmotor.diagnosis._trial import rig_of
from jaxmotor.motor.effects import (
    CoulombFriction,
    MissedCounts,
    Rig,
    ShaftCompliance,
    Stiction,
    SupplyDrift,
    TimingOffset,
    TransportDelay,
)
from jaxmotor.recording import Recording, Segment
from jaxmotor.text import sentence

GAIN, POLE = 20.0, 12.0
"""[rad/s/V, rad/s]"""
FRICTION_V, DELAY_S = 0.6, 0.016
PERIOD_S, FINE, ROWS = 0.01, 50, 1200


FAST_RAD_S = 100.0


def noisy_log(
    seed: int, friction_V: float = 0.0, delay_s: float = 0.0, cubic_V: float = 0.0, noise: float = 0.01
) -> Recording:
    """Random voltages, each held for some rows; Euler's method in steps of 0.2 ms. Drag with the cube of the speed
    takes `cubic_V` at `FAST_RAD_S`; `noise` is over the speed's spread."""
    rng = np.random.default_rng(seed)
    lengths = rng.integers(3, 40, ROWS)
    volts = np.concatenate([[0.0], np.repeat(rng.uniform(-5, 5, ROWS), lengths)])[:ROWS]
    step = PERIOD_S / FINE
    applied = np.concatenate([np.zeros(round(delay_s / step)), np.repeat(volts, FINE)])[: ROWS * FINE]
    speed, angle, now = np.zeros(ROWS * FINE), np.zeros(ROWS * FINE + 1), 0.0
    for k, volt in enumerate(applied):
        drive = GAIN * volt
        holds = now == 0.0 and abs(drive) <= GAIN * friction_V
        friction = GAIN * friction_V * (np.sign(now) if now else np.sign(drive))
        drag = GAIN * cubic_V * (now / FAST_RAD_S) ** 3
        new = 0.0 if holds else now + step * POLE * (drive - friction - drag - now)
        now = 0.0 if new * now < 0 and abs(drive) <= GAIN * friction_V else new
        speed[k], angle[k + 1] = now, angle[k] + step * now
    read = np.diff(angle[::FINE], prepend=0.0)[:ROWS] / PERIOD_S
    read = read + noise * read.std() * np.asarray(lfilter([1.0], [1.0, -0.6], rng.standard_normal(ROWS)))
    segment = Segment("other", 0.0, True, {}, np.arange(ROWS) * PERIOD_S, volts, tick=np.arange(ROWS), speed_rad_s=read)
    return Recording((segment,), "noisy", PERIOD_S, speed_window_s=PERIOD_S, supply_V=5.0, duty_delay_s=0.0)


@pytest.fixture(scope="module")
def with_both():
    return diagnose(noisy_log(1, FRICTION_V, DELAY_S))


def test_friction_and_delay_are_named_with_their_probabilities(with_both):
    found = {one.name: one for one in with_both.effects}
    assert set(found) == {"coulomb_friction", "transport_delay"}
    assert with_both.verdict == "extended"
    for one in found.values():
        assert one.probability is not None and one.family_probability is not None
        assert 0.5 < one.probability <= one.family_probability <= 1.0 + 1e-9
    assert found["coulomb_friction"].parameters["volts_V"] == pytest.approx(FRICTION_V, rel=0.02)
    assert found["transport_delay"].parameters["delay_s"] == pytest.approx(DELAY_S, rel=0.02)


def test_gain_and_pole_lie_in_their_intervals(with_both):
    errors, motor = with_both.standard_error, with_both.motor.linear
    assert abs(float(motor.gain) - GAIN) < 3 * errors["gain_rad_s_V"]
    assert abs(float(motor.pole) - POLE) < 3 * errors["pole_rad_s"]


def test_probabilities_are_in_the_json(with_both):
    content = to_json(with_both)
    for effect in content["effects"]:
        assert 0.5 < effect["probability"] <= effect["family_probability"] <= 1.0
        assert content["probabilities"][effect["name"]] == effect["probability"]
    assert content["probabilities"]["none"] < 1e-6


def test_nothing_is_named_where_nothing_is_hidden():
    found = diagnose(noisy_log(2))
    assert found.verdict == "complete"
    assert not found.effects
    assert next(iter(found.probabilities)) == "none"


def of_a_real_motor(name, **asked):
    folder = Path(os.environ.get("JAXMOTOR_DATA", Path(__file__).parents[2] / "../shared/data"))
    if not folder.is_dir():
        pytest.skip(f"no measured logs in {folder}; set JAXMOTOR_DATA to their folder")
    return diagnose(measured(name), **asked)


def test_a_measured_wheel_of_which_no_effect_is_likely_is_explained_as_well_as_by_hand():
    found = of_a_real_motor("wheel/m1", effects=("cubic_drive", "current_limit"))
    # With a current limit, by scipy.
    assert found.whole.after.fit_percent > 94.7 > found.whole.before.fit_percent
    assert found.verdict == "unexplained" and not any(one.is_named for one in found.effects)


def test_a_measured_step_is_explained_as_well_as_by_hand():
    found = of_a_real_motor("brake/step_open")
    # Fitted by scipy: 90.3 % without friction, 97.2 with friction and delay; the motor turns one way.
    assert found.whole.after.fit_percent > 97.1
    [cause] = found.effects
    assert {cause.name, *(one.name for one in cause.alternatives if one.inseparable)} >= {
        "coulomb_friction",
        "voltage_offset",
        "dead_zone",
    }


def test_friction_and_offset_of_a_measured_stage_are_those_published():
    found = of_a_real_motor("emps/position_10ms")
    assert found.verdict == "extended" and found.whole.after.fit_percent > 95.5
    causes = {one.name: one for one in found.effects if one.is_named}
    friction, offset = causes["coulomb_friction"], causes.get("voltage_offset") or causes["load_torque"]
    # 20.39 N, 3.16 N and 203.5 N s/m of a stage of 95.1 kg and a drive of 35.15 N/V, with 1.96 standard errors of ours.
    gain, pole = (float(getattr(found.motor.linear, key)) for key in ("gain", "pole"))
    for own, error, published in (
        (friction.parameters["volts_V"], friction.standard_error["volts_V"], 20.39 / 35.15),
        (abs(offset.parameters["volts_V"]), offset.standard_error["volts_V"], 3.16 / 35.15),
        (gain, found.standard_error["gain_rad_s_V"], 35.15 / 203.5),
        (pole, found.standard_error["pole_rad_s"], 203.5 / 95.1),
    ):
        assert own == pytest.approx(published, rel=0.05) and abs(own - published) < 1.96 * error < 0.25 * published


@pytest.mark.usefixtures("plant_library")
def test_a_dead_zone_beside_stiction_is_found():
    """Alone stiction takes up what the dead zone does, so that scores beside it do not ask for one."""
    found = diagnose(draw(("dead_zone", "stiction"), 3).recording)
    assert {one.name for one in found.effects} == {"dead_zone", "stiction"}
    assert found.verdict == "extended"


@pytest.mark.usefixtures("plant_library")
def test_stiction_of_one_size_stands_for_coulomb_friction_that_is_not_asked_for():
    """Fitted freely its static friction ends a little below the moving one, which no motor has."""
    asked = ["stiction", "dead_zone"]
    log = draw(("coulomb_friction",), 3)
    [effect] = diagnose(log.recording, effects=asked).effects
    assert effect.name == "stiction" and effect.probability > 0.99
    volts, static = (effect.parameters[name] for name in ("volts_V", "static_volts_V"))
    assert volts == static and effect.unknown == ("stribeck_speed_rad_s",)
    assert sentence(effect).startswith("dry friction takes 6")
    found = diagnose(log.recording, effects=[*asked, "coulomb_friction"])
    assert [one.name for one in found.effects] == ["coulomb_friction"]
    assert "stiction" not in found.probabilities


def test_a_rig_without_counts_loses_none():
    recording = noisy_log(3)
    study = study_of(recording, POLE)
    rig = rig_of(recording, study.trial)
    assert not MissedCounts.starts(rig)
    assert MissedCounts.starts(rig._replace(counts=True))


def test_speeds_of_an_encoder_may_lack_counts():
    """Its counts per turn stand in the header; without them the same bend of the speed is a law of the motor."""
    plain = noisy_log(3, FRICTION_V)
    [run] = plain.segments
    speed = run.speed_rad_s
    above = 0.5 * np.abs(speed).max()
    segment = dataclasses.replace(run, speed_rad_s=np.where(np.abs(speed) > above, 0.92 * speed, speed))
    log = dataclasses.replace(plain, segments=(segment,), counts_per_rev=600.0)
    asked = ["missed_counts", "coulomb_friction", "quadratic_drag", "voltage_saturation"]
    lost = {one.name: one for one in diagnose(log, effects=asked).effects if one.is_named}
    assert set(lost) == {"missed_counts", "coulomb_friction"}
    assert lost["missed_counts"].parameters["ratio"] == pytest.approx(0.08, abs=0.01)
    assert lost["missed_counts"].parameters["speed_rad_s"] == pytest.approx(above, rel=0.1)
    unknown = diagnose(dataclasses.replace(log, counts_per_rev=None), effects=asked)
    assert "missed_counts" not in {one.name for one in unknown.effects}


@pytest.mark.parametrize(
    ("effect", "possible"),
    [
        (Stiction.of(volts_V=0.3, static_volts_V=0.2, stribeck_speed_rad_s=1.0), False),
        (Stiction.of(volts_V=0.3, static_volts_V=0.4, stribeck_speed_rad_s=1.0), True),
        (Stiction.of(volts_V=0.1, static_volts_V=0.99, stribeck_speed_rad_s=1.0), True),
        (Stiction.of(volts_V=0.1, static_volts_V=1.01, stribeck_speed_rad_s=1.0), False),
        (Stiction.of(volts_V=0.0, static_volts_V=0.3, stribeck_speed_rad_s=1.0), False),
        (ShaftCompliance.of(frequency_Hz=8.0, damping_ratio=6.4, inertia_ratio=0.3), False),
        (ShaftCompliance.of(frequency_Hz=0.04, damping_ratio=0.5, inertia_ratio=20.0), False),
        (ShaftCompliance.of(frequency_Hz=2.5, damping_ratio=0.05, inertia_ratio=3.0), True),
        (MissedCounts.of(ratio=0.7, speed_rad_s=10.0), False),
        (CoulombFriction.of(volts_V=0.3), True),
        (CoulombFriction.of(volts_V=5.1), False),
        (SupplyDrift.of(rate_per_s=0.97), False),
        (SupplyDrift.of(rate_per_s=0.002), True),
        (SupplyDrift.of(rate_per_s=-0.0016), True),
        (SupplyDrift.of(rate_per_s=-0.0018), False),
    ],
)
def test_impossible_sizes_are_no_causes(effect, possible):
    rig = Rig(5.0, (1.0, 5.0), 100.0, PERIOD_S, 60.0, turns=True)
    assert effect.possible(rig) is possible


def test_weights_of_all_models_sum_to_one(x64):
    recording = noisy_log(2)
    study = study_of(recording, POLE)
    first = linear_of(GAIN, POLE)
    search = Search(study.solver, first, study.solver.fit(first), rig_of(recording, study.trial))
    assert search.visited.weights() == {frozenset(): pytest.approx(1.0)}


@pytest.mark.usefixtures("x64")
def test_what_is_always_tried_is_not_where_the_log_excludes_it():
    """The rows' timing offset and a transport delay are one to a log: no motor has both."""
    study = study_of(noisy_log(2), POLE, timed=True)
    timed = study.solver.fit(with_effect(linear_of(GAIN, POLE), TimingOffset.of(offset_s=0.001)))
    search = Search(study.solver, linear_of(GAIN, POLE), timed, rig_of(study.recording, study.trial))
    ranked = candidates(timed, effect_columns(study.solver, timed, search.rig, search.solver.request.asked()))
    assert "transport_delay" in ranked and "transport_delay" in search.relations.always
    leaders = search._leaders(timed, ranked, 7, search.relations.always)
    assert "transport_delay" not in leaders and "coast_drive" in leaders


@pytest.mark.usefixtures("x64")
def test_beside_others_scores_that_promise_next_to_nothing_do_not_count_where_the_noise_is_unknown():
    study = study_of(noisy_log(1, FRICTION_V), POLE)
    linear = study.solver.fit(linear_of(GAIN, POLE))
    search = Search(study.solver, linear.motor, linear, rig_of(study.recording, study.trial))
    columns = effect_columns(study.solver, linear, search.rig, search.solver.request.asked())
    assert search._promising(linear, candidates(linear, columns)) == set(candidates(linear, columns))
    friction = study.solver.fit(with_effect(linear.motor, CoulombFriction.of(volts_V=FRICTION_V)))
    ranked = candidates(friction, columns)
    promising = search._promising(friction, ranked)
    assert promising == {name for name, its in ranked.items() if its[0].chi2 < 0.98 * friction.chi2} < set(ranked)


@pytest.mark.usefixtures("x64")
def test_an_effect_that_is_next_to_nothing_beside_another_law_goes():
    """A delay that is shorter than any motor's L/R has no size of a cause."""
    study = study_of(noisy_log(1, FRICTION_V), POLE)
    linear = study.solver.fit(linear_of(GAIN, POLE))
    search = Search(study.solver, linear.motor, linear, rig_of(study.recording, study.trial))
    late = study.solver.fit(with_effect(linear.motor, TransportDelay.of(delay_s=0.005)))
    both = study.solver.fit(with_effect(late.motor, CoulombFriction.of(volts_V=FRICTION_V)), late)
    assert float(both.motor.effects[0].delay_s) < TransportDelay.ordinary
    rest = _without_gone(search, late, both)
    assert rest.names == ("coulomb_friction",) and rest.chi2 < 1.02 * both.chi2
    # Of what the base has not nothing goes: such a motor is none.
    assert _without_gone(search, linear, both) is both


@pytest.mark.usefixtures("x64")
def test_further_effects_are_tried_once_beside_what_leaves_least():
    """Whatever its weight: alone half of a pair may predict blocks left out no better than nothing does."""
    recording = noisy_log(2, friction_V=0.3, delay_s=0.02)
    study = study_of(recording, POLE)
    linear = study.solver.fit(linear_of(GAIN, POLE))
    search = Search(study.solver, linear_of(GAIN, POLE), linear, rig_of(recording, study.trial))
    search.extend_least()
    assert set(search.visited.fitted) == {frozenset()}
    starts = (CoulombFriction.start(), TransportDelay.start())
    alone = [study.solver.fit(with_effect(linear.motor, one)) for one in starts]
    search.visited.keep(alone)
    for _ in range(2):
        search.extend_least()
    least, both = min(alone, key=lambda one: one.chi2), frozenset(one.name for one in starts)
    pairs = [names for names in search.visited.fitted if len(names) == 2]
    assert both in pairs and all(least.names[0] in names for names in pairs)
    assert search.visited.fitted[both].chi2 < 0.9 * least.chi2
