"""The sampled response against scipy and against a fine integration."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import scipy.signal
from hypothesis import example, given, settings
from hypothesis import strategies as st

from jaxmotor.motor import (
    FirstOrder,
    SecondOrder,
    mean_speed_response,
    paper_response,
    position_response,
    speed_response,
    step_response,
    unmodelled_by_paper,
    zoh_factor,
)

pytestmark = pytest.mark.usefixtures("x64")

gains = st.floats(0.5, 30.0)
poles = st.floats(1.0, 300.0)
taus = st.floats(1e-5, 0.05)
periods = st.floats(1e-3, 0.02)
fractions = st.lists(st.floats(0.002, 0.499), min_size=3, max_size=3)
RESPONSES = [mean_speed_response, position_response, speed_response]


@pytest.fixture(scope="module", autouse=True)
def compiled():
    with jax.enable_x64(True):
        yield {response: jax.jit(response) for response in RESPONSES}


def numbers(*values):
    return [jnp.asarray(value, jnp.float64) for value in values]


def matrices(gain, pole, tau=None):
    """w' = a (K u - w), or w' = a m, τ m' = K u - w - m; and θ' = w."""
    if tau is None:
        return np.array([[-pole, 0], [1.0, 0]]), np.array([[gain * pole], [0]])
    return np.array([[0, pole, 0], [-1 / tau, -1 / tau, 0], [1.0, 0, 0]]), np.array([[0], [gain / tau], [0]])


def reference(matrix, drive, frequency, period):
    """Speed and position at the tick by scipy's discretisation."""
    size = len(matrix)
    sampled = scipy.signal.cont2discrete((matrix, drive, np.eye(size), np.zeros((size, 1))), period)
    z = np.exp(2j * np.pi * frequency * period)
    state = np.array([np.linalg.solve(zi * np.eye(size) - sampled[0], sampled[1])[:, 0] for zi in z])
    return z, state[:, 0], state[:, -1]


def check_responses(compiled, motor, matrix, drive, frequency, period):
    z, speed, position = reference(matrix, drive, frequency, period)
    f, t = numbers(frequency, period)
    mean = position * (z - 1) / period
    for response, expected in zip(RESPONSES, (mean, position, speed), strict=True):
        close(compiled[response](motor, f, t), expected)
    close(speed_response(motor, f, t, period), mean / z)


def close(found, expected, tolerance=1e-10):
    assert np.abs(np.asarray(found) - expected).max() <= tolerance * np.abs(expected).max()


@given(gains, poles, periods, fractions)
@settings(max_examples=60)
def test_first_order_is_scipys(compiled, gain, pole, period, part):
    motor, frequency = FirstOrder(*numbers(gain, pole)), np.array(part) / period
    check_responses(compiled, motor, *matrices(gain, pole), frequency, period)


@given(gains, poles, taus, periods, fractions)
@example(1.0, 1.0, 1 / 128, 1 / 512, [0.25, 0.25, 0.25])  # a slow motor turns hardly at all in a tick
@settings(max_examples=60)
def test_second_order_is_scipys(compiled, gain, pole, tau, period, part):
    motor, frequency = SecondOrder(*numbers(gain, pole, tau)), np.array(part) / period
    check_responses(compiled, motor, *matrices(gain, pole, tau), frequency, period)


@given(gains, poles, st.sampled_from([0.0, 1e-12, -1e-9, 1e-6, -1e-4, 1e-2]), periods)
@settings(max_examples=30)
def test_critical_damping_is_no_exception(compiled, gain, pole, off, period):
    tau = 0.25 / pole * (1 + off)
    motor, frequency = SecondOrder(*numbers(gain, pole, tau)), np.array([0.01, 0.1, 0.4]) / period
    check_responses(compiled, motor, *matrices(gain, pole, tau), frequency, period)
    slopes = jax.jacfwd(lambda motor: motor.hold(jnp.asarray(period)))(motor)
    assert all(np.isfinite(leaf).all() for leaf in jax.tree.leaves(slopes))


@given(gains, poles, periods, st.floats(0.0, 3.0), fractions)
@settings(max_examples=40)
def test_a_fractional_delay_is_an_input_that_switches_inside_the_tick(gain, pole, period, ticks, part):
    """The same motor sampled 40 times finer, with the input shifted by whole fine ticks."""
    fine = 40
    shift = round(ticks * fine)
    frequency = np.array(part) / period
    matrix, drive = matrices(gain, pole)
    a, b, *_ = scipy.signal.cont2discrete((matrix, drive, np.eye(2), np.zeros((2, 1))), period / fine)
    z = np.exp(2j * np.pi * frequency * period)
    power = np.linalg.matrix_power(a, fine)
    whole, rest = divmod(shift, fine)
    expected = []
    for zi in z:
        pushed = sum(np.linalg.matrix_power(a, fine - 1 - j) @ b * zi ** (-whole - (j < rest)) for j in range(fine))
        position = np.linalg.solve(zi * np.eye(2) - power, pushed)[1, 0]
        expected.append(position * (zi - 1) / period)
    motor = FirstOrder(*numbers(gain, pole))
    found = mean_speed_response(motor, *numbers(frequency, period), delay=shift / fine * period)
    close(found, np.array(expected), 1e-9)


