"""Double precision where it is needed, and only there."""

import functools
from collections.abc import Callable
from typing import Any, ParamSpec, TypeVar

import jax
import numpy as np

P = ParamSpec("P")
R = TypeVar("R")
T = TypeVar("T")


def in_float64(function: Callable[P, R]) -> Callable[P, R]:
    """Run `function` with JAX's 64-bit types on, whatever the program around it has set.

    Gain and pole are known to a few parts in a million and positions run to millions of counts:
    single precision would be the largest error. The setting of the caller's program is left as it was.
    """

    @functools.wraps(function)
    def wrapped(*args: P.args, **kwargs: P.kwargs) -> R:
        with jax.enable_x64(True):
            return function(*args, **kwargs)

    return wrapped


def to_numpy(tree: T) -> T:
    """`tree` with numpy arrays for leaves: a result keeps its 64 bits whatever the caller's program has set."""
    return jax.tree.map(np.asarray, tree)


def to_jax(tree: Any) -> Any:
    """`tree` with JAX arrays for leaves, in the precision that is on."""
    # Not by `jnp.asarray`, for which JAX compiles a program for each shape.
    return jax.device_put(jax.tree.map(np.asarray, tree))
