"""Rare laws against a fine integration in plain NumPy, and their sizes recovered from recordings of that."""

import math
from collections.abc import Callable
from typing import NamedTuple

import jax
import numpy as np
import pytest
from effect_cases import COUNT, GAIN, PERIOD, POLE, SIZES, SUPPLY, VISCOUS_SHARE, fast_turned, motor, plan, rows, volts
from testing.made import COUNTS, SCALE
from testing.made import plan as runs
from testing.made import sine as sine_run

import jaxmotor as jm
from jaxmotor.diagnosis._errors import covariance
from jaxmotor.diagnosis._free import OWN, linear_of
from jaxmotor.diagnosis._score_test import best_beside
from jaxmotor.diagnosis._solve import Solver
from jaxmotor.diagnosis._trial import rig_of, trial_of
from jaxmotor.motor.effects import (
    DISTURBANCES,
    EFFECTS,
    LONGEST_DELAY_S,
    LogFilter,
    Rig,
    TransportDelay,
    to_free,
)
from jaxmotor.motor.effects._learned import TERMS
from jaxmotor.prediction import PADDED, pack
from jaxmotor.recording import Recording, Segment
from jaxmotor.text import law

FINE = 200
RARE = ("cubic_drive", "dead_time", "cubic_drag", "sector_friction", "warming_friction", "bristle_friction")
TICK_RMS = {
    # counts of a 617/rev encoder, per 5 ms tick in 5 steps; in the comment what was measured
    "cubic_drive": 0.001,  # 0.000002
    "dead_time": 0.001,  # 0.00002
    "cubic_drag": 0.001,  # 0.0001
    "sector_friction": 0.002,  # 0.0006
    "warming_friction": 0.002,  # 0.0003
    "bristle_friction": 0.003,  # 0.0007
}


class Law(NamedTuple):
    """A law's part in the motion: voltage, torque [V] and dry friction [V] of plain numbers."""

    volts: Callable[[float, float], float] = lambda u, back_emf: u
    resists: Callable[[float], float] = lambda w: 0.0
    friction: Callable[[float, float], float] = lambda angle, time: 0.0
    bristle: tuple[float, float] = (0.0, 1.0)
    """v [V] and zs [rad]."""


def across(u, back_emf, loss):
    """The voltage at a winding that loses `loss` against its current; what is less than that drives none."""
    drop = u - back_emf
    return back_emf + math.copysign(max(abs(drop) - loss, 0.0), drop)


def within(angle, centre, width, edge=0.1):
    """1 in the sector, 0 outside, a cubic between."""
    away = abs((angle - centre + math.pi) % (2 * math.pi) - math.pi)
    part = min(max((width / 2 - away) / edge + 0.5, 0.0), 1.0)
    return part * part * (3 - 2 * part)


def law_of(name, **sizes):
    s = SIZES[name] | sizes
    match name:
        case "cubic_drive":
            return Law(volts=lambda u, back_emf: u + s["cubic_1_V2"] * u**3)
        case "dead_time":
            return Law(volts=lambda u, back_emf: across(u, back_emf, s["volts_V"]))
        case "cubic_drag":
            return Law(resists=lambda w: s["volts_V"] * (w / 50) ** 3)
        case "sector_friction":
            return Law(friction=lambda angle, time: s["volts_V"] * within(angle, s["centre_rad"], s["width_rad"]))
        case "warming_friction":
            fades = s["time_constant_s"]
            return Law(friction=lambda angle, time: s["volts_V"] * (1 + s["rise_ratio"] * math.exp(-time / fades)))
    return Law(bristle=(s["volts_V"], s["deflection_rad"]))


