"""Brings a steady-state curve in: speeds that a motor settled at, one for each voltage."""

import os

import numpy as np

from jaxmotor._arguments import path_of
from jaxmotor.recording._chosen_rows import of_one
from jaxmotor.recording._log_input import input_of, nominal
from jaxmotor.recording._opened import opened
from jaxmotor.recording._own_words import in_own_words
from jaxmotor.recording._recording import Recording, RecordingError, Segment
from jaxmotor.recording._shaft import Shaft
from jaxmotor.recording._stated import Drive, check_stated, check_unknown, window_of
from jaxmotor.recording._text import about_log, limit_rows
from jaxmotor.recording._units import Scale, positive, split_input

HOLD_S = 2.0
"""For which a steady state was held, unless told."""
PAUSE_S = 1.0
"""Between one state and the next."""


@in_own_words
def import_steady(
    path: str | os.PathLike[str],
    *,
    input: str,
    speed: str,
    period_s: float | int,
    hold_s: float | int = HOLD_S,
    supply_V: float | int | None = None,
    supply_unknown: bool = False,
    speed_window_s: float | int | None = None,
    counts_per_rev: float | int | None = None,
    wheel_radius_m: float | int | None = None,
    drive: Drive | None = None,
    only: str | None = None,
    columns: str | None = None,
    drop_first: int = 0,
    decimal_comma: bool = False,
) -> Recording:
    """The steady states in the CSV at `path`, each as a segment in which voltage and speed stay as they are.

    A row says that under a voltage the motor runs at a speed: so it does for `hold_s` seconds, in ticks of `period_s`
    (that of the logs it is to be joined with). Models come to it from rest and are compared with its second half, so
    `hold_s` should be ten time constants of the motor or more. `input`, `speed` and the other arguments are those of
    `import_log`.

    **Raises:** `RecordingError`.
    """
    path = path_of(path, "the path of a log")
    check_stated(drive, drop_first, input=input, speed=speed, columns=columns, only=only)
    window = window_of(speed_window_s)
    scale = Scale(positive(counts_per_rev, "--counts-per-rev"), positive(wheel_radius_m, "--wheel-radius"))
    period, hold = positive(period_s, "--period"), positive(hold_s, "--steady")
    supply_V = positive(supply_V, "--supply")
    check_unknown(supply_unknown, supply_V is not None)
    if period is None or hold is None:
        raise RecordingError("a steady state needs a --period and a --steady of seconds")
    ticks = round(hold / period) + 1
    if ticks < 3:
        raise RecordingError(f"--steady {hold:g} is less than two periods of {period:g} s; hold the states longer")
    table = opened(path, {"input": input, "speed": speed, "columns": columns}, drop_first, decimal_comma)
    with about_log(table.source):
        table = of_one(table, only)
        stated = split_input(input, table.cells)
        supply_V = nominal(stated, None, supply_V, supply_unknown)
        volts = input_of(table, stated, supply_V).volts
        speeds = Shaft(speed=speed).read(table, scale)["speed_rad_s"]
    limit_rows(len(volts) * ticks, table.source)
    held = enumerate(zip(volts, speeds, strict=True))
    imported = {"log": path.name, "input": input, "speed": speed} | ({} if only is None else {"only": only})
    return Recording(
        segments=tuple(_held(*one, number * (hold + PAUSE_S), np.arange(ticks), period) for number, one in held),
        source=table.source,
        period_s=period,
        counts_per_rev=scale.counts_per_rev,
        supply_V=supply_V,
        speed_window_s=window,
        drive=drive,
        header={"imported": imported | table.left_out} | ({"supply_unknown": True} if supply_unknown else {}),
    )


def _held(volts: float, speed_rad_s: float, start_s: float, tick: np.ndarray, period_s: float) -> Segment:
    """One state, in these ticks."""
    return Segment(
        kind="other",
        start_s=start_s,
        at_rest=False,
        parameters={"steady": True},
        time_s=tick * period_s,
        volts=np.full(len(tick), volts),
        tick=tick,
        speed_rad_s=np.full(len(tick), speed_rad_s),
    )


def is_steady(segment: Segment) -> bool:
    """`segment` is a steady state, held."""
    return segment.parameters.get("steady") is True
