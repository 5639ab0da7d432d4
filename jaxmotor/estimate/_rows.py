"""A motor's parameters with their units and errors, for people."""

import math
from collections.abc import Iterable, Mapping
from typing import Any

from jaxmotor._shown import Row
from jaxmotor.motor import AbstractEffect, AbstractLinearMotor
from jaxmotor.motor.effects import told_parameters

LINEAR = (("gain", "rad/s/V"), ("pole", "rad/s"), ("electrical_time_constant", "s"))


def linear_rows(motor: AbstractLinearMotor, errors: Iterable[Any]) -> tuple[Row, ...]:
    """Of gain, pole and what else `motor` has, with these standard errors."""
    return tuple(
        Row(name, float(getattr(motor, name)), float(error), unit)
        for (name, unit), error in zip(LINEAR, errors, strict=False)
        if hasattr(motor, name)
    )


def effect_rows(effects: Iterable[AbstractEffect], errors: Iterable[Mapping[str, float]]) -> tuple[Row, ...]:
    """Of each parameter of each of `effects`."""
    return tuple(
        Row(f"{effect.name}.{name}", float(getattr(effect, name)), float(known.get(name, math.nan)), about["unit"])
        for effect, known in zip(effects, errors, strict=False)
        for name, about in told_parameters(effect).items()
    )