def angles_of(law, applied, angle=0.0, begin=0.0, fine=FINE):
    """Angle [rad] at each tick of a motor without lag, from rest: `fine` midpoint steps a tick."""
    step, back, (v, zs) = PERIOD / fine, (1 - VISCOUS_SHARE) / GAIN, law.bristle
    speed, bent, angles = 0.0, 0.0, []

    def rate(u, w, torque):
        q = law.volts(u, back * w) - back * w
        return POLE * (GAIN * (q - torque - law.resists(w)) - VISCOUS_SHARE * w)

    def bends(bent, turn):
        return (bent + (turn - 0.5 * abs(turn) * bent) / zs) / (1 + 0.5 * abs(turn) / zs)

    def moved(u, speed, bent, rub, duration):
        """Speed, and angle turned; friction stops the shaft where its speed is zero, and may let it go on."""
        pull = rate(u, speed, v * bent)
        way = math.copysign(1.0, speed or pull)
        if speed == 0 and abs(pull) <= POLE * GAIN * rub:
            return 0.0, 0.0
        middle = speed + 0.5 * duration * (pull - POLE * GAIN * way * rub)
        half = bends(bent, 0.25 * duration * (speed + middle))
        new = speed + duration * rate(u, middle, v * half + way * rub)
        if rub and new * way < 0:
            share = speed / (speed - new)
            after, turn = moved(u, 0.0, bent, rub, (1 - share) * duration)
            return after, 0.5 * share * duration * speed + turn
        return new, 0.5 * duration * (speed + new)

    for k, u in enumerate(applied):
        angles.append(angle)
        for part in range(fine):
            rub = law.friction(angle, begin + k * PERIOD + part * step)
            speed, turn = moved(u, speed, bent, rub, step)
            angle, bent = angle + turn, bends(bent, turn)
    return np.array(angles)


def difference(name, **sizes):
    """[counts] of each tick."""
    driven = volts(plan())
    expected = np.diff(angles_of(law_of(name, **sizes), driven))
    return (np.asarray(fast_turned(motor(name, first_order=True, **sizes), rows(driven)))[:-1] - expected) / COUNT


@pytest.mark.parametrize("name", RARE)
def test_the_motion_is_that_of_a_fine_integration(name, x64):
    error = difference(name)
    assert np.sqrt(np.mean(error**2)) < TICK_RMS[name]
    assert np.abs(np.cumsum(error)).max() < 0.5


@pytest.mark.parametrize("deflection_rad", [3e-4, 2e-3, 0.2])
def test_bristles_may_be_stiff_or_soft(deflection_rad, x64):
    error = difference("bristle_friction", deflection_rad=deflection_rad)
    assert np.sqrt(np.mean(error**2)) < 0.01
    assert np.abs(np.cumsum(error)).max() < 0.5


def test_bristles_give_way_before_they_slide(x64):
    """Below the friction's voltage the shaft turns by zs ln(1/(1 - u/v)), and comes to rest."""
    driven = rows(np.interp(np.arange(1000), [0, 800, 1000], [0, 0.3, 0.3]))
    turned = float(np.sum(fast_turned(motor("bristle_friction", first_order=True), driven)))
    assert turned == pytest.approx(0.02 * math.log(1 / (1 - 0.3 / 0.4)), rel=0.01)


def test_dead_time_takes_from_the_current_whichever_way_it_flows(x64):
    """Driven and braked at one speed: the loss is against the current, not against the voltage or the speed."""
    at = motor("dead_time", first_order=True)
    loss, back = SIZES["dead_time"]["volts_V"], (1 - VISCOUS_SHARE) / GAIN
    pole = POLE * PERIOD
    turned = np.asarray(fast_turned(at, rows(np.repeat([6.0, 4.0], 400))))
    assert turned[399] / PERIOD == pytest.approx(GAIN * (6.0 - loss), rel=1e-9)
    assert turned[-1] / PERIOD == pytest.approx(GAIN * (4.0 - loss), rel=1e-9)
    # While it brakes from above it goes towards where a loss the other way round would lead.
    final = GAIN * (4.0 + loss)
    kept = (turned[401] / PERIOD - final) / (turned[400] / PERIOD - final)
    assert back * final < back * turned[401] / PERIOD and kept == pytest.approx(math.exp(-pole), rel=1e-9)


RUNS = [*runs(), *(sine_run(f, amplitude=2.0) for f in (0.7037, 1.507, 3.011))]


