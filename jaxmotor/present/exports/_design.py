"""Everything that an export of controllers needs, designed once."""

import math
from typing import NamedTuple

from jaxmotor._arguments import taken
from jaxmotor.control import (
    Estimator,
    Hardware,
    PositionDesign,
    SpeedDesign,
    design_estimator,
    design_position_loop,
    design_speed_loop,
    hardware_of,
    linear_numbers,
)
from jaxmotor.estimate import AnyModel, model_of
from jaxmotor.motor.effects import told_parameters


class Design(NamedTuple):
    """Loops and estimator for one model on one rig."""

    hardware: Hardware
    speed: SpeedDesign
    position: PositionDesign
    estimator: Estimator
    linear_step: float
    """K (1 - exp(-a T)), what a volt adds to the speed in a tick [rad/s/V]."""
    effects: tuple[str, ...]
    """Each effect in one line."""


def design(
    model: AnyModel,
    hardware: Hardware | None = None,
    *,
    kind: str = "PI",
    bandwidth_Hz: float | None = None,
    position_bandwidth_Hz: float | None = None,
    overshoot_percent: float = 5.0,
) -> Design:
    """Speed loop, position loop and estimator for `model` on `hardware`, or on the rig that it was identified on.

    **Raises:** `JaxmotorError` where what is asked for is not possible.
    """
    model = model_of(model)
    motor = model.whole
    hardware = hardware_of(model) if hardware is None else hardware
    taken(hardware, Hardware, "a Hardware (of jaxmotor.control)")
    gain, pole, _ = linear_numbers(motor)
    return Design(
        hardware,
        design_speed_loop(motor, hardware, kind=kind, bandwidth_Hz=bandwidth_Hz, overshoot_percent=overshoot_percent),
        design_position_loop(motor, hardware, bandwidth_Hz=position_bandwidth_Hz, overshoot_percent=overshoot_percent),
        design_estimator(motor, hardware),
        gain * -math.expm1(-pole * hardware.period_s),
        tuple(
            " ".join([effect.name, *(f"{key} = {float(getattr(effect, key)):.6g}" for key in told_parameters(effect))])
            for effect in motor.effects
        ),
    )
