"""What was applied in a foreign log: its input in volts, and the supply of which duties are shares."""

import math

import numpy as np

from jaxmotor.recording._log_columns import Inputs
from jaxmotor.recording._recording import RecordingError
from jaxmotor.recording._table import Table
from jaxmotor.recording._units import VOLTS, Input, split_factor, split_unit

FINEST_DUTY = 9
"""Decimals to which fractions of the supply are kept as whole duties."""
UNKNOWN_V = 1.0
"""Stands for a supply that is not known, so that volts are shares of it."""


def nominal(stated: Input, measured: np.ndarray | None, supply_V: float | None, unknown: bool) -> float | None:
    """The supply [V] of which duties are shares: stated, or else the first that was `measured`."""
    if unknown and stated.full_scale is None:
        raise RecordingError("the input is in volts, so no supply is asked for; leave --supply-unknown out")
    if unknown:
        return UNKNOWN_V
    return supply_V if supply_V is not None or measured is None else float(measured[np.isfinite(measured)][0])


def measured_supply(table: Table, stated: str) -> np.ndarray:
    """(n,) measured supply [V], NaN where it was not."""
    column, unit = split_unit(stated, table.cells, "the supply")
    factor, volts = split_factor(unit)
    if volts not in VOLTS:
        raise RecordingError(f"the supply's unit {unit!r} is not known; it is V or mV")
    values = table.sparse(column) * factor * VOLTS[volts]
    if not np.isfinite(values).any():
        raise RecordingError(f"column {column!r} never holds a supply; leave --supply-column out")
    if (values <= 0).any():
        row = int(np.argmax(values <= 0))
        raise table.fault(row, f"{column} is {values[row]:g} V, which drives no motor; correct it, or leave it empty")
    return values


def input_of(table: Table, stated: Input, supply_V: float | int | None, as_duty: bool = False) -> Inputs:
    """Volts, and whole duties where they are.

    With `as_duty` fractions of the supply become whole duties of a larger full scale.
    """
    values = table.numbers(stated.column)
    limit = math.inf if stated.limit is None else stated.limit
    values = np.clip(values, stated.zero - limit, stated.zero + limit)
    if stated.full_scale is None:
        return Inputs(values * stated.volts_per_unit)
    if supply_V is None:
        raise RecordingError(
            "duty and percent need the supply voltage to become volts (--supply); where nobody knows it, "
            "--supply-unknown"
        )
    # Where the value of the supply is below that of no voltage, duties are counted downward.
    sign, full = (1 if stated.full_scale > 0 else -1), abs(stated.full_scale)
    beyond = np.abs(values - stated.zero) > full
    if beyond.any():
        row = int(np.argmax(beyond))
        scale = f"{full:g}{f' around {stated.zero:g}' if stated.zero else ''}"
        raise table.fault(
            row,
            f"{stated.column} is {values[row]:g}, beyond the full scale of {scale}; state another, or of "
            "a log of rows what was applied at most (--input-limit)",
        )
    values = sign * (values - stated.zero)
    is_whole = stated.zero.is_integer() and (limit == math.inf or limit.is_integer())
    duty = table.integers(stated.column) if is_whole else None
    if duty is not None:
        most = int(min(limit, full))
        duty = np.clip(sign * (duty - int(stated.zero)), -most, most)
    elif as_duty:
        finer = 10.0 ** min(max(round(-np.log10(table.resolution(stated.column))), 0), FINEST_DUTY)
        duty, full = np.rint(values * finer).astype(np.int64), full * finer
    if duty is None:
        return Inputs(values / full * supply_V)
    return Inputs(duty / full * supply_V, duty, full)
