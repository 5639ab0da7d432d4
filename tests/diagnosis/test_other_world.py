"""The second plant against closed forms, and a seeded small part of `benchmarks/other_world.py`."""

import dataclasses

import numpy as np
import pytest
from _calibration import is_found
from second_world import LEVEL, Asked, draw_questions, linear_angle
from testing.second_laws import VOCABULARY, with_laws
from testing.second_motors import draw_rig
from testing.second_plant import STEP_S, Motion, Plant, Schedule, simulate

from jaxmotor import diagnose

PLANT = Plant(
    resistance_ohm=2.4,
    inductance_H=5e-4,
    constant_V_s=0.49,
    inertia_kg_m2=2.5e-3,
    viscous_N_m_s=4e-3,
    supply_V=12.0,
)
FRICTION = 0.05
COUNT = 2 * np.pi / 8400
"""Finer than any encoder of the data sheets [rad]."""


def schedule(changes: dict[float, float], seconds: float, period_s: float = STEP_S) -> Schedule:
    """Read every `period_s`; volts from times on."""
    every = round(period_s / STEP_S)
    at = every * np.arange(round(seconds / period_s) + 1)
    volts = np.zeros(len(at))
    for time, value in changes.items():
        volts[at * STEP_S >= time - 1e-9] = value
    return Schedule(at, volts, np.ones(len(at), bool), np.zeros(len(at)))


def of(plant: Plant, plan: Schedule, **more: float) -> Motion:
    return simulate([plant], [plan], **more)[0]


def integral(values: np.ndarray) -> float:
    """By Simpson's rule over steps, of an even number of them."""
    return float(STEP_S / 3 * (values[0] + 4 * values[1:-1:2].sum() + 2 * values[2:-1:2].sum() + values[-1]))


def test_the_linear_motor_is_the_exact_hold():
    plan = schedule({0.01: 9.0, 0.4: -4.0, 0.7: 0.0, 0.9: 11.0}, 1.5, 0.005)
    motion = of(PLANT, plan)
    assert np.abs(motion.angle - linear_angle(PLANT, plan)).max() < 1e-3 * COUNT
    # The exact hold itself ends at the data sheet's speed.
    assert motion.speed[-1] == pytest.approx(11 * PLANT.gain, rel=1e-5)


@pytest.mark.parametrize("friction", [0.0, FRICTION])
def test_coasting_ends_when_friction_says(friction):
    """With an open bridge J w' = -b w - F: w falls to 0 at (J/b) ln(1 + b w0/F), after an angle that is known too."""
    plant = dataclasses.replace(PLANT, coast=1.0, friction_N_m=friction)
    plan = schedule({0.0: 8.0, 0.6: 0.0}, 2.4)
    motion = of(plant, plan)
    inertia, viscous = plant.inertia_kg_m2, plant.viscous_N_m_s
    begin = np.searchsorted(plan.at * STEP_S, 0.6 - 1e-9)
    time, speed = (plan.at[begin:] - plan.at[begin]) * STEP_S, motion.speed[begin]
    stop = inertia / viscous * np.log1p(viscous * speed / friction) if friction else np.inf
    assert stop < 1.5 or not friction
    rolling = np.minimum(time, stop)
    decay = np.exp(-viscous / inertia * rolling)
    drag = friction / viscous
    expected = (speed + drag) * inertia / viscous * (1 - decay) - drag * rolling
    assert np.abs(motion.shaft[begin:] - motion.shaft[begin] - expected).max() < 1e-3 * COUNT
    assert not friction or np.all(motion.speed[begin:][time > stop + STEP_S] == 0)


def test_energy_is_kept():
    """What the bridge gives is heat, friction, drag, and what the inertia and the inductance hold."""
    # A slow current, which Simpson's rule over steps can follow.
    laws = {"friction_N_m": FRICTION, "drag_N_m_s2": 2e-4, "detent_N_m": 0.02, "detent_cycles": 5.0}
    plant = dataclasses.replace(PLANT, inductance_H=8e-3, **laws)
    plan = schedule({0.0: 10.0}, 0.6)
    motion = of(plant, plan)
    speed, current = motion.speed, motion.current
    given = integral(10.0 * current)
    lost = integral(
        plant.resistance_ohm * current**2
        + plant.viscous_N_m_s * speed**2
        + plant.drag_N_m_s2 * np.abs(speed) ** 3
        + FRICTION * np.abs(speed)
    )
    turned = 5.0 * motion.shaft[-1]
    held = 0.5 * (plant.inductance_H * current[-1] ** 2 + plant.inertia_kg_m2 * speed[-1] ** 2)
    assert given == pytest.approx(lost + held + plant.detent_N_m / 5.0 * (1 - np.cos(turned)), rel=2e-5)


