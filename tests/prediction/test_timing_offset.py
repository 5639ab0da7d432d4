"""Readings off the moments at which voltages change, against the same motion in exact parts of a row."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxmotor.motor import FirstOrder, Motor, Rows, SecondOrder, SpeedLaw, SpeedLoop, simulate, simulate_motor
from jaxmotor.motor.effects import EFFECTS, TimingOffset
from jaxmotor.prediction import Reading, as_problem, observe, pack
from jaxmotor.recording import Recording, Segment

PERIOD, PARTS, ROWS = 0.01, 100, 60
RESET = (np.arange(ROWS) == 0) | (np.arange(ROWS) == 25)
VOLTS = np.random.default_rng(0).normal(size=ROWS)


@pytest.fixture(autouse=True)
def double():
    with jax.enable_x64(True):
        yield


def motor(order):
    own = (jnp.asarray(10.0), jnp.asarray(30.0))
    return FirstOrder(*own) if order == 1 else SecondOrder(*own, jnp.asarray(3e-3))


def fine(order, parts):
    """Angle turned and speed of each row that is read `parts` of it after its voltage changes, of two experiments."""
    turn, speed = np.zeros(ROWS), np.zeros(ROWS)
    for rows in (slice(0, 25), slice(25, ROWS)):
        number = (rows.stop - rows.start) * PARTS
        at = np.arange(number) + parts
        volts = np.where(at < 0, 0.0, VOLTS[rows][np.clip(at // PARTS, 0, rows.stop - rows.start - 1)])
        begins = np.arange(number) == 0
        moved = simulate(motor(order), *map(jnp.asarray, (volts, begins, np.zeros(number), PERIOD / PARTS)))
        turn[rows] = np.asarray(moved.turn).reshape(-1, PARTS).sum(1)
        speed[rows] = np.asarray(moved.speed)[::PARTS]
    return turn, speed


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("parts", [-99, -30, 0, 1, 50])
@pytest.mark.parametrize("uneven", [False, True])
def test_both_simulations_are_exact(order, parts, uneven):
    turn, speed = fine(order, parts)
    offset = parts / PARTS * PERIOD
    duration = jnp.full(ROWS, PERIOD) if uneven else jnp.asarray(PERIOD)
    still = jnp.zeros(ROWS)
    linear = simulate(motor(order), jnp.asarray(VOLTS), jnp.asarray(RESET), still, duration, jnp.asarray(-offset))
    # The last row of an experiment goes on under its own voltage, whatever comes after it.
    np.testing.assert_allclose(linear.turn, turn, atol=1e-10)
    np.testing.assert_allclose(linear.speed, speed, atol=1e-8)
    whole = Motor(motor(order), (TimingOffset.of(offset_s=offset),))
    rows = Rows(jnp.asarray(VOLTS), jnp.asarray(RESET), still, jnp.asarray(np.arange(ROWS) * PERIOD))
    run = simulate_motor(whole, rows, duration, jnp.asarray(7.4))
    np.testing.assert_allclose(run.sensed_turn, turn, atol=1e-10)
    np.testing.assert_allclose(run.sensed_speed, speed, atol=1e-8)


@pytest.mark.parametrize("parts", [-40, 25])
def test_mean_speeds_end_where_rows_are_read(parts):
    """Over two and a half rows, which begin within a row and on the other side of its change of voltage."""
    window = 2.3 * PERIOD
    log = Segment("other", 0.0, True, {}, np.arange(25) * PERIOD, VOLTS[:25], speed_rad_s=np.arange(25.0))
    problem = as_problem(pack(Recording((log,), "made.csv", period_s=PERIOD, speed_window_s=window), (0,)))
    batch = problem.batch
    late = jnp.asarray(-parts / PARTS * PERIOD)
    seen = (
        observe(motor(2), problem, jnp.asarray(batch.volts), jnp.zeros(batch.volts.shape), Reading(late, None))
        * problem.unit
    )
    at = np.arange(25 * PARTS) + parts
    volts = np.where(at < 0, 0.0, VOLTS[np.clip(at // PARTS, 0, 24)])
    begins = np.arange(len(volts)) == 0
    moved = simulate(motor(2), *map(jnp.asarray, (volts, begins, np.zeros(len(volts)), PERIOD / PARTS)))
    angle = np.concatenate([[0.0], np.cumsum(moved.turn)])
    back = round(window / PERIOD * PARTS)
    expected = [(angle[k * PARTS] - angle[k * PARTS - back]) / window for k in range(3, 25)]
    np.testing.assert_allclose(np.asarray(seen)[0, 3:25], expected, atol=1e-9)


@pytest.mark.parametrize("late_rows", [-0.4, 0.3])
@pytest.mark.parametrize("kind", ["turn", "speed"])
def test_in_uneven_rows_two_lags_are_a_motor_of_second_order(kind, late_rows):
    """Their closed form against the motor's own, in pieces that begin in motion and with fast and slow poles."""
    rng = np.random.default_rng(4)
    time = np.cumsum(rng.uniform(0.3, 1.7, ROWS)) * PERIOD
    read = {"count": rng.integers(0, 9, ROWS)} if kind == "turn" else {"speed_rad_s": rng.normal(size=ROWS)}
    log = Segment("prbs", 0.0, False, {}, time - time[0], VOLTS, **read)
    window = {} if kind == "turn" else {"speed_window_s": 0.0}
    recording = Recording((log,), "made.csv", counts_per_rev=100.0 if kind == "turn" else None, **window)
    problem = as_problem(pack(recording, (0,)), timed=True)
    batch, late = problem.batch, jnp.asarray(late_rows * PERIOD)
    assert problem.kind == kind
    begin = jnp.where(jnp.asarray(batch.reset), 3.0, 0.0)
    for pole, lag_s in ((0.2, 6e-5), (30.0, 3e-3), (300.0, 6e-5)):
        own = SecondOrder(*map(jnp.asarray, (10.0, pole, lag_s)))
        found = observe(own, problem, jnp.asarray(batch.volts), begin, Reading(late, None)) * problem.unit
        rows = (batch.volts[0], batch.reset[0], begin[0], batch.duration[0])
        moved = simulate(own, *map(jnp.asarray, rows), late)
        expected = moved.turn if kind == "turn" else moved.speed
        np.testing.assert_allclose(found[0], expected, atol=1e-9 * float(jnp.abs(expected).max()))