def recorded(law, fine=40):
    """A recording of `RUNS`; the counter shows the shaft's angle throughout."""
    segments, angle, begin = [], 0.3, 0.0
    for kind, parameters, applied in RUNS:
        angles = angles_of(law, applied, angle, begin, fine)
        tick = np.arange(len(applied))
        # To the nearest: counts that are rounded down would show the angle half a count too small.
        count = np.rint(angles * COUNTS / (2 * np.pi)).astype(np.int64)
        segments.append(Segment(kind, begin, True, parameters, tick * PERIOD, applied, tick=tick, count=count))
        angle, begin = angles[-1], begin + len(applied) * PERIOD + 0.5
    return Recording(tuple(segments), "made.csv", PERIOD, COUNTS, float(SCALE), SUPPLY)


@pytest.mark.parametrize(
    ("name", "sizes"),
    [
        ("cubic_drive", {"cubic_1_V2": -1e-3}),
        ("dead_time", {"volts_V": 0.15}),
        ("cubic_drag", {"volts_V": 0.15}),
        ("sector_friction", {"volts_V": 0.3, "centre_rad": 4.4, "width_rad": 0.9}),
        ("warming_friction", {"volts_V": 0.2, "rise_ratio": 0.6, "time_constant_s": 18.0}),
        ("bristle_friction", {"volts_V": 0.3, "deflection_rad": 0.04}),
    ],
)
def test_a_fit_from_the_best_starts_finds_its_size(name, sizes):
    recording = recorded(law_of(name, **sizes))
    with jax.enable_x64(True):
        solver = Solver(trial_of(recording, pack(recording, tuple(range(len(RUNS))), PADDED), POLE))
        base = solver.fit(linear_of(GAIN, POLE), tolerance=1e-2)
        starts = EFFECTS[name].starts(rig_of(recording, solver.trial))
        ranked = best_beside(solver, base, starts)
        assert len(ranked) == len(starts) and [one.chi2 for one in ranked] == sorted(one.chi2 for one in ranked)
        fitted = min((solver.fit(one.motor) for one in ranked[:2]), key=lambda one: one.chi2)
        true = to_free(EFFECTS[name].of(**sizes))
        error = np.sqrt(np.diag(covariance(fitted, solver.piece))[OWN:])
    assert fitted.chi2 < 1.1 < base.chi2
    np.testing.assert_array_less(np.abs(fitted.free[OWN:] - true), 3.5 * error)
    np.testing.assert_array_less(error, 0.1)


USUAL = ("coulomb_friction", "dead_zone", "voltage_saturation", "cogging")


@pytest.mark.parametrize(
    ("name", "sizes"),
    [
        ("cubic_drive", {"cubic_1_V2": 2e-3}),
        ("sector_friction", {"volts_V": 0.3, "centre_rad": 4.4, "width_rad": 1.0}),
    ],
)
def test_a_diagnosis_names_it_among_others(name, sizes):
    found = jm.diagnose(recorded(law_of(name, **sizes)), effects=[*USUAL, *RARE])
    [effect] = found.effects
    assert (effect.name, found.verdict) == (name, "extended") and effect.probability > 0.9
    for key, value in sizes.items():
        assert abs(effect.parameters[key] - value) < 3.5 * effect.standard_error[key] < 0.2 * abs(value)
    assert found.held_out.after.chi2_per_sample < 1.1


RIG = Rig(6.0, (1.0, 3.0, 6.0), 80.0, PERIOD, 60.0, turns=True)


@pytest.mark.parametrize("name", RARE)
def test_starts_are_possible_on_rigs_of_any_size(name):
    rigs = [RIG, RIG._replace(supply_V=24.0, volts_V=(12.0, 24.0), speed_rad_s=900.0), RIG._replace(speed_rad_s=6.0)]
    for rig in rigs:
        starts = EFFECTS[name].starts(rig)
        assert starts and all(start.possible(rig) for start in starts)
    assert EFFECTS[name].sought_last


def test_where_nothing_can_show_it_a_law_is_not_sought():
    assert not EFFECTS["sector_friction"].starts(RIG._replace(turns=False))
    assert not EFFECTS["warming_friction"].starts(RIG._replace(duration_s=2.0))
    one_size = RIG._replace(volts_V=(6.0,))
    assert not EFFECTS["cubic_drive"].starts(one_size)
    for name in ("dead_zone", "voltage_saturation"):
        assert not EFFECTS[name].starts(one_size) and not EFFECTS[name].of(volts_V=1.0).possible(one_size)


