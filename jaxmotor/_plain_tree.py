"""Results as plain data, and back: classes of this package by name with their fields, arrays by their bytes.

Nothing that is read can run code: a class is looked up among this package's dataclasses and named tuples that are
loaded, and given its fields.
"""

import base64
import dataclasses
import sys
from collections.abc import Mapping
from typing import Any

import jax
import numpy as np

from jaxmotor._precision import in_float64, to_jax

PACKAGE = __name__.partition(".")[0]
SEQUENCES = {kind.__name__: kind for kind in (tuple, list, frozenset)}


def to_plain(node: Any) -> Any:
    """`node` as what JSON holds, NaN and infinity beside numbers.

    **Raises:** `TypeError` where a part of it is of a class that is not this package's, and no plain data.
    """
    if isinstance(node, np.bool_ | np.integer):
        return node.item()
    if node is None or isinstance(node, str | bool | int | float):
        return node
    if isinstance(node, np.ndarray | jax.Array):
        return _bytes(np.asarray(node)) | {"jax": isinstance(node, jax.Array)}
    if isinstance(node, Mapping):
        return {"dict": [[to_plain(key), to_plain(value)] for key, value in node.items()]}
    if (names := _fields(type(node))) is not None:
        return {"class": _name(type(node)), "fields": [to_plain(getattr(node, name)) for name in names]}
    if type(node) in SEQUENCES.values():
        return {type(node).__name__: [to_plain(one) for one in node]}
    raise TypeError(f"{type(node)} is no plain data")


@in_float64
def from_plain(plain: Any) -> Any:
    """What `to_plain` was given. **Raises:** `ValueError` for anything else."""
    if not isinstance(plain, dict):
        return plain
    if "array" in plain:
        array = np.frombuffer(base64.b64decode(plain["array"]), plain["dtype"]).reshape(plain["shape"]).copy()
        return to_jax(array) if plain["jax"] else array
    if "dict" in plain:
        return {from_plain(key): from_plain(value) for key, value in plain["dict"]}
    if "class" in plain:
        return _made(_class(plain["class"]), [from_plain(field) for field in plain["fields"]])
    [(name, items)] = plain.items()
    return SEQUENCES[name](map(from_plain, items))


def _bytes(array: np.ndarray) -> dict[str, Any]:
    if array.dtype.hasobject:
        raise TypeError("an array of objects is no plain data")
    return {
        "array": base64.b64encode(array.tobytes()).decode(),
        "dtype": array.dtype.str,
        "shape": list(array.shape),
    }


def _made(kind: type, values: list[Any]) -> Any:
    """As JAX makes a node of a tree: what a constructor would do to `values` has been done."""
    if issubclass(kind, tuple):
        return kind._make(values)  # pyright: ignore[reportAttributeAccessIssue]
    made = object.__new__(kind)
    for name, value in zip(_fields(kind) or (), values, strict=True):
        object.__setattr__(made, name, value)
    return made


def _fields(kind: type) -> tuple[str, ...] | None:
    """Of a dataclass or named tuple of this package."""
    if kind.__module__.partition(".")[0] != PACKAGE:
        return None
    return tuple(field.name for field in dataclasses.fields(kind)) if dataclasses.is_dataclass(kind) else _named(kind)


def _named(kind: type) -> tuple[str, ...] | None:
    return getattr(kind, "_fields", None) if issubclass(kind, tuple) else None


def _name(kind: type) -> str:
    return f"{kind.__module__}:{kind.__name__}"


def _class(name: str) -> type:
    module, _, own = name.partition(":")
    kind = getattr(sys.modules.get(module), own, None)
    if not isinstance(kind, type) or _fields(kind) is None or _name(kind) != name:
        raise ValueError(f"{name} is no class of results")
    return kind
