"""Logs whose header does not state how their speeds were averaged: the log's own, and no effect of the motor."""

import dataclasses

import numpy as np
import pytest
from scipy.linalg import expm
from speed_logs import speed_log
from test_search import FRICTION_V, GAIN, PERIOD_S, POLE, noisy_log

from jaxmotor import diagnose, identify
from jaxmotor.diagnosis import extended_model, to_json
from jaxmotor.diagnosis._free import linear_of, with_effect
from jaxmotor.diagnosis._relations import Relations
from jaxmotor.diagnosis._request import Request
from jaxmotor.diagnosis._study import study_of
from jaxmotor.diagnosis._trial import rig_of
from jaxmotor.diagnosis._visited import Visited
from jaxmotor.diagnosis._window import beside_window, does_as_well, is_window, window_beside
from jaxmotor.estimate import SpeedAverage, stated
from jaxmotor.motor.effects import CoulombFriction, ElectricalPole, Rig, SpeedWindow, TransportDelay
from jaxmotor.recording import Recording, Segment


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


def averaged(recording, rows):
    """`recording`, of means over a row, as one of means over `rows` rows that does not say so."""
    segment = recording.segments[0]
    speed = np.convolve(segment.speed_rad_s, np.ones(rows) / rows)[: len(segment)]
    return dataclasses.replace(
        recording, segments=(dataclasses.replace(segment, speed_rad_s=speed),), speed_window_s=None
    )


@pytest.mark.usefixtures("x64")
def test_speeds_of_no_window_take_the_programs_of_those_of_one():
    """Where one was sought: compiled once, they serve both, and say the same of a motor."""
    log = dataclasses.replace(noisy_log(3), speed_window_s=None)
    request = Request()
    plain = study_of(log, POLE, request=request)
    motor = with_effect(linear_of(GAIN, POLE), CoulombFriction.of(volts_V=FRICTION_V))
    sought, _ = beside_window(log, plain.solver.fit(motor), None, request)
    after = study_of(log, POLE, request=request)
    assert (plain.trial.problem.kind, after.trial.problem.kind) == ("speed", "window")
    own, its = (study.solver.residual_of(motor, study.solver.starts)[1] for study in (plain, after))
    np.testing.assert_allclose(its, own, rtol=0, atol=1e-9)
    [program] = after.solver._called
    window = with_effect(motor, SpeedWindow.of(length_s=0.03))
    sought.solver.residual_of(window, sought.solver.starts)
    assert program in sought.solver._called
    assert study_of(log, POLE).trial.problem.kind == "speed"


def test_beside_friction_the_average_is_the_logs_and_no_lag_of_the_motor():
    found = diagnose(averaged(noisy_log(3, FRICTION_V), 7))
    [friction] = found.effects
    assert found.verdict == "extended" and friction.name in ("coulomb_friction", "stiction")
    assert friction.parameters["volts_V"] == pytest.approx(FRICTION_V, rel=0.02)
    assert found.average is not None and found.average.kind == "window" and found.average.separable
    assert abs(found.average.length_s - 7 * PERIOD_S) < 3 * found.average.standard_error_s < 0.03 * 7 * PERIOD_S
    assert abs(float(found.motor.linear.gain) - GAIN) < 3 * found.standard_error["gain_rad_s_V"]
    assert abs(float(found.motor.linear.pole) - POLE) < 3 * found.standard_error["pole_rad_s"] < 0.1 * POLE
    assert sum("property of the log" in note for note in found.notes) == 1
    assert not any("it is not known over how long" in note for note in found.notes)


def ramp(seed, friction_V=2.0):
    """3 V/s for 4 s on a motor with friction whose speed ripples as it turns: instantaneous speeds every 1 ms."""
    rng = np.random.default_rng(seed)
    time = 1e-3 * np.arange(4000)
    speed, ripple, shown = 0.0, 0.0, []
    for volts in 3 * time:
        shown.append(max(speed + (ripple if speed > 1 else 0.0), 0.0))
        moves = speed > 0 or volts > friction_V
        speed = max(speed + 1e-3 * 20 * (20 * (volts - friction_V) - speed), 0.0) if moves else 0.0
        ripple = 0.95 * ripple + 1.2 * rng.normal()
    tick = np.arange(len(time))
    segment = Segment("ramp", 0.0, True, {}, time, 3 * time, tick=tick, speed_rad_s=np.array(shown))
    return Recording((segment,), "ramp", 1e-3, speed_window_s=None, supply_V=12.0, duty_delay_s=None)


@pytest.mark.parametrize("seed", [1, 2])
def test_no_average_and_no_current_is_so_slow_that_it_hides_friction(seed):
    """On a ramp readings that are late by a second look like friction, but for the rest before the shaft turns."""
    found = diagnose(ramp(seed))
    assert found.average is None
    [friction] = found.effects
    assert friction.effect.family == "friction" and friction.is_told and friction.of_family > 0.9
    assert friction.parameters["volts_V"] == pytest.approx(2.0, rel=0.15)
    assert float(found.motor.linear.gain) == pytest.approx(20, rel=0.07)
    assert abs(float(found.motor.linear.gain) - 20) < 3 * found.standard_error["gain_rad_s_V"]


def test_no_current_lags_by_a_tenth_of_a_second():
    rig = Rig(12.0, (12.0,), 200.0, 1e-3, 4.0, False)
    assert ElectricalPole.of(time_constant_s=0.05).possible(rig)
    assert not ElectricalPole.of(time_constant_s=0.1).possible(rig)


