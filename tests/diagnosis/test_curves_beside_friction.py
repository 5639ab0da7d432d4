"""A law that is in no vocabulary, in a motor with dry friction: both are found, though each hides the other."""

import math
from collections.abc import Callable

import numpy as np
import pytest

from jaxmotor import diagnose
from jaxmotor.recording import Recording, from_arrays

GAIN, POLE, SUPPLY_V, PERIOD_S, FINE, COUNTS_PER_REV, ROWS = 3.0, 12.0, 12.0, 0.01, 40, 1400.0, 3000
FRICTION_V = 0.5
EFFECTS = (
    *("coulomb_friction", "dead_zone", "voltage_saturation", "voltage_offset", "cogging", "quadratic_drag"),
    *("voltage_over_command", "torque_over_speed", "torque_over_angle"),
)


def turned(volts: np.ndarray, drive: Callable[[float], float], torque: Callable[[float], float]) -> Recording:
    """A first-order motor with `FRICTION_V`, exact between changes, in `FINE` steps to a row."""
    keep, speed, angle, count = math.exp(-POLE * PERIOD_S / FINE), 0.0, 0.0, []
    for volt in volts:
        count.append(math.floor(angle * COUNTS_PER_REV / (2 * math.pi)))
        for _ in range(FINE):
            pulls = drive(volt) - torque(angle)
            if speed == 0.0 and abs(pulls) <= FRICTION_V:
                continue
            steady = GAIN * (pulls - math.copysign(FRICTION_V, speed or pulls))
            new = steady + (speed - steady) * keep
            new = 0.0 if new * speed < 0 else new
            angle += 0.5 * PERIOD_S / FINE * (speed + new)
            speed = new
    return from_arrays(
        time_s=PERIOD_S * np.arange(len(volts)),
        volts=volts,
        counts=np.array(count),
        counts_per_rev=COUNTS_PER_REV,
        supply_V=SUPPLY_V,
    )


def voltages(seed: int) -> np.ndarray:
    """Levels of many heights, held for 0.1 to 0.7 s, and rests."""
    rng = np.random.default_rng(seed)
    levels = np.where(rng.uniform(size=ROWS) < 0.15, 0.0, rng.uniform(-1, 1, ROWS) * rng.choice([0.25, 0.5, 1.0], ROWS))
    volts = SUPPLY_V * np.repeat(levels, rng.integers(10, 70, ROWS))[:ROWS]
    volts[:30] = 0.0
    return volts


def test_a_drive_that_saturates_softly():
    """The gain is that of the straight line through the curve, and friction is told in volts before that gain: their
    product is known."""
    found = diagnose(turned(voltages(5), lambda volt: 7 * math.tanh(volt / 7), lambda angle: 0.0), effects=EFFECTS)
    sizes = {one.name: one.parameters for one in found.effects}
    assert set(sizes) == {"coulomb_friction", "voltage_over_command"} and found.verdict == "extended"
    gain = float(found.motor.linear.gain)
    assert gain * sizes["coulomb_friction"]["volts_V"] == pytest.approx(GAIN * FRICTION_V, rel=0.01)
    assert any("of the straight line through the curve" in note for note in found.notes)
    assert float(found.motor.linear.pole) == pytest.approx(POLE, rel=0.005)
    assert found.whole.after.chi2_per_sample < 1.1


def test_cogging_of_two_numbers_of_cycles():
    def torque(angle: float) -> float:
        return 0.3 * math.sin(5 * angle) + 0.15 * math.sin(10 * angle + 1)

    found = diagnose(turned(voltages(5), lambda volt: volt, torque), effects=EFFECTS)
    sizes = {one.name: one.parameters for one in found.effects}
    assert set(sizes) == {"coulomb_friction", "torque_over_angle"} and found.verdict == "extended"
    assert sizes["coulomb_friction"]["volts_V"] == pytest.approx(FRICTION_V, rel=0.01)
    assert float(found.motor.linear.gain) == pytest.approx(GAIN, rel=0.001)
    [law] = found.learned
    assert law.coordinate == "angle" and law.share > 0.9
