"""Arguments held against what a function's signature says of them."""

import functools
import inspect
from collections.abc import Callable, Mapping, Sequence
from types import NoneType, UnionType
from typing import Any, ParamSpec, TypeVar, Union, get_args, get_origin, get_type_hints

import numpy as np

from jaxmotor._arguments import is_number
from jaxmotor._errors import JaxmotorError

P = ParamSpec("P")
T = TypeVar("T")
_WORDS: dict[Any, str] = {float: "number", int: "whole number", str: "text", np.ndarray: "array", Mapping: "dict"}


def of_kinds(function: Callable[P, T]) -> Callable[P, T]:
    """`function`, which **raises** a `JaxmotorError` for arguments (but `axes`) that its annotations do not allow."""

    @functools.wraps(function)
    def wrapped(*args: P.args, **kwargs: P.kwargs) -> T:
        hints = get_type_hints(function)
        for name, value in inspect.signature(function).bind(*args, **kwargs).arguments.items():
            if name != "axes" and not _allowed(value, hints[name]):
                raise JaxmotorError(f"{name} is no {_words(hints[name])}, but of type {type(value).__name__}")
        return function(*args, **kwargs)

    return wrapped


def _allowed(value: Any, hint: Any) -> bool:
    """What `hint` says, read as people mean it: any numbers, lists in the place of tuples and arrays."""
    kind, parts = get_origin(hint) or hint, get_args(hint)
    if _is_union(hint):
        return any(_allowed(value, part) for part in parts)
    if kind is float:
        return is_number(value)
    if kind is int:
        return isinstance(value, int | np.integer) and not isinstance(value, bool)
    if kind is np.ndarray:
        return isinstance(value, list | tuple) or hasattr(value, "__array__")
    if kind in (Sequence, tuple):
        return isinstance(value, list | tuple | np.ndarray) and all(_allowed(one, parts[0]) for one in value)
    if kind is Mapping:
        return isinstance(value, Mapping) and all(_allowed(one, parts[1]) for one in value.values())
    return isinstance(value, kind)


def _is_union(hint: Any) -> bool:
    return get_origin(hint) in (Union, UnionType)


def _words(hint: Any) -> str:
    parts = [part for part in get_args(hint) if part is not NoneType]
    if _is_union(hint):
        parts = [part for part in parts if part is not int or float not in parts]
        return " or ".join(map(_words, parts))
    kind = get_origin(hint) or hint
    if kind in (Sequence, tuple):
        return f"list of {_words(parts[0])}"
    name: str = kind.__name__
    return _WORDS.get(kind, name)
