"""First-order lags of a log's rows, against a loop over the rows."""

import numpy as np
import pytest

from jaxmotor.prediction._flexible_model import LogRows, first_order


def rows_of(number: int, seed: int) -> LogRows:
    """Rows of uneven length in pieces, some of which begin in motion."""
    rng = np.random.default_rng(seed)
    reset = rng.random(number) < 0.02
    reset[0] = True
    zeros = np.zeros(number)
    return LogRows(
        volts=rng.normal(size=number),
        reset=reset,
        free=rng.random(number) < 0.5,
        duration=rng.uniform(0.002, 0.02, number),
        speed=zeros,
        valid=np.ones(number, bool),
        back=zeros,
        part=zeros,
        turn=False,
        window_s=zeros,
    )


@pytest.mark.parametrize("number", [1, 2, 3, 17, 400, 1201])
def test_lags_are_those_of_a_loop(number: int):
    rows, poles = rows_of(number, number), np.array([1.0, 40.0, 3000.0])
    rng = np.random.default_rng(1)
    drives, start = rng.normal(size=(number, 3)), rng.normal(size=number)
    speed, turned = first_order(rows, drives, poles, start)
    now = np.zeros(3)
    for row in range(number):
        if rows.reset[row]:
            now = np.full(3, start[row] * rows.free[row])
        np.testing.assert_allclose(speed[row], now, rtol=1e-12, atol=1e-12)
        decay = np.exp(-poles * rows.duration[row])
        turn = drives[row] * rows.duration[row] + (now - drives[row]) * (1 - decay) / poles
        np.testing.assert_allclose(turned[row], turn, rtol=1e-9, atol=1e-12)
        now = drives[row] + (now - drives[row]) * decay
