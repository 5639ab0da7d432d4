"""What is stated of a foreign log, as far as it can be checked before the log is read."""

import math
from collections.abc import Mapping
from typing import Any, Literal, get_args

from jaxmotor._arguments import check_choice, check_text, check_whole, is_number
from jaxmotor._sentences import shown
from jaxmotor.recording._header import RANGES
from jaxmotor.recording._recording import RecordingError
from jaxmotor.recording._units import positive

Drive = Literal["brake", "coast"]
Acts = Literal["after", "before"]


def check_stated(drive: Any, drop_first: Any, **texts: Any) -> None:
    """**Raises:** `JaxmotorError` for what was stated of a log and cannot be; `texts` are columns, or not stated."""
    for name, text in texts.items():
        if text is not None:
            check_text(f"--{'supply-column' if name == 'supply' else name}", text)
    if drive is not None:
        check_choice("--drive", drive, get_args(Drive))
    check_whole("--drop-first", drop_first)


def check_beside(given: Mapping[str, Any]) -> None:
    """**Raises:** `RecordingError` where something is `given` that cannot be beside the rest."""
    has = {name for name, value in given.items() if value}
    if "step" in has and has & {"before", "holds"}:
        raise RecordingError(
            "--step says from which row on the input acts; leave --input-acts before and --input-holds out"
        )
    if "gap" in has and "time" not in has:
        raise RecordingError("--gap is between two time stamps; name their column (--time)")
    if "spikes" in has and not has & {"speed", "angle"}:
        raise RecordingError(
            "a count that jumps as no motor does is refused; leave --drop-spikes out, or state --angle COL:counts"
        )
    if "damaged" in has and "time" not in has:
        raise RecordingError(
            "how many rows a damaged line was is known where each row has its time; leave --drop-damaged out, or "
            "state --time"
        )
    check_unknown("unknown" in has, bool(has & {"supply", "supply_V"}))


def check_unknown(unknown: bool, stated: bool) -> None:
    """**Raises:** `RecordingError` where the supply is `unknown`, and `stated`."""
    if unknown and stated:
        raise RecordingError("the supply is stated, so it is not unknown; leave --supply-unknown out")


def check_window(speed: str | None, stated: Mapping[str, float | None]) -> None:
    """**Raises:** `RecordingError` where two options say over how long speeds are, or one does so of none."""
    given = [flag for flag, value in stated.items() if value is not None]
    if len(given) > 1:
        raise RecordingError(f"{given[1]} says over how long each speed is; leave {given[0]} out")
    if speed is None and given and given != ["--speed-window"]:
        raise RecordingError(
            f"{given[0]} is of a speed, and no column of speeds is named; leave it out, or state --speed"
        )


def period_of(value: float | int | None, flag: str) -> float | None:
    """**Raises:** `RecordingError` where it is none of rows."""
    period_s, (least, most) = positive(value, flag), RANGES["period_s"]
    if period_s is not None and not least <= period_s <= most:
        raise RecordingError(f"{flag} is {period_s:g}; rows are {least:g} to {most:g} s apart")
    return period_s


def window_of(value: float | int | None) -> float | None:
    """**Raises:** `RecordingError` where speeds are no means over it."""
    if value is not None and not (is_number(value) and 0 <= value < math.inf):
        raise RecordingError(f"--speed-window is {shown(value)}; give seconds, 0 for an instantaneous speed")
    return None if value is None else float(value)
