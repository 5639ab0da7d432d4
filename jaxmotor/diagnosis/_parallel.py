"""Independent fits side by side: compiling and simulating leave Python's lock to others."""

import os
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

from jaxmotor._precision import in_float64

MOST = 4
"""Threads."""
Item = TypeVar("Item")
Result = TypeVar("Result")


def side_by_side(function: Callable[[Item], Result], items: Iterable[Item]) -> list[Result]:
    """`function` of each of `items`, in their order, on as many cores as there are (at most `MOST`)."""
    items = list(items)
    workers = min(MOST, os.cpu_count() or 1, len(items))
    if workers < 2:
        return [function(item) for item in items]
    with ThreadPoolExecutor(workers) as pool:
        # Which precision is in use is a matter of each thread.
        return list(pool.map(in_float64(function), items))
