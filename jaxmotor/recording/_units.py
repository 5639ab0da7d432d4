"""Units that a foreign log may state, and what they are in SI."""

import dataclasses
import math
import re
from collections.abc import Collection

from jaxmotor._arguments import is_number
from jaxmotor._sentences import shown
from jaxmotor.recording._recording import RecordingError

TIMES = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
ANGLES = {"rad": 1.0, "deg": math.pi / 180, "rev": 2 * math.pi}
VOLTS = {"V": 1.0, "mV": 1e-3}
LENGTHS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "in": 0.0254, "ft": 0.3048}
_RATES = {"s": 1.0, "min": 1 / 60}
SHAFT_UNITS = (*ANGLES, "counts", *LENGTHS)
SPEED_UNITS = (*(f"{unit}/s" for unit in SHAFT_UNITS), "rpm")


@dataclasses.dataclass(frozen=True)
class Scale:
    """What turns a logged length or count into an angle."""

    counts_per_rev: float | None = None
    wheel_radius_m: float | None = None


def positive(value: float | int | None, flag: str) -> float | None:
    """**Raises:** `RecordingError` where what the option `flag` gives is no positive number."""
    if value is not None and not (is_number(value) and 0 < value < math.inf):
        raise RecordingError(f"{flag} is {shown(value)}; it is a positive number")
    return None if value is None else float(value)


_FACTOR = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?")
FACTOR = "a number before the unit is what one of the column is, as in 3.92rad/s of a tachogenerator's volt"


def split_factor(unit: str) -> tuple[float, str]:
    """The number before `unit`, 1 where there is none, and the unit alone.

    **Raises:** `RecordingError` where the number is zero or too large.
    """
    found = _FACTOR.match(unit)
    if found is None:
        return 1.0, unit
    factor = float(found[0])
    if not 0 < abs(factor) < math.inf:
        raise RecordingError(f"the unit {unit!r} begins with {found[0]}, which is no scale; {FACTOR}")
    return factor, unit[found.end() :].lstrip()


def angle_factor(unit: str, scale: Scale) -> float:
    """Radians per `unit`, which may have a number before it.

    **Raises:** `RecordingError` for an unknown unit, for counts without counts per turn, for lengths without radius.
    """
    factor, name = split_factor(unit)
    return factor * _angle(name, scale)


def _angle(unit: str, scale: Scale) -> float:
    if unit in ANGLES:
        return ANGLES[unit]
    if unit == "counts":
        if scale.counts_per_rev is None:
            raise RecordingError("counts need the counts per turn of the output shaft (--counts-per-rev)")
        return 2 * math.pi / scale.counts_per_rev
    if unit in LENGTHS:
        if scale.wheel_radius_m is None:
            raise RecordingError(f"{unit} is a length; it needs the wheel's radius [m] (--wheel-radius)")
        return LENGTHS[unit] / scale.wheel_radius_m
    raise RecordingError(f"the angle unit {unit!r} is not known; it is one of {', '.join(SHAFT_UNITS)}; {FACTOR}")


def speed_factor(unit: str, scale: Scale) -> float:
    """Radians per second per `unit`, which may have a number before it.

    **Raises:** `RecordingError`, as `angle_factor`.
    """
    factor, name = split_factor(unit)
    shaft, _, rate = ("rev/min" if name == "rpm" else name).rpartition("/")
    if rate not in _RATES or shaft not in SHAFT_UNITS:
        raise RecordingError(f"the speed unit {name!r} is not known; it is one of {', '.join(SPEED_UNITS)}; {FACTOR}")
    return factor * _angle(shaft, scale) * _RATES[rate]


def split_time(text: str, columns: Collection[str]) -> tuple[str, float]:
    """Column and seconds per unit of `COL` or `COL:s|ms|us|ns`; without unit it is seconds. A number may stand before
    the unit: `COL:125us` counts rows or ticks.

    Of several readings, the one that names an existing column is meant.

    **Raises:** `RecordingError`.
    """
    name, colon, unit = text.rpartition(":")
    if colon and name in columns:
        factor, plain = split_factor(unit)
        if plain not in TIMES or factor < 0:
            raise RecordingError(
                f"the time unit {unit!r} is not known; it is one of {', '.join(TIMES)}, a number before it or not"
            )
        return name, factor * TIMES[plain]
    name = name if colon and unit in TIMES and text not in columns else text
    try:
        return existing(name, columns), TIMES["s"]
    except RecordingError as error:
        raise RecordingError(
            f"{error}; a recording needs the time of each row (--time, or --period where rows are evenly spaced)"
        ) from error


def split_unit(text: str, columns: Collection[str], what: str) -> tuple[str, str]:
    """Column and unit of `COL:UNIT`; the column's name may itself hold colons.

    **Raises:** `RecordingError` where the unit is not stated or the column is not there.
    """
    name, colon, unit = text.rpartition(":")
    if not colon or text in columns:
        raise RecordingError(f"{what} {text!r} states no unit; give COLUMN:UNIT, nothing is guessed")
    return existing(name, columns), unit


@dataclasses.dataclass(frozen=True)
class Input:
    """How a column becomes volts: `(value - zero) / full_scale` of the supply, or `value * volts_per_unit`."""

    column: str
    volts_per_unit: float = 1.0
    full_scale: float | None = None
    """By how much the value that means the whole supply is above `zero`; None where the column is a voltage."""
    zero: float = 0.0
    """The value that means no voltage."""
    limit: float | None = None
    """How far from `zero` an input acts: what is beyond was cut off before it was applied. None: however far it is."""


_DUTY = re.compile(r"(.*):duty:([^:]*)", re.DOTALL)


def split_input(text: str, columns: Collection[str]) -> Input:
    """What `COL:V`, `COL:mV`, either with a number before the unit, `COL:duty:FULL`, `COL:duty:FULL@ZERO` or
    `COL:percent` says.

    **Raises:** `RecordingError`.
    """
    duty = _DUTY.fullmatch(text)
    if duty:
        full_scale, zero = _full_scale(duty[2])
        return Input(existing(duty[1], columns), full_scale=full_scale, zero=zero)
    name, unit = split_unit(text, columns, "the input")
    if unit == "percent":
        return Input(name, full_scale=100.0)
    factor, volts = split_factor(unit)
    if volts in VOLTS:
        return Input(name, volts_per_unit=factor * VOLTS[volts])
    raise RecordingError(
        f"the input unit {unit!r} is not known; it is one of V, mV, duty:FULL, duty:FULL@ZERO, percent"
    )


def _full_scale(text: str) -> tuple[float, float]:
    """Of `FULL` or `FULL@ZERO`: how far the value of the whole supply is above that of no voltage, and the latter."""
    full, at, zero = text.partition("@")
    try:
        value, none = float(full), float(zero) if at else 0.0
    except ValueError:
        value = none = math.nan
    if not (math.isfinite(value - none) and value != none) or (value < 0 and not at):
        raise RecordingError(
            f"the full scale {text!r} of the duty is no positive number; give COLUMN:duty:FULL, or "
            "COLUMN:duty:FULL@ZERO where ZERO means no voltage"
        )
    return value - none, none


def existing(name: str, columns: Collection[str]) -> str:
    """`name`, one of `columns`.

    **Raises:** `RecordingError`.
    """
    if name not in columns:
        raise RecordingError(f"there is no column {name!r}; the columns are {', '.join(map(repr, columns))}")
    return name
