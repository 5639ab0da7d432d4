"""Speeds that are means over a window which begins within a row: against the exact ones of a linear motor."""

import jax.numpy as jnp
import numpy as np
import pytest

from jaxmotor.motor import FirstOrder, Motor, SecondOrder
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
    rest = jnp.zeros(packed.lanes.volts.shape)
    exact = observe(linear, problem, jnp.asarray(packed.lanes.volts), rest) * problem.unit
    found = predicted_readings(Motor(linear), jnp.zeros(packed.pieces + 1), log).T * problem.unit
    off = np.abs(np.asarray(found - exact))[packed.lanes.valid]
    assert np.abs(np.asarray(exact)).max() > 30
    # The lag of the current, a tenth of a row, bends the first row of a step more than a parabola does.
    assert off.max() < (0.005 if len(values) == 2 else 0.16 / rows)
