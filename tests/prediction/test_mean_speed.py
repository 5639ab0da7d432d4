"""Speeds that are means over a window which begins within a row: against the exact ones of a linear motor."""

import dataclasses

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxmotor.motor import FirstOrder, Motor, SecondOrder
from jaxmotor.motor.effects import SpeedWindow
from jaxmotor.prediction import as_problem, log_of, observe, pack, predicted_readings
from jaxmotor.recording import Recording, Segment

PERIOD = 0.005
ROWS = 120

pytestmark = pytest.mark.usefixtures("x64")


@pytest.mark.parametrize("rows", [0.4, 1.5, 2.3])
@pytest.mark.parametrize("values", [(11.0, 40.0), (11.0, 40.0, 5e-4)])
def test_within_a_row_the_speed_is_nearly_a_parabola(values, rows):
    volts = np.repeat(np.random.default_rng(3).choice([-4.4, 4.4], ROWS // 6), 6)
    log = Segment("prbs", 0.0, True, {}, np.arange(ROWS) * PERIOD, volts, speed_rad_s=np.arange(ROWS) % 7.0)
    recording = Recording((log,), "made.csv", period_s=PERIOD, speed_window_s=rows * PERIOD)
    packed = pack(recording, (0,))
    linear = (FirstOrder if len(values) == 2 else SecondOrder)(*map(jnp.asarray, values))
    log, problem = log_of(recording, packed, values[1]), as_problem(packed)
    rest = jnp.zeros(packed.batch.volts.shape)
    exact = observe(linear, problem, jnp.asarray(packed.batch.volts), rest) * problem.unit
    found = predicted_readings(Motor(linear), jnp.zeros(packed.pieces + 1), log).T * problem.unit
    off = np.abs(np.asarray(found - exact))[packed.batch.valid]
    assert np.abs(np.asarray(exact)).max() > 30
    # The lag of the current, a tenth of a row, bends the first row of a step more than a parabola does.
    assert off.max() < (0.005 if len(values) == 2 else 0.16 / rows)


@pytest.mark.parametrize("spread", [0.0, 0.3, 2.0])
def test_a_window_that_is_sought_gives_the_readings_of_one_that_is_stated(spread):
    """Also of several motors at a time, each with a window of its own, in segments that begin at rest and in motion."""
    rng = np.random.default_rng(8)
    runs = []
    for rest in (True, False):
        # Up to bursts of rows and gaps between them.
        time = np.cumsum(np.exp(rng.normal(0.0, spread, ROWS))) * PERIOD
        volts = np.repeat(rng.choice([-4.4, 4.4], ROWS // 6), 6)
        runs.append(
            Segment("prbs", 2.0 * len(runs), rest, {}, time - time[0], volts, speed_rad_s=rng.normal(size=ROWS))
        )
    recording = Recording(tuple(runs), "made.csv", period_s=None if spread else PERIOD)
    lengths = np.array([0.4, 1.5, 7.3]) * PERIOD
    linear = SecondOrder(*map(jnp.asarray, (11.0, 40.0, 2e-4)))
    speeds = jnp.asarray([0.0, 12.0, 0.0])

    def readings(recording, motor, speeds):
        packed = pack(recording, (0, 1))
        log = log_of(recording, packed, 40.0)
        return packed, predicted_readings(motor, speeds, log) * log.problem.unit

    three = jax.tree.map(lambda leaf: jnp.repeat(leaf[None], 3), Motor(linear))
    three = eqx.tree_at(lambda motor: motor.effects, three, (SpeedWindow(jnp.asarray(lengths)),))
    _, sought = readings(recording, three, jnp.repeat(speeds[None], 3, 0))
    for number, length in enumerate(lengths):
        stating = dataclasses.replace(recording, speed_window_s=float(length))
        packed, stated = readings(stating, Motor(linear), speeds)
        own, valid = np.asarray(sought)[..., number].T, packed.batch.valid
        assert valid.sum() > 2 * ROWS - 50
        np.testing.assert_allclose(own[valid], np.asarray(stated).T[valid], rtol=1e-9, atol=1e-9)
        # Before a piece that begins in motion the shaft turned at that speed.
        first = packed.batch.free.nonzero()
        assert own[first] == pytest.approx(12.0)
