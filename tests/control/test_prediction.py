"""What is predicted is what the plant does under the board's own law."""

import numpy as np
import pytest
from models import HARDWARE, model
from testing.plant import Plant

from jaxmotor import JaxmotorError
from jaxmotor.control import (
    design_position_loop,
    design_speed_loop,
    measure_step,
    position_controller,
    predict_step,
    speed_controller,
)
from jaxmotor.validation import draw_motors

PAPER = 0.4
"""The paper's gain [V s/rad]."""


def test_the_papers_loop(plant_library):
    """P, gain 0.4, 360 rpm: overshoot and steady error of the board's integer loop lie in the predicted band."""
    import dataclasses

    motor = model()
    # A P loop of any bandwidth, with the paper's gain put in.
    design = design_speed_loop(motor.whole, HARDWARE, kind="P", feeds_forward=False, bandwidth_Hz=20.0)
    design = dataclasses.replace(design, gain_V_s_rad=PAPER)
    predicted = predict_step(motor, speed_controller(motor.whole, design, HARDWARE), HARDWARE, 37.7)
    gain = round(256 * PAPER / HARDWARE.step_V / HARDWARE.counts_per_tick)
    with Plant("[motor]\ninductance_H = 0\n") as plant:
        reference = np.full(200, round(16 * 37.7 * HARDWARE.counts_per_tick))
        run = plant.loop(reference, gain, period_s=0.005, delay_s=40e-6)
    shown = np.diff(run.count, prepend=run.count[0]) / HARDWARE.counts_per_tick
    overshoot, error = measure_step(shown, 37.7)
    assert predicted.overshoot_percent.low <= overshoot <= predicted.overshoot_percent.high
    assert predicted.steady_error.low <= error <= predicted.steady_error.high
    assert error == pytest.approx(37.7 / (1 + PAPER * 10.6), rel=0.02)  # eq. 21
    assert predicted.saturated_percent.value > 0
    inside = (shown >= predicted.shown.low - 1e-9) & (shown <= predicted.shown.high + 1e-9)
    assert inside.mean() > 0.9


def test_draws_spread_as_the_errors_say(x64):
    import jax

    motor = model(("coulomb_friction", {"volts_V": 0.3}), offset=0.05)
    drawn = draw_motors(motor, 4000, jax.random.key(0))
    assert float(drawn.linear.gain[0]) == pytest.approx(10.6)
    assert float(drawn.linear.gain[1:].std()) == pytest.approx(0.03, rel=0.05)
    assert float(drawn.linear.pole[1:].std()) == pytest.approx(0.6, rel=0.05)
    friction, offset = drawn.effects
    assert float(friction.volts_V[1:].std()) == pytest.approx(0.006, rel=0.05)
    assert float(offset.volts_V.std()) < 1e-12 and float(offset.volts_V[0]) == pytest.approx(0.05)


def test_a_position_loop_stops_where_it_should():
    motor = model(("coulomb_friction", {"volts_V": 0.3}), ("dead_zone", {"volts_V": 0.2}))
    design = design_position_loop(motor.whole, HARDWARE, bandwidth_Hz=8.0)
    loop = position_controller(motor.whole, design, HARDWARE)
    predicted = predict_step(motor, loop, HARDWARE, 3.0, seconds=1.5, runs=64)
    assert abs(predicted.steady_error.value) < 1.5 * HARDWARE.count_rad
    assert predicted.overshoot_percent.high < 12
    assert design.friction_error_rad > 3 * HARDWARE.count_rad  # which compensation saves


@pytest.mark.parametrize("reference", [0.0, float("nan")])
def test_no_step_no_prediction(reference):
    motor = model()
    loop = speed_controller(motor.whole, design_speed_loop(motor.whole, HARDWARE), HARDWARE)
    with pytest.raises(JaxmotorError, match="gives no prediction"):
        predict_step(motor, loop, HARDWARE, reference)
