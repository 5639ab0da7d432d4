"""JAX made ready for this package, before it computes anything."""

import contextlib
import functools
import glob
import os
import re
import sys
import warnings
from pathlib import Path
from typing import Any

WHOLE_LOOPS = "--xla_backend_extra_options=xla_cpu_small_while_loop_byte_threshold=100000000"
"""XLA makes a loop on the CPU one piece of machine code only where it moves few bytes, and else walks through its parts
in every pass. A simulation is a loop with little to do in each: as one piece it takes two thirds of the time, or half.
Versions that do not know the option pass over it."""

_CACHE_WARNING = re.compile(r"Error (?:reading|writing) persistent compilation cache entry for '([^']*)'")


def keep_programs(threads: bool = True) -> None:
    """Make what follows as fast as on the command line: for scripts and notebooks, to be called first of all.

    Compiled programs are kept in the user's cache folder (`$JAXMOTOR_CACHE` names another, an empty value none), loops
    are compiled whole, numpy's products are computed by the thread that asks for them, and with `threads` fits run side
    by side. These are settings of the whole process: `XLA_FLAGS` and `OPENBLAS_NUM_THREADS`, unless something like them
    is set, numpy's, and three of JAX's. Once JAX has computed something, it has read the first.
    """
    _let_products_alone()
    flags = os.environ.get("XLA_FLAGS", "")
    if "xla_backend_extra_options" not in flags:
        os.environ["XLA_FLAGS"] = f"{flags} {WHOLE_LOOPS}".strip()
    _use_compilation_cache()
    if threads:
        _let_threads_compute()


def _let_products_alone() -> None:
    """Threads that share a product of small matrices wait for each other in a loop that takes a core each. On cores
    that have other work, too, a product of one millisecond so takes two hundred."""
    if "OPENBLAS_NUM_THREADS" in os.environ:
        return
    os.environ["OPENBLAS_NUM_THREADS"] = "1"  # for what is yet to be loaded
    if "numpy" in sys.modules:
        import threadpoolctl

        threadpoolctl.threadpool_limits(1, user_api="blas")


def _use_compilation_cache() -> None:
    """Keep compiled programs in the cache folder; where there is none each run compiles."""
    folder = cache_folder()
    if folder is None:
        return
    import jax

    _let_damaged_entries_go(folder)
    jax.config.update("jax_compilation_cache_dir", str(folder))
    jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.0)
    jax.config.update("jax_persistent_cache_min_entry_size_bytes", -1)


def cache_folder() -> Path | None:
    """`$JAXMOTOR_CACHE`, or the user's; None where the value is empty, or the folder cannot be written."""
    folder = os.environ.get("JAXMOTOR_CACHE", str(_cache_home() / "jaxmotor"))
    return Path(folder) if folder and _writable(Path(folder)) else None


@functools.cache
def _let_damaged_entries_go(folder: Path) -> None:
    """JAX compiles what it cannot read from the cache, leaves it there, and warns of it in every run from then on.

    A full disk, or a process that was killed as it wrote, leaves such an entry. It is deleted instead, without a word:
    the next run writes it anew.
    """
    show = warnings.showwarning

    def showwarning(message: Warning | str, *about: Any, **more: Any) -> None:
        if (found := _CACHE_WARNING.match(str(message))) is None:
            show(message, *about, **more)
            return
        for entry in folder.glob(f"{glob.escape(found[1])}-*"):
            with contextlib.suppress(OSError):
                entry.unlink()

    warnings.showwarning = showwarning


def _let_threads_compute() -> None:
    """JAX's own queue runs one program after the other, on however many cores."""
    import jax

    if "jax_cpu_enable_async_dispatch" in jax.config.values:
        jax.config.update("jax_cpu_enable_async_dispatch", False)


def _writable(folder: Path) -> bool:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        return False
    return os.access(folder, os.W_OK | os.X_OK)


def _cache_home() -> Path:
    if os.environ.get("XDG_CACHE_HOME"):
        return Path(os.environ["XDG_CACHE_HOME"])
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA", Path.home() / "AppData" / "Local"))
    return Path.home() / ("Library/Caches" if sys.platform == "darwin" else ".cache")
