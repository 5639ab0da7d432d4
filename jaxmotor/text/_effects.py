"""Effects and their parameters for people."""

import math
import re
from collections.abc import Mapping
from typing import Any

from jaxmotor._numbers import with_error
from jaxmotor._sentences import named
from jaxmotor.diagnosis import FoundEffect
from jaxmotor.motor.effects import AbstractEffect, parameters, vocabulary

FRIENDLY = {
    "V": (1e3, "mV"),
    "s": (1e3, "ms"),
    "rad": (1e3, "mrad"),
    "1": (1e2, "%"),
    "1/s": (6e3, "% per minute"),
    "V s²/rad²": (1e5, "mV"),  # at 10 rad/s, as QuadraticDrag says it
    "1/V²": (1e4, "%"),  # at 10 V, as CubicDrive says it
}
"""What a parameter's unit becomes: factor and name."""
FAMILIES = {
    "friction": "friction or a loss like it",
    "lag": "a lag",
    "drive": "a drive that gives less than commanded",
    "direction": "a difference between the directions",
    "drag": "drag",
    "angle": "something that depends on the shaft's angle",
    "inertia": "a second inertia",
    "counts": "lost counts",
}
"""Families of effects as words."""
PARAMETERS = {
    "volts_V": "voltage",
    "static_volts_V": "voltage near rest",
    "stribeck_speed_rad_s": "Stribeck speed",
    "volts_V_s2_rad2": "voltage at 10 rad/s",
    "cubic_1_V2": "change at 10 V",
    "rate_per_s": "fall of the supply",
    "cycles_per_rev": "cycles per turn",
    "rise_ratio": "rise",
    "change_ratio": "change",
}
"""Parameters whose name without its unit says too little."""
KEYS = {"counts_per_rev": "counts per turn", "at_rest": "begins at rest", "from_V": "from", "to_V": "to"}
"""Keys of a header that say too little as words."""
UNITS = {
    "_rad_s": "rad/s",
    "_V": "V",
    "_s": "s",
    "_Hz": "Hz",
    "_rad": "rad",
    "_A": "A",
    "_Ohm": "Ω",
    "_H": "H",
    "_m": "m",
}
"""Units at the end of a name."""
SUFFIX = re.compile("_(?:rad_s|Hz|Ohm|rad|[AHVms])$")
KEY = re.compile("[a-z]+(?:_[A-Za-z0-9]+)+")
ONE_IS_LARGE = {"V", "s"}
"""Units in which larger values stay."""


def scaled(about: dict[str, Any], value: float) -> tuple[float, str]:
    """Factor and unit for people of a parameter [SI] of which `parameters` says `about`."""
    unit = about["unit"]
    if about["kind"] == "fixed" and unit == "1":
        return 1.0, ""
    return (1.0, unit) if unit in ONE_IS_LARGE and abs(value) >= 1 else FRIENDLY.get(unit, (1.0, unit))


def sentence(found: FoundEffect) -> str:
    """What the effect does, with its parameters ± 95 %."""
    said = law(found.effect, found.standard_error)
    return said if found.curve is None else f"{said}, {found.curve.resemblance}"


def law(effect: AbstractEffect, standard_error: Mapping[str, float]) -> str:
    """What `effect` does, with its parameters ± 95 %; those without an error stand alone."""
    shown = {}
    says, values = effect.told()
    for name, value in values.items():
        about = parameters(effect)[name]
        factor, unit = scaled(about, value)
        fixed = about["kind"] == "fixed" and not unit
        # A sentence may tell a value at another place than the parameter is of: its error goes with it.
        own = float(getattr(effect, name))
        error = standard_error.get(name, math.nan) * (abs(value / own) if own else 1.0)
        shown[name] = f"{value:g}" if fixed else with_error(factor * value, factor * error, unit)
    return says.format(**shown)


def capital(text: str) -> str:
    """`text` as a sentence begins."""
    return text[:1].upper() + text[1:]


def parameter_title(name: str) -> str:
    """A parameter's name as words, without its unit."""
    return PARAMETERS.get(name) or named(SUFFIX.sub("", name))


def key_title(key: str) -> str:
    """A header's key as words, its unit in brackets. A key that is not made as jaxmotor's are stays."""
    if not KEY.fullmatch(key):
        return key
    unit = SUFFIX.search(key)
    name = KEYS.get(key) or named(SUFFIX.sub("", key))
    return f"{name} ({UNITS[unit[0]]})" if unit else name


def family_of(effect: AbstractEffect) -> str:
    """The effect's family as words; an unknown law where it has none."""
    return FAMILIES.get(effect.family, effect.family) or "an unknown law"


def spoken(text: str) -> str:
    """`text` with the names of effects and of their parameters as words."""
    known = vocabulary()
    titles = {name: parameter_title(name) for effect in known.values() for name in parameters(effect)}
    titles |= {effect: named(effect) for effect in known}
    return re.sub(r"[a-z]+(?:_[A-Za-z0-9]+)+", lambda found: titles.get(found[0], found[0]), text)
