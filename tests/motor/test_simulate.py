"""Free simulation against scipy, and its bookkeeping."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy.signal

from jaxmotor.motor import FirstOrder, SecondOrder, simulate

pytestmark = pytest.mark.usefixtures("x64")
PERIOD = 0.005


def motor(order):
    values = [jnp.asarray(value, jnp.float64) for value in (11.0, 40.0, 2e-3)]
    return FirstOrder(*values[:2]) if order == 1 else SecondOrder(*values)


def scipy_motion(order, volts, speed=0.0):
    numerator, denominator = [11.0 * 40], ([1, 40.0] if order == 1 else [2e-3, 1, 40.0])
    a, b, c, d = scipy.signal.tf2ss(numerator, denominator)
    # The angle is one more state, so that its sampling is exact, too.
    matrix = np.block([[a, np.zeros((order, 1))], [c, np.zeros((1, 1))]])
    system = (matrix, np.vstack([b, d]), np.eye(order + 1), np.zeros((order + 1, 1)))
    step = scipy.signal.cont2discrete(system, PERIOD)
    start = np.zeros(order + 1)
    start[:order] = np.linalg.lstsq(np.vstack([c, c @ a]), [speed, 0.0 if order == 2 else -40.0 * speed])[0]
    _, states, _ = scipy.signal.dlsim((*step[:2], np.eye(order + 1), np.zeros((order + 1, 1)), PERIOD), volts, x0=start)
    return states[:, :order] @ c[0], states[:, order]


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("speed", [0.0, 17.0])
def test_simulation_is_scipys(order, speed):
    volts = np.random.default_rng(0).uniform(-5, 5, 300)
    reset = np.zeros(300, bool)
    reset[0] = True
    start = np.zeros(300)
    start[0] = speed
    motion = simulate(motor(order), *map(jnp.asarray, (volts, reset, start, PERIOD)))
    expected_speed, expected_angle = scipy_motion(order, volts, speed)
    angle = np.concatenate([[0.0], np.cumsum(motion.turn)[:-1]])
    np.testing.assert_allclose(motion.speed, expected_speed, atol=1e-9)
    np.testing.assert_allclose(angle, expected_angle, atol=1e-10)


@pytest.mark.parametrize("order", [1, 2])
def test_uneven_rows_are_even_rows_left_out_where_the_voltage_is_the_same(order):
    volts = np.repeat(np.random.default_rng(1).uniform(-5, 5, 40), 6)
    kept = np.sort(np.random.default_rng(2).permutation(240)[:150])
    kept = np.union1d(kept, np.arange(0, 240, 6))
    reset = np.zeros(240, bool)
    reset[0] = True
    fine = simulate(motor(order), *map(jnp.asarray, (volts, reset, np.zeros(240), PERIOD)))
    duration = np.diff(kept, append=240) * PERIOD
    coarse = simulate(motor(order), *map(jnp.asarray, (volts[kept], reset[kept], np.zeros(len(kept)), duration)))
    np.testing.assert_allclose(coarse.speed, fine.speed[kept], atol=1e-11)
    angle = np.concatenate([[0.0], np.cumsum(fine.turn)])
    np.testing.assert_allclose(np.cumsum(coarse.turn), angle[np.append(kept[1:], 240)], atol=1e-10)


def test_experiments_end_to_end_do_not_know_of_each_other():
    rng = np.random.default_rng(3)
    runs = [rng.uniform(-5, 5, size) for size in (30, 50, 7)]
    starts = [0.0, 9.0, -3.0]

    def one(volts, speed):
        reset, start = np.zeros(len(volts), bool), np.zeros(len(volts))
        reset[0], start[0] = True, speed
        return volts, reset, start

    alone = [simulate(motor(2), *map(jnp.asarray, (*one(*run), PERIOD))) for run in zip(runs, starts, strict=True)]
    joined = [np.concatenate(part) for part in zip(*(one(*run) for run in zip(runs, starts, strict=True)), strict=True)]
    together = simulate(motor(2), *map(jnp.asarray, (*joined, PERIOD)))
    np.testing.assert_array_equal(together.speed, np.concatenate([motion.speed for motion in alone]))


def test_jit_and_vmap_change_nothing():
    volts = jnp.asarray(np.random.default_rng(4).uniform(-5, 5, (6, 64)))
    reset = jnp.zeros((6, 64), bool).at[:, 0].set(True)
    one = jax.jit(lambda volts, reset: simulate(motor(1), volts, reset, jnp.zeros(64), jnp.asarray(PERIOD)))
    batch = jax.vmap(one)(volts, reset)
    for row in range(6):
        np.testing.assert_allclose(batch.turn[row], one(volts[row], reset[row]).turn, rtol=1e-12)


def test_gradients_are_finite_differences():
    volts = jnp.asarray(np.random.default_rng(5).uniform(-5, 5, 80))
    reset = jnp.zeros(80, bool).at[0].set(True)

    def turn(logs):
        motor = SecondOrder(*jnp.exp(logs))
        return simulate(motor, volts, reset, jnp.zeros(80), jnp.asarray(PERIOD)).turn

    logs, step = jnp.log(jnp.array([11.0, 40.0, 2e-3])), 1e-6
    found = jax.jacfwd(turn)(logs)
    for k in range(3):
        shift = jnp.zeros(3).at[k].set(step)
        expected = (turn(logs + shift) - turn(logs - shift)) / (2 * step)
        np.testing.assert_allclose(found[:, k], expected, atol=1e-8)
