"""Logs whose noise is not known beforehand, of motors that no flexible model comes near: it is what the found motor
leaves."""

import numpy as np
import pytest
from test_search import GAIN, PERIOD_S, POLE, ROWS

from jaxmotor import diagnose
from jaxmotor.cli._story import diagnosis_text
from jaxmotor.diagnosis import to_json
from jaxmotor.recording import Recording, Segment

LIMIT_V, NOISE_RAD_S = 2.4, 0.15


def limited_log(seed: int) -> Recording:
    """Random voltages, each held for some rows, on a bridge that gives no more than `LIMIT_V`; mean speeds over rows,
    in closed form."""
    rng = np.random.default_rng(seed)
    lengths = rng.integers(3, 40, ROWS)
    volts = np.concatenate([[0.0], np.repeat(rng.uniform(-5, 5, ROWS), lengths)])[:ROWS]
    decay, now, read = np.exp(-POLE * PERIOD_S), 0.0, np.zeros(ROWS)
    for k, end in enumerate(GAIN * np.clip(volts, -LIMIT_V, LIMIT_V)[:-1], 1):
        read[k] = end + (now - end) * (1 - decay) / (POLE * PERIOD_S)
        now = end + (now - end) * decay
    read += NOISE_RAD_S * rng.standard_normal(ROWS)
    segment = Segment("other", 0.0, True, {}, np.arange(ROWS) * PERIOD_S, volts, tick=np.arange(ROWS), speed_rad_s=read)
    return Recording((segment,), "limited", PERIOD_S, speed_window_s=PERIOD_S, supply_V=5.0, duty_delay_s=0.0)


@pytest.mark.parametrize("seed", [1, 2])
def test_the_noise_is_what_the_found_motor_leaves(seed):
    found = diagnose(limited_log(seed))
    [limit] = found.named
    assert limit.name == "voltage_saturation" and found.verdict == "extended"
    assert abs(limit.parameters["volts_V"] - LIMIT_V) < 3 * limit.standard_error["volts_V"] < 0.01 * LIMIT_V
    assert found.fit.noise.level == pytest.approx(NOISE_RAD_S, rel=0.05)
    assert found.held_out.after.chi2_per_sample == pytest.approx(1.0, abs=0.15)
    assert found.fit.chi2_per_sample == pytest.approx(found.whole.before.chi2_per_sample, rel=0.05)
    assert to_json(found)["noise"]["level"] == pytest.approx(NOISE_RAD_S, rel=0.05)
    assert f"(1 = noise alone, {found.fit.noise.level:.3g} rad/s)" in " ".join(diagnosis_text(found).split())
