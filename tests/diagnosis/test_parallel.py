"""Fits side by side: as many as there are cores, and no more within them."""

import threading
import time

import jax.numpy as jnp
import numpy as np

from jaxmotor.diagnosis import _parallel
from jaxmotor.diagnosis._parallel import side_by_side


def test_results_are_in_the_order_of_their_items(monkeypatch):
    monkeypatch.setattr(_parallel.os, "cpu_count", lambda: 4)

    def slow(wait_s: float) -> float:
        time.sleep(wait_s)
        return 2 * wait_s

    items = [0.03, 0.0, 0.02, 0.01]
    assert side_by_side(slow, items) == [2 * one for one in items]


def test_within_one_of_several_fits_others_run_one_after_the_other(monkeypatch):
    monkeypatch.setattr(_parallel.os, "cpu_count", lambda: 3)
    together, most, lock = [0], [0], threading.Lock()

    def inner(_: int) -> str:
        with lock:
            together[0] += 1
            most[0] = max(most[0], together[0])
        time.sleep(0.01)
        with lock:
            together[0] -= 1
        return threading.current_thread().name

    outer = side_by_side(lambda _: side_by_side(inner, range(4)), range(3))
    assert all(len(set(names)) == 1 for names in outer)
    assert most[0] <= 3
    # Of one item alone the cores are free.
    [names] = side_by_side(lambda _: side_by_side(inner, range(12)), [0])
    assert len(set(names)) > 1


def test_threads_compute_in_double_precision(x64):
    assert {one.dtype for one in side_by_side(jnp.ones, [1, 2, 3])} == {np.dtype(float)}