def test_a_rotor_that_friction_holds_stays():
    plant = dataclasses.replace(PLANT, friction_N_m=FRICTION, static_N_m=2 * FRICTION, stribeck_rad_s=0.02)
    holds = 2 * FRICTION / plant.per_volt
    assert np.all(of(plant, schedule({0.1: 0.99 * holds}, 0.5)).shaft == 0)
    assert of(plant, schedule({0.1: 1.01 * holds}, 0.5)).shaft[-1] > 0.05
    # It stops below what would hold it: the moving friction is half.
    slows = of(plant, schedule({0.1: 1.5 * holds, 0.6: 0.6 * holds}, 1.6))
    assert slows.speed[-1] == pytest.approx(0.1 * holds * plant.gain, rel=0.03)


def test_a_load_behind_a_spring_swings_as_it_must():
    """Of a free rotor: at sqrt(k (1/J + 1/J2))."""
    spring = {"load_kg_m2": 1e-3, "spring_N_m_rad": 4.0, "damper_N_m_s": 0.0}
    plant = dataclasses.replace(PLANT, viscous_N_m_s=0.0, coast=1.0, **spring)
    motion = of(plant, schedule({0.0: 6.0, 0.05: 0.0}, 1.05))
    swing = motion.speed[251:] - motion.speed[251:].mean()
    crossings = np.flatnonzero((swing[1:] > 0) & (swing[:-1] <= 0))
    share = swing[crossings] / (swing[crossings] - swing[crossings + 1])
    period = np.diff(crossings + share).mean() * STEP_S
    natural = np.sqrt(4.0 * (1 / plant.inertia_kg_m2 + 1 / 1e-3))
    assert 2 * np.pi / period == pytest.approx(natural, rel=1e-4)


def test_smaller_steps_change_nothing():
    """Of each effect; a gap's contacts are the roughest."""
    rng = np.random.default_rng(3)
    rig = draw_rig(rng)
    plants = [with_laws(rig, (kind,), 60.0, rng) for kind in VOCABULARY]
    volts = rig.supply_V * np.array([0.6, -0.9, 0.2, 0.0])
    plan = schedule(dict(zip(0.01 + 0.1 * np.arange(4), volts, strict=True)), 0.4, 0.01)
    whole = simulate(plants, [plan] * len(plants))
    finer = simulate(plants, [plan] * len(plants), step_s=STEP_S / 4)
    for kind, one, other in zip(VOCABULARY, whole, finer, strict=True):
        away = np.abs(one.angle - other.angle).max()
        assert away < (1 if kind == "backlash" else 0.1) * COUNT, kind


@pytest.fixture(scope="module")
def questions():
    asked = [Asked(kinds, 1, seconds=15.0) for kinds in ((), ("coulomb_friction",), ("gain_jump",))]
    return draw_questions(asked)


def test_nothing_is_named_where_nothing_is_hidden(questions):
    found = diagnose(questions[0].recording)
    assert found.verdict == "complete" and not found.effects
    assert found.whole.drift_after == pytest.approx(1, abs=0.06)
    assert float(found.motor.linear.gain) == pytest.approx(questions[0].plant.gain, rel=1e-4)
    assert float(found.motor.linear.pole) == pytest.approx(questions[0].plant.pole, rel=3e-3)


def test_friction_is_named_with_its_size(questions):
    question = questions[1]
    found = diagnose(question.recording)
    assert question.significance[0] > LEVEL and is_found(question, found) and found.verdict == "extended"
    volts = question.plant.friction_N_m / question.plant.per_volt
    assert found.effects[0].parameters["volts_V"] == pytest.approx(volts, rel=5e-3)


def test_a_law_of_no_effect_is_unexplained(questions):
    assert questions[2].outside and not questions[2].truth
    assert diagnose(questions[2].recording).verdict == "unexplained"