@pytest.mark.parametrize(
    ("name", "sizes"),
    [
        ("cubic_drive", {"cubic_1_V2": -0.02}),
        ("sector_friction", {"width_rad": 6.0}),
        ("warming_friction", {"time_constant_s": 0.1}),
        ("warming_friction", {"time_constant_s": 400.0}),
        ("warming_friction", {"rise_ratio": 8.0}),
        ("bristle_friction", {"deflection_rad": 3.0}),
        ("dead_time", {"volts_V": 6.5}),
        ("encoder_eccentricity", {"amplitude_rad": 0.06, "cycles_per_rev": 5.0}),
        # As fast as a current limit acts.
        ("winding_heating", {"rise_ratio": 2.0, "time_constant_s": 1e-3}),
        # What the winding's own L/R may be.
        ("transport_delay", {"delay_s": 2e-4}),
        ("sensor_lag", {"time_constant_s": 2e-4}),
        ("electrical_pole", {"time_constant_s": 2e-4}),
    ],
)
def test_impossible_sizes_are_no_causes(name, sizes):
    assert not EFFECTS[name].start(**sizes).possible(RIG)


@pytest.mark.parametrize(("name", "speed_rad_s"), [("quadratic_drag", 10.0), ("cubic_drag", 50.0)])
def test_drag_that_leaves_the_back_emf_less_than_a_tenth_is_none(name, speed_rad_s):
    rig = RIG._replace(speed_rad_s=speed_rad_s)
    drag = EFFECTS[name].start(**{"volts_V": 2.0} if name == "cubic_drag" else {"volts_V_s2_rad2": 0.02})
    assert drag.possible(rig) and drag.possible(rig.of(speed_rad_s / 0.25))
    assert not drag.possible(rig.of(speed_rad_s / 0.2))


@pytest.mark.parametrize(
    ("volts_V", "told"),
    [
        (0.3, "takes 300 ± 20 mV at 50 rad/s"),
        (20.0, "takes 20.0 ± 1.3 V at 50 rad/s"),
        (4282.0, "takes 4.28 ± 0.29 V at 5 rad/s"),
        (3e6, "takes 3.00 ± 0.20 V at 0.5 rad/s"),
    ],
)
def test_drag_is_told_at_a_speed_that_the_motor_may_have(volts_V, told):
    drag = EFFECTS["cubic_drag"].of(volts_V=volts_V)
    assert law(drag, {"volts_V": volts_V / 15 / 1.96}).endswith(told)


def test_a_filter_of_the_log_may_be_as_short_as_it_is():
    assert LogFilter.of(time_constant_s=2e-4).possible(RIG)


@pytest.mark.parametrize(("duration_s", "sought"), [(20.0, False), (40.0, False), (200.0, True)])
def test_a_torque_wanders_slowly_however_long_the_log(duration_s, sought):
    starts = DISTURBANCES["wandering_torque"].starts(RIG._replace(duration_s=duration_s))
    assert bool(starts) == sought
    assert all(float(start.reach_s) == duration_s >= 2.0 * TERMS for start in starts)


@pytest.mark.parametrize("period_s", [2e-4, 1e-3, 5e-3, 20e-3])
def test_delays_are_sought_up_to_the_longest(period_s):
    starts = TransportDelay.starts(RIG._replace(period_s=period_s))
    delays = [float(start.delay_s) for start in starts]
    assert delays == sorted(delays) and 0.5 * LONGEST_DELAY_S < delays[-1] < LONGEST_DELAY_S


@pytest.mark.parametrize(("period_s", "longest_s"), [(4e-3, 1.0), (0.1, 4.0)])
def test_no_command_is_as_late_as_a_reading_that_hangs(period_s, longest_s):
    """Twice what is sought, half a second or twenty rows; in a log whose reading hung a fit went on to 7 s."""
    rig = RIG._replace(period_s=period_s)
    assert all(start.possible(rig) for start in TransportDelay.starts(rig))
    assert TransportDelay.of(delay_s=0.99 * longest_s).possible(rig)
    assert not TransportDelay.of(delay_s=1.01 * longest_s).possible(rig)