@pytest.mark.usefixtures("x64")
def test_a_window_is_found_again_beside_the_delay_that_makes_up_for_what_it_lacked():
    log = averaged(noisy_log(4, 0.0), 5)
    short = SpeedAverage("window", 4.2 * PERIOD_S, 0.01 * PERIOD_S, 2.1 * PERIOD_S, 0.0, True, 0.0, 0.0)
    study = study_of(stated(log, short), POLE)
    late = with_effect(linear_of(GAIN, POLE), TransportDelay.of(delay_s=0.3 * PERIOD_S))
    found = study.solver.fit(late)
    assert float(found.motor.effects[0].delay_s) == pytest.approx(0.4 * PERIOD_S, rel=0.3)
    again, moved = window_beside(log, found, short, Request())
    assert moved and abs(again.length_s - 5 * PERIOD_S) < 3 * again.standard_error_s < 0.1 * 5 * PERIOD_S
    study = study_of(stated(log, again), POLE)
    alone, _ = window_beside(log, study.solver.fit(linear_of(GAIN, POLE)), again, Request())
    assert abs(alone.length_s - 5 * PERIOD_S) < 3 * alone.standard_error_s < 0.03 * 5 * PERIOD_S


@pytest.mark.usefixtures("x64")
def test_a_motor_without_a_window_is_seen_at_each_row_beside_motors_with_one():
    log = averaged(noisy_log(5, 0.0), 3)
    study = study_of(log, POLE)
    plain = study.solver.fit(linear_of(GAIN, POLE))
    beside, windowed = beside_window(log, plain, None, Request())
    assert windowed.chi2 < plain.chi2
    seen = [one.solver.residual_of(plain.motor, plain.speeds)[0] for one in (study, beside)]
    np.testing.assert_allclose(seen[1], seen[0], atol=1e-12)
    visited = Visited(windowed, Relations({}), rig_of(log, beside.trial), beside.solver.piece)
    assert is_window(beside, windowed, visited)
    late = with_effect(linear_of(GAIN, POLE), TransportDelay.of(delay_s=PERIOD_S))
    assert does_as_well(beside, windowed, late, visited)
    assert not does_as_well(beside, plain, windowed.motor, visited)


FAST_POLE, SPRING_RAD_S, DAMPING, INERTIA_RATIO = 25.0, 33.0, 0.06, 0.3
"""Of the motor without its load [rad/s]; of the load with the motor held; its inertia over the motor's."""


def springy_log(seed: int, rows: int, size: int = 1200) -> Recording:
    """A load on a spring behind the motor; means over `rows` rows, in a header that does not say so."""
    rng = np.random.default_rng(seed)
    lengths = rng.integers(3, 40, size)
    volts = np.concatenate([[0.0], np.repeat(rng.uniform(-5, 5, size), lengths)])[:size]
    spring, damper = SPRING_RAD_S**2 * INERTIA_RATIO, 2 * DAMPING * SPRING_RAD_S * INERTIA_RATIO
    # Of the motor's speed, the load's, the angle between them, the motor's and the voltage.
    rates = np.array(
        [
            [-FAST_POLE - damper, damper, -spring, 0, GAIN * FAST_POLE],
            [damper / INERTIA_RATIO, -damper / INERTIA_RATIO, spring / INERTIA_RATIO, 0, 0],
            [1, -1, 0, 0, 0],
            [1, 0, 0, 0, 0],
            [0, 0, 0, 0, 0],
        ]
    )
    step, state, angle = expm(rates * PERIOD_S)[:4], np.zeros(4), np.zeros(size + rows)
    for k, volt in enumerate(volts[:-1]):
        state = step @ np.append(state, volt)
        angle[rows + k + 1] = state[3]
    read = (angle[rows:] - angle[:-rows]) / (rows * PERIOD_S)
    read = read + 0.01 * read.std() * rng.standard_normal(size)
    segment = Segment("other", 0.0, True, {}, np.arange(size) * PERIOD_S, volts, tick=np.arange(size), speed_rad_s=read)
    return Recording((segment,), "springy", PERIOD_S, supply_V=5.0)


def test_a_window_beside_a_spring_is_a_window_though_a_linear_motor_shows_a_filter():
    log = springy_log(1, 5)
    alone = identify(log).average
    assert alone is not None and alone.kind == "filter"
    found = diagnose(log, effects=["shaft_compliance", "electrical_pole", "sensor_lag", "transport_delay"])
    [spring] = found.effects
    assert spring.name == "shaft_compliance" and found.verdict == "extended"
    assert spring.parameters["frequency_Hz"] == pytest.approx(SPRING_RAD_S / (2 * np.pi), rel=0.01)
    assert spring.parameters["inertia_ratio"] == pytest.approx(INERTIA_RATIO, rel=0.05)
    assert found.average is not None and found.average.kind == "window"
    assert found.average.length_s == pytest.approx(5 * PERIOD_S, rel=0.02)


def test_windows_longer_than_segments_are_not_tried():
    """The longest window that could be sought would leave no row of these."""
    whole = noisy_log(3, FRICTION_V)
    [run] = whole.segments
    assert run.tick is not None and run.speed_rad_s is not None
    pieces = [slice(begin, begin + 15) for begin in range(0, len(run), 30)]
    segments = tuple(
        Segment(
            "other",
            float(run.time_s[piece.start]),
            False,
            {},
            run.time_s[piece] - run.time_s[piece.start],
            run.volts[piece],
            tick=np.arange(15),
            speed_rad_s=run.speed_rad_s[piece],
        )
        for piece in pieces
    )
    log = dataclasses.replace(whole, segments=segments, speed_window_s=None)
    found = diagnose(log, effects=["coulomb_friction", "stiction", "dead_zone", "transport_delay", "sensor_lag"])
    assert {"coulomb_friction", "stiction"} & {one.name for one in found.effects}
    assert found.average is None or abs(found.average.length_s - PERIOD_S) < 3 * found.average.standard_error_s
