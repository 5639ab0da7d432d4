"""Arguments as people give them: a path in the place of what it holds, a name out of a few; anything else is told."""

import math
import os
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from jaxmotor._errors import JaxmotorError
from jaxmotor._sentences import one_of, shown

T = TypeVar("T")


def taken(given: Any, kind: type[T], wanted: str, read: Callable[[str | os.PathLike[str]], T] | None = None) -> T:
    """`given`, or what `read` makes of it where it is a path. **Raises:** `JaxmotorError` for anything else."""
    if isinstance(given, kind):
        return given
    if read is not None and isinstance(given, str | os.PathLike):
        return read(given)
    raise JaxmotorError(f"{type(given).__name__} is not {wanted}")


def path_of(given: Any, wanted: str) -> Path:
    """`given` as a path. **Raises:** `JaxmotorError` where it is none; `wanted` says of what."""
    return taken(given, Path, wanted, Path)


def check_text(name: str, given: Any) -> None:
    """**Raises:** `JaxmotorError` where `given` is no text, or an empty one."""
    if not isinstance(given, str) or not given:
        raise JaxmotorError(f"{name} is {shown(given)}; give a text")


def check_choice(name: str, given: Any, choices: Iterable[str]) -> None:
    """**Raises:** `JaxmotorError` where `given` is none of `choices`."""
    choices = tuple(choices)
    if not isinstance(given, str) or given not in choices:
        raise JaxmotorError(f"{name} is {shown(given)}, which is not known; it is one of {one_of(choices, given)}")


def check_whole(name: str, given: Any) -> None:
    """**Raises:** `JaxmotorError` where `given` is no whole number from 0 to 2³² - 1."""
    if isinstance(given, bool) or not isinstance(given, int | np.integer) or not 0 <= given < 2**32:
        raise JaxmotorError(f"{name} is {shown(given)}; give a whole number, 0 or more")


def is_number(given: Any) -> bool:
    """`given` is one real number, also one of numpy or JAX; a truth value is none."""
    if getattr(given, "ndim", None) == 0:
        return np.dtype(given.dtype).kind in "iuf"
    return isinstance(given, int | float) and not isinstance(given, bool)


def check_number(name: str, given: Any) -> None:
    """**Raises:** `JaxmotorError` where `given` is no number."""
    if not is_number(given):
        raise JaxmotorError(f"{name} is {shown(given)}; give a number")


def check_positive(name: str, given: Any, remedy: str = "") -> None:
    """**Raises:** `JaxmotorError`, with a `remedy`, where `given` is neither None nor a positive, finite number."""
    if given is None:
        return
    check_number(name, given)
    if not 0 < given < math.inf:
        raise JaxmotorError(f"{name} = {given:g} is not positive{remedy}")