def test_it_has_a_derivative_where_nothing_is_off():
    def last(offset):
        whole = Motor(motor(2), (TimingOffset(offset),))
        rows = Rows(jnp.asarray(VOLTS), jnp.asarray(RESET), jnp.zeros(ROWS), jnp.asarray(np.arange(ROWS) * PERIOD))
        return simulate_motor(whole, rows, jnp.asarray(PERIOD), jnp.asarray(7.4)).turn[20]

    slope, step = jax.grad(last)(jnp.asarray(0.0)), 1e-7
    expected = (last(jnp.asarray(step)) - last(jnp.asarray(-step))) / (2 * step)
    np.testing.assert_allclose(slope, expected, rtol=1e-3)


def test_it_is_no_effect_of_a_motor_and_no_controller_can_have_it():
    assert "timing_offset" not in EFFECTS
    whole = Motor(motor(1), (TimingOffset.of(offset_s=1e-3),))
    rows = Rows(jnp.asarray(VOLTS), jnp.asarray(RESET), jnp.zeros(ROWS), jnp.asarray(np.arange(ROWS) * PERIOD))
    loop = SpeedLoop(SpeedLaw.of(0.1, 1.0, 7.4))
    with pytest.raises(ValueError, match="controller"):
        simulate_motor(whole, rows, jnp.asarray(PERIOD), jnp.asarray(7.4), controller=loop)