@pytest.mark.parametrize("tau", [None, 116e-6, 3e-3])
def test_held_voltage_moves_the_shaft_as_a_fine_integration_says(tau):
    """Position differences over random held voltages, by midpoint steps of 1 us."""
    gain, pole, period, step = 11.1, 40.0, 0.005, 1e-6
    matrix, drive = matrices(gain, pole, tau)
    one = np.eye(len(matrix)) + step * matrix @ (np.eye(len(matrix)) + step / 2 * matrix)
    push = step * (np.eye(len(matrix)) + step / 2 * matrix) @ drive[:, 0]
    motor = FirstOrder(*numbers(gain, pole)) if tau is None else SecondOrder(*numbers(gain, pole, tau))
    hold = jax.tree.map(np.asarray, motor.hold(jnp.asarray(period)))
    state, exact = np.zeros(len(matrix)), np.zeros(motor.order)
    for volts in np.random.default_rng(1).uniform(-6, 6, 12):
        before = state[-1]
        for _ in range(round(period / step)):
            state = one @ state + push * volts
        assert hold.turn @ exact + hold.turn_drive * volts == pytest.approx(state[-1] - before, abs=2e-9)
        exact = hold.transition @ exact + hold.drive * volts


def test_second_order_tends_to_first_order():
    frequency, period = numbers(np.linspace(0.5, 90, 20), 0.005)
    slow = mean_speed_response(SecondOrder(*numbers(11.0, 40.0, 1e-9)), frequency, period)
    close(slow, np.asarray(mean_speed_response(FirstOrder(*numbers(11.0, 40.0)), frequency, period)), 1e-6)


def test_the_papers_factor_is_its_equation_four():
    frequency, period = np.array([0.5, 10.0, 66.0]), 0.005
    s = 2j * np.pi * frequency
    expected = (1 - np.exp(-s * period)) / (s * period)
    close(zoh_factor(*numbers(frequency, period)), expected)
    motor = FirstOrder(*numbers(10.6, 40.0))
    close(paper_response(motor, *numbers(frequency, period)), 10.6 * 40 / (s + 40) * expected)
    assert zoh_factor(jnp.zeros(1), jnp.asarray(period))[0] == 1.0


def test_the_papers_extra_delay_is_half_a_tick():
    """9 degrees at 10 Hz and 5 ms, which its model lacks (ωT/2)."""
    motor = FirstOrder(*numbers(11.1, 40.0))
    left = unmodelled_by_paper(motor, *numbers([0.5, 5.0, 10.0], 0.005))
    assert np.rad2deg(np.angle(left)) == pytest.approx([-0.45, -4.5, -9.0], abs=0.01)
    assert np.abs(left) == pytest.approx(np.ones(3), abs=5e-3)


def test_step_response_is_scipys():
    time = np.linspace(0, 0.2, 50)
    for motor, system in (
        (FirstOrder(*numbers(11.0, 40.0)), ([11.0 * 40], [1, 40])),
        (SecondOrder(*numbers(11.0, 40.0, 0.02)), ([11.0 * 40], [0.02, 1, 40])),
    ):
        _, expected = scipy.signal.step(system, T=time)
        close(step_response(motor, *numbers(time, 5.1)), 5.1 * expected, 1e-7)


def test_single_precision_stays_close():
    frequency = np.array([0.5, 5.0, 40.0])
    exact = mean_speed_response(FirstOrder(*numbers(11.0, 40.0)), *numbers(frequency, 0.005))
    single = [jnp.asarray(value, jnp.float32) for value in (11.0, 40.0, frequency, 0.005)]
    with jax.enable_x64(False):
        found = mean_speed_response(FirstOrder(*single[:2]), *single[2:])
    assert found.dtype == jnp.complex64
    close(found, np.asarray(exact), 1e-5)


def test_a_hold_of_no_length_has_a_derivative():
    """Rows of no length are padding; what a motor's parameters change there is nothing, not NaN."""

    def held(pole, lag):
        return SecondOrder(jnp.asarray(11.0), pole, lag).hold(jnp.zeros(()))

    with jax.enable_x64(True):
        changed = jax.jacfwd(held, argnums=(0, 1))(jnp.asarray(40.0), jnp.asarray(6e-5))
    assert all(np.array_equal(one, np.zeros_like(one)) for one in jax.tree.leaves(changed))


def test_a_very_fast_electrical_part_does_not_overflow():
    motor = SecondOrder(*numbers(11.0, 40.0, 1e-7))
    hold = motor.hold(jnp.asarray(0.02))
    assert all(np.isfinite(leaf).all() for leaf in hold)
