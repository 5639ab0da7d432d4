"""Motors and effects as they are written, with their numbers."""

import dataclasses
from typing import Any

import equinox as eqx
import jax
import numpy as np
from jax.core import Tracer


def readable(self: Any) -> str:
    """`self` as the call that makes it; scalars that are arrays to six digits, rows of numbers by
    their range, other arrays and tracers by their shapes."""
    values = {field.name: getattr(self, field.name, None) for field in dataclasses.fields(self)}
    return f"{type(self).__name__}({', '.join(f'{name}={_value(value)}' for name, value in values.items())})"


def _value(value: Any) -> str:
    number = isinstance(value, np.ndarray | np.generic | jax.Array) and not isinstance(value, Tracer)
    if number and np.ndim(value) == 0:
        return f"{float(value):.6g}"
    if number and np.ndim(value) == 1 and np.size(value) and np.isrealobj(value):
        return f"<{np.size(value)} from {float(np.min(value)):.4g} to {float(np.max(value)):.4g}>"
    if isinstance(value, tuple) and not hasattr(value, "_fields"):
        return f"({', '.join(map(_value, value))}{',' if len(value) == 1 else ''})"
    return repr(value) if isinstance(value, eqx.Module) else eqx.tree_pformat(value)
