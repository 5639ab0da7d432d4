"""Rows of durations of their own: interpolated propagators against those computed for each row."""

import itertools

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxmotor import diagnose
from jaxmotor.motor import Motor, Rows, SecondOrder, SpeedLaw, SpeedLoop, simulate_motor
from jaxmotor.motor.effects import EFFECTS, TimingOffset, TransportDelay
from jaxmotor.prediction import pack
from jaxmotor.recording import from_arrays

PERIOD = 0.005


def uneven(rng, rows):
    """Durations: jitter, some lost ticks, and one long pause."""
    duration = PERIOD * (1 + 0.2 * rng.uniform(-1, 1, rows))
    duration[rng.integers(0, rows, rows // 20)] *= 2
    duration[rows // 2] = 0.12
    return duration


def turns(motor, duration, lengths):
    rng = np.random.default_rng(1)
    volts = 5 * np.sin(np.cumsum(rng.uniform(0, 0.2, len(duration))))
    reset = np.zeros(len(volts), bool)
    reset[0] = True
    time = np.cumsum(duration) - duration
    rows = Rows(*(jnp.asarray(x) for x in (volts, reset, np.zeros(len(volts)), time)))
    given = None if lengths is None else jnp.asarray(lengths)
    run = jax.jit(lambda: simulate_motor(motor, rows, jnp.asarray(duration), jnp.asarray(7.4), 5, lengths=given))()
    return np.asarray(run.sensed_turn), np.asarray(run.speed)


@pytest.mark.parametrize("lag", [0.0, 1e-5, 3e-4, 4e-3])
@pytest.mark.parametrize(
    "names", [(), ("transport_delay",), ("coulomb_friction", "transport_delay"), ("shaft_compliance",)]
)
def test_interpolated_motion_is_the_exact_one(names, lag, x64):
    motor = Motor(
        SecondOrder(*(jnp.asarray(x) for x in (11.0, 40.0, lag))),
        tuple(EFFECTS[name].start() for name in names),
        jnp.asarray(0.2),
    )
    duration = uneven(np.random.default_rng(0), 400)
    for exact, found in zip(turns(motor, duration, None), turns(motor, duration, [PERIOD, 0.12]), strict=True):
        np.testing.assert_allclose(found, exact, atol=1e-7 * np.abs(exact).max())


def test_a_row_beyond_the_longest_is_taken_to_be_that_long(x64):
    """As the last row of an experiment is, whose end nobody logged: it must not throw off what follows."""
    motor = Motor(SecondOrder(*(jnp.asarray(x) for x in (11.0, 40.0, 1e-4))), (), jnp.asarray(0.0))
    duration = np.full(300, PERIOD)
    even = turns(motor, duration, [PERIOD, 2 * PERIOD])
    duration[-1] = 1.0
    found = turns(motor, duration, [PERIOD, 2 * PERIOD])
    duration[-1] = 2 * PERIOD
    for one, other, same in zip(found, turns(motor, duration, [PERIOD, 2 * PERIOD]), even, strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-12)
        np.testing.assert_allclose(one[:-1], same[:-1], rtol=1e-12)


def test_even_rows_are_a_case_of_it(x64):
    """The steps of a contact are as many in each row as the longest needs, so even rows must give what they gave."""
    motor = Motor(
        SecondOrder(*(jnp.asarray(x) for x in (11.0, 40.0, 1e-4))), (EFFECTS["backlash"].start(),), jnp.asarray(0.0)
    )
    duration = np.full(400, PERIOD)
    for exact, found in zip(turns(motor, duration, None), turns(motor, duration, [PERIOD, PERIOD]), strict=True):
        np.testing.assert_allclose(found, exact, atol=1e-6 * np.abs(exact).max())


GAIN, POLE = 10.0, 30.0


def delayed(begins, volts, end, delay):
    """(n + 1, 2) speed and angle at each row and at the `end` of a linear motor whose voltages act late, from one
    change of voltage to the next."""
    rows = [*begins, end]
    moments = sorted({moment for moment in (*rows, *(begins + delay)) if rows[0] <= moment <= end})
    speed, angle, at = 0.0, 0.0, {moments[0]: (0.0, 0.0)}
    for begin, then in itertools.pairwise(moments):
        acting = int(np.searchsorted(begins + delay, begin + 1e-12, side="right")) - 1
        steady, keep = GAIN * volts[acting] if acting >= 0 else 0.0, np.exp(-POLE * (then - begin))
        angle += steady * (then - begin) + (speed - steady) * (1 - keep) / POLE
        speed = steady + (speed - steady) * keep
        at[then] = speed, angle
    return np.array([at[row] for row in rows])


@pytest.mark.parametrize(
    ("period", "jitter", "delay", "error"),
    [
        (PERIOD, 0.2, 0.0035, 1e-6),
        (PERIOD, 0.2, -0.0023, 1e-6),
        # Where two voltages begin to act in one row their mean does, within that row.
        (PERIOD, 0.2, 0.0208, 5e-3),
        (PERIOD, 0.6, 0.0075, 5e-3),
        (PERIOD, 0.6, 0.05, 5e-3),
        # Short rows of which many pass before a voltage acts.
        (0.001, 0.0, 0.0753, 1e-6),
        (0.001, 0.6, 0.0753, 5e-3),
    ],
)
def test_a_delay_is_in_seconds_whatever_the_rows_last(period, jitter, delay, error, x64):
    rng = np.random.default_rng(0)
    duration = period * (1 + jitter * rng.uniform(-1, 1, 400))
    begins, volts = np.cumsum(duration) - duration, np.repeat(rng.uniform(-6, 6, 134), 3)[:400]
    late = TransportDelay.of(delay_s=delay) if delay > 0 else TimingOffset.of(offset_s=-delay)
    motor = Motor(SecondOrder(*(jnp.asarray(x) for x in (GAIN, POLE, 1e-9))), (late,), jnp.asarray(0.0))
    reset = np.arange(400) == 0
    rows = Rows(*(jnp.asarray(x) for x in (volts, reset, np.zeros(400), begins)))
    lengths = jnp.asarray([period, duration.max()]) if jitter else None
    lasts = jnp.asarray(duration if jitter else period)
    run = jax.jit(lambda: simulate_motor(motor, rows, lasts, jnp.asarray(7.4), 5, lengths=lengths))()
    exact = delayed(begins, volts, begins[-1] + duration[-1], delay)
    # A voltage that is early has acted before the first row; the last one's successor is not known.
    used = slice(0, -1) if delay > 0 else slice(200, -1)
    angle = np.cumsum(np.asarray(run.turn)) - exact[1:, 1]
    assert np.abs(angle[used] - (angle[200] if delay < 0 else 0.0)).max() < error * np.abs(exact[:, 0]).std()
    if error < 1e-5:
        assert np.abs(np.asarray(run.speed) - exact[:-1, 0])[used].max() < error * np.abs(exact[:, 0]).std()


@pytest.mark.parametrize("jitter", [0.0, 0.1])
def test_a_delay_may_be_hundreds_of_rows(jitter, x64):
    duration = 0.0005 * (1 + jitter * np.random.default_rng(0).uniform(-1, 1, 3000))
    begins, volts = np.cumsum(duration) - duration, np.repeat([0.0, 6.0, -3.0], 1000)
    motor = Motor(
        SecondOrder(*(jnp.asarray(x) for x in (GAIN, POLE, 1e-9))), (TransportDelay.of(delay_s=0.4),), jnp.asarray(0.0)
    )
    rows = Rows(*(jnp.asarray(x) for x in (volts, np.arange(3000) == 0, np.zeros(3000), begins)))
    lasts = jnp.asarray(duration if jitter else 0.0005)
    run = jax.jit(lambda: simulate_motor(motor, rows, lasts, jnp.asarray(7.4), 2))()
    exact = delayed(begins, volts, begins[-1] + duration[-1], 0.4)
    assert np.abs(np.asarray(run.speed) - exact[:-1, 0]).max() < 1e-6 * np.abs(exact[:, 0]).max()


@pytest.mark.parametrize("law", [TransportDelay, TimingOffset])
def test_motors_of_other_delays_side_by_side_move_as_each_alone(law, x64):
    rng = np.random.default_rng(1)
    duration = PERIOD * (1 + 0.4 * rng.uniform(-1, 1, (300, 2)))
    begins, volts = np.cumsum(duration, axis=0) - duration, np.repeat(rng.uniform(-6, 6, (100, 2)), 3, axis=0)
    reset = np.isin(np.arange(300), [0, 120])[:, None] & np.array([True, True])
    delays = np.array([0.0, 0.0021, 0.0173])

    def motors(*delays):
        linear = SecondOrder(*(jnp.asarray(x) for x in (GAIN, POLE, 1e-9)))
        each = [Motor(linear, (law(jnp.asarray(delay)),), jnp.asarray(0.0)) for delay in delays]
        return jax.tree.map(lambda *leaves: jnp.stack(leaves)[:, None], *each)

    rows = Rows(*(jnp.asarray(x)[:, None] for x in (volts, reset, np.zeros((300, 2)), begins)))
    lasts = jnp.asarray(duration)[:, None]

    def turned(*delays):
        return np.asarray(simulate_motor(motors(*delays), rows, lasts, jnp.asarray(7.4), 3).turn)

    together = turned(*delays)
    assert together.shape == (300, 3, 2)
    for number, delay in enumerate(delays):
        np.testing.assert_allclose(together[:, number], turned(delay)[:, 0], atol=1e-12)


def test_rows_that_are_not_used_change_none_of_the_others(x64):
    rng = np.random.default_rng(3)
    duration = PERIOD * (1 + 0.4 * rng.uniform(-1, 1, (700, 2, 1)))
    begins, volts = np.cumsum(duration, axis=0) - duration, np.repeat(rng.uniform(-6, 6, (100, 2, 1)), 7, axis=0)
    reset = np.isin(np.arange(700), [0, 120])[:, None, None] & np.ones((1, 2, 1), bool)
    linear = SecondOrder(*(jnp.asarray(x) for x in (GAIN, POLE, 1e-4)))
    each = [Motor(linear, (TransportDelay.of(delay_s=delay),), jnp.asarray(0.0)) for delay in (0.0, 0.0021, 0.0173)]
    motors = jax.tree.map(lambda *leaves: jnp.stack(leaves), *each)
    rows = Rows(*map(jnp.asarray, (volts, reset, np.zeros((700, 2, 1)), begins)))
    lengths = jnp.asarray([PERIOD, duration.max()])

    def turned(used):
        run = simulate_motor(motors, rows, jnp.asarray(duration), jnp.asarray(7.4), 3, used=used, lengths=lengths)
        return np.asarray(run.turn)

    every, some = turned(None), turned(jnp.int32(300))
    assert every.shape == (700, 2, 3) and np.ptp(every[:300], axis=2).max() > 0.01
    np.testing.assert_allclose(some[:300], every[:300], rtol=1e-12, atol=1e-15)
    assert not some[300:].any()


def test_a_controller_chooses_no_late_voltages_of_rows_of_lengths_of_their_own(x64):
    motor = Motor(SecondOrder(*(jnp.asarray(x) for x in (GAIN, POLE, 1e-9))), (TransportDelay.of(delay_s=0.01),))
    rows = Rows(*(jnp.asarray(x) for x in (np.ones(9), np.arange(9) == 0, np.zeros(9), PERIOD * np.arange(9))))
    loop = SpeedLoop(SpeedLaw.of(0.1, 1.0, 7.4))
    with pytest.raises(ValueError, match="act late in rows of lengths of their own"):
        simulate_motor(motor, rows, jnp.full(9, PERIOD), jnp.asarray(7.4), controller=loop)


def test_a_delay_of_many_short_rows_is_found(x64):
    rng = np.random.default_rng(2)
    begins, volts = 0.001 * np.arange(4000), np.repeat(rng.choice([-6.0, -3.0, 4.0, 6.0], 40), 100)
    angle = delayed(begins, volts, 4.0, 0.0753)[:-1, 1]
    log = from_arrays(
        time_s=begins, volts=volts, counts=np.floor(angle * 2000 / (2 * np.pi)), counts_per_rev=2000, supply_V=12.0
    )
    found = diagnose(log, effects=["transport_delay"])
    [late] = found.effects
    assert late.effect.delay_s == pytest.approx(0.0753, abs=2e-4)  # L/R is not known that well
    assert float(found.motor.linear.gain) == pytest.approx(GAIN, rel=1e-3)


@pytest.mark.parametrize("jitter", [0.0, 0.25])
def test_the_noise_of_a_log_with_a_delay_is_found_whatever_its_rows_last(jitter):
    rng = np.random.default_rng(3)
    duration = PERIOD * (1 + jitter * rng.uniform(-1, 1, 3000))
    begins, volts = np.cumsum(duration) - duration, np.repeat(rng.uniform(-6, 6, 500), 6)
    volts[:12] = 0.0
    speed = delayed(begins, volts, begins[-1] + duration[-1], 3.5 * PERIOD)[:-1, 0]
    level = 0.01 * speed.std()
    read = speed + level * rng.standard_normal(3000)
    log = from_arrays(time_s=begins, volts=volts, speed_rad_s=read, supply_V=12.0, speed_window_s=0.0)
    assert pack(log, (0,)).observation.noise.level == pytest.approx(level, rel=0.1)
