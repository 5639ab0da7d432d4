"""Double precision where it is needed, and only there; on the CPU, which is faster at it than a GPU for one motor."""

import contextlib
import functools
from collections.abc import Callable
from typing import Any, ParamSpec, TypeVar

import jax
import numpy as np

from jaxmotor._errors import JaxmotorError

NO_DEVICE = (RuntimeError, AssertionError)
"""What JAX raises for a platform that is not there; the second for one whose package is not installed."""

P = ParamSpec("P")
R = TypeVar("R")
T = TypeVar("T")


def in_float64(function: Callable[P, R]) -> Callable[P, R]:
    """Run `function` compiled, with JAX's 64-bit types on, and on `device()`, whatever the program around it has set.

    Gain and pole are known to a few parts in a million and positions run to millions of counts:
    single precision would be the largest error. Where nothing is compiled (`JAX_DISABLE_JIT`), simulations walk through
    their rows in Python. The settings of the caller's program are left as they were.
    """

    @functools.wraps(function)
    def wrapped(*args: P.args, **kwargs: P.kwargs) -> R:
        with jax.enable_x64(True), jax.disable_jit(False), jax.default_device(device()):
            return function(*args, **kwargs)

    return wrapped


@functools.cache
def device() -> Any:
    """Where the package computes: on the CPU, also where there is a GPU, unless `JAX_PLATFORMS` leaves the CPU out.

    A recording is simulated row after row, with little to do in each: a GPU takes five to ten times as long for a
    diagnosis (`benchmarks/devices.py`). What a caller puts into a program of its own runs where JAX puts that program.
    Raises JaxmotorError where JAX has no device of `JAX_PLATFORMS`.
    """
    with contextlib.suppress(*NO_DEVICE):
        return jax.local_devices(backend="cpu")[0]
    try:
        return jax.local_devices()[0]
    except NO_DEVICE as error:
        asked = jax.config.values["jax_platforms"]
        raise JaxmotorError(
            f"JAX finds no device of JAX_PLATFORMS={asked}; unset JAX_PLATFORMS, or set it to cpu"
        ) from error


def to_numpy(tree: T) -> T:
    """`tree` with numpy arrays for leaves: a result keeps its 64 bits whatever the caller's program has set."""
    return jax.tree.map(np.asarray, tree)


def to_jax(tree: Any) -> Any:
    """`tree` with JAX arrays for leaves, in the precision that is on."""
    # Not by `jnp.asarray`, for which JAX compiles a program for each shape.
    return jax.device_put(jax.tree.map(np.asarray, tree))
