"""Sentences about a log speak of options on the command line, and of arguments in Python."""

import functools
import re
from collections.abc import Callable
from typing import ParamSpec, TypeVar

from jaxmotor._errors import JaxmotorError
from jaxmotor.recording._recording import RecordingError

P = ParamSpec("P")
T = TypeVar("T")
ARGUMENTS = {
    "supply": "supply_V",
    "supply-column": "supply",
    "speed-window": "speed_window_s",
    "speed-pulses": "speed_pulses_per_rev",
    "speed-period": "speed_period_s",
    "wheel-radius": "wheel_radius_m",
    "period": "period_s",
    "gap": "gap_s",
    "begin": "begin_s",
    "end": "end_s",
    "step": "step_V",
    "step-at": "step_at_s",
    "step-until": "step_until_s",
    "steady": "hold_s",
}
"""Arguments by the option that gives them, where they differ by more than their hyphens."""
_OPTION = re.compile("(?<![^ (])--([a-z]+(?:-[a-z]+)*)")


def in_own_words(function: Callable[P, T]) -> Callable[P, T]:
    """`function`, whose errors become `RecordingError`s that speak of arguments; `as_options` gives it back."""

    @functools.wraps(function)
    def wrapped(*args: P.args, **kwargs: P.kwargs) -> T:
        try:
            return function(*args, **kwargs)
        except JaxmotorError as error:
            raise RecordingError(of_arguments(str(error))) from None

    return wrapped


def as_options(function: Callable[P, T]) -> Callable[P, T]:
    """A `function` that is `in_own_words`, as the command line calls it: its errors speak of options."""
    return getattr(function, "__wrapped__")  # noqa: B009


def of_arguments(text: str, **own: str) -> str:
    """`text` with arguments in the place of options: `ARGUMENTS`, or the caller's `own`."""
    known = ARGUMENTS | {option.replace("_", "-"): name for option, name in own.items()}
    return _OPTION.sub(lambda option: known.get(option[1], option[1].replace("-", "_")), text)
