"""How the speeds of a recording were averaged, in a model's file."""

import math
from typing import Any

from jaxmotor._sentences import shown
from jaxmotor.estimate._model_numbers import RANGES, is_number
from jaxmotor.estimate._speed_average import SpeedAverage
from jaxmotor.recording import MOST_WINDOW_ROWS

NUMBERS = ("standard_error_s", "lateness_s", "lateness_error_s", "gain_per_s", "pole_per_s")
"""Beside the length; null where they are not known."""


def read_average(content: Any) -> SpeedAverage | None:
    """What `dataclasses.asdict` made of a `SpeedAverage`; None of None.

    **Raises:** `ValueError`, a sentence, where it is something else.
    """
    if content is None:
        return None
    if not isinstance(content, dict) or content.get("kind") not in ("window", "filter"):
        raise ValueError("speed_average is neither a window nor a filter of speeds")
    length = content.get("length_s")
    if not is_number(length) or not 0 < length <= RANGES["speed_window_s"][1]:
        raise ValueError(f"speed_average: length_s is {shown(length)}, not a time that speeds are averaged over")
    known = {name: content[name] for name in NUMBERS if content.get(name) is not None}
    wrong = next((name for name, value in known.items() if not is_number(value)), None)
    if wrong is not None:
        raise ValueError(f"speed_average: {wrong} is {shown(known[wrong])}, not a number or null")
    rows, flags = content.get("rows"), {name: content.get(name, False) for name in ("separable", "as_even")}
    if rows is not None and (type(rows) is not int or not 1 <= rows <= MOST_WINDOW_ROWS):
        raise ValueError(f"speed_average: rows is {shown(rows)}, not a number of rows up to {MOST_WINDOW_ROWS}")
    if not all(isinstance(flag, bool) for flag in flags.values()):
        raise ValueError("speed_average: separable and as_even are true or false")
    weight = content.get("weight")
    if weight is not None and not (is_number(weight) and 0 < weight < 1):
        raise ValueError(f"speed_average: weight is {shown(weight)}, not a share between 0 and 1")
    values = dict.fromkeys(NUMBERS, math.nan) | known
    return SpeedAverage(kind=content["kind"], length_s=length, rows=rows, weight=weight, **values, **flags)
