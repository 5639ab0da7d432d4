"""Parts of a data set done by the workers of a Dask cluster.

A worker is sent a part's place, not its data, and writes the results itself, whole or not at all: a part that is done
twice because a worker was lost is written twice to the same name. Dask gives a lost worker's parts to others.
"""

import contextlib
import functools
import os
import platform
from collections.abc import Callable, Iterator, Sequence
from importlib import metadata
from typing import Any

from jaxmotor._errors import JaxmotorError
from jaxmotor.fleet._extra import needs

CONNECT_S = 10.0
"""For which an answer of a scheduler is waited for."""
LOSSES = 10
"""Workers that may be lost under one part before it is given up."""
COMPARED = ("jaxmotor", "jax", "numpy", "pyarrow", "distributed")


def on_cluster(
    tasks: Sequence[Any], do: Callable[[Any], tuple[int, int, int]], address: str, workers: int | None
) -> Iterator[tuple[int, int, int]]:
    """`do(task)` of each of `tasks` as they are done, on the cluster at `address` or, for "local", on this machine.

    **Raises:** `JaxmotorError` where there is no such scheduler, it has no workers, or their versions differ.
    """
    distributed = needs("distributed")
    with contextlib.ExitStack() as opened:
        client = opened.enter_context(_local(distributed, workers) if address == "local" else _at(distributed, address))
        check_versions(versions(), client.run(versions))
        # Nothing is pure here: a key of its own for each run, else the scheduler hands out an older run's word.
        run = functools.partial(_as_here, _compiling(), do) if address == "local" else do
        futures = client.map(run, list(tasks), pure=False, retries=LOSSES)
        for future in distributed.as_completed(futures):
            yield _result(future)


def _result(future: Any) -> tuple[int, int, int]:
    try:
        return future.result()
    except JaxmotorError:
        raise
    except Exception as error:
        raise JaxmotorError(
            f"the cluster gave a part up ({type(error).__name__}: {str(error)[:200]}); what is done is kept: "
            "look at the workers' memory and logs, and start again"
        ) from error


@contextlib.contextmanager
def _local(distributed: Any, workers: int | None) -> Iterator[Any]:
    dask = needs("dask")
    number = workers or len(os.sched_getaffinity(0))
    settings = {"distributed.scheduler.allowed-failures": LOSSES, "distributed.worker.daemon": True}
    with (
        dask.config.set(settings),
        distributed.LocalCluster(
            n_workers=number, threads_per_worker=1, dashboard_address=None, silence_logs=50
        ) as cluster,
        distributed.Client(cluster) as client,
    ):
        client.wait_for_workers(number, timeout=120)
        yield client


def _compiling() -> dict[str, Any]:
    """Settings with which a worker on this machine finds what this program has compiled."""
    folder = needs("jax").config.values["jax_compilation_cache_dir"]
    always = {"jax_persistent_cache_min_compile_time_secs": 0.0, "jax_persistent_cache_min_entry_size_bytes": -1}
    return {"jax_compilation_cache_dir": folder} | ({} if folder is None else always)


def _as_here(settings: dict[str, Any], do: Callable[[Any], tuple[int, int, int]], task: Any) -> tuple[int, int, int]:
    """`do(task)` on a worker with JAX's `settings`.

    Variables of the environment would come too late where the worker's main module, which is the caller's, imports JAX;
    and what is compiled without a folder to keep it differs in the last digits (`_programs`).
    """
    config = needs("jax").config
    for name, value in settings.items():
        config.update(name, value)
    return do(task)


@contextlib.contextmanager
def _at(distributed: Any, address: str) -> Iterator[Any]:
    try:
        client = distributed.Client(address, timeout=CONNECT_S)
    except (OSError, ValueError, TypeError, TimeoutError) as error:
        raise JaxmotorError(
            f"{address}: no Dask scheduler answers there within {CONNECT_S:.0f} s; start one with `dask scheduler` and "
            "`dask worker`, check the address (tcp://HOST:8786), or use --cluster local"
        ) from error
    with client:
        if not client.scheduler_info()["workers"]:
            raise JaxmotorError(f"{address}: the scheduler has no workers; start some with `dask worker {address}`")
        yield client


def versions() -> dict[str, str]:
    """Of what must be the same here and on the workers."""
    found = {"python": ".".join(platform.python_version_tuple()[:2])}
    for package in COMPARED:
        try:
            found[package] = metadata.version(package)
        except metadata.PackageNotFoundError:
            found[package] = "none"
    return found


def check_versions(here: dict[str, str], workers: dict[str, dict[str, str]]) -> None:
    """**Raises:** `JaxmotorError` where a worker's versions differ from those `here`."""
    for address, there in workers.items():
        for package, version in here.items():
            if there.get(package, "none") != version:
                raise JaxmotorError(
                    f"worker {address} has {package} {there.get(package, 'none')}, here it is {version}: results would "
                    "depend on who made them; install the same versions"
                )
