"""Independent fits side by side: compiling and simulating leave Python's lock to others."""

import os
import threading
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

from jaxmotor._precision import in_float64

MOST = 4
"""Threads."""
NAMED = "side by side"
"""How the threads' names begin."""
Item = TypeVar("Item")
Result = TypeVar("Result")


def side_by_side(function: Callable[[Item], Result], items: Iterable[Item]) -> list[Result]:
    """`function` of each of `items`, in their order, on as many cores as there are (at most `MOST`).

    Within one of several that run already they run one after the other: there is no core left for them.
    """
    items = list(items)
    workers = min(MOST, os.cpu_count() or 1, len(items))
    if workers < 2 or threading.current_thread().name.startswith(NAMED):
        return [function(item) for item in items]
    with ThreadPoolExecutor(workers, NAMED) as pool:
        # Which precision is in use is a matter of each thread.
        return list(pool.map(in_float64(function), items))
