"""JAX made ready for a command: compiled programs are kept between runs."""

import os
import sys
from pathlib import Path


def use_compilation_cache() -> None:
    """Keep compiled programs in `$JAXMOTOR_CACHE`, or the user's cache folder; an empty value keeps none.

    Where the folder cannot be written nothing is kept, and each run compiles.
    """
    folder = os.environ.get("JAXMOTOR_CACHE", str(_cache_home() / "jaxmotor"))
    if not folder or not _writable(Path(folder)):
        return
    import jax

    jax.config.update("jax_compilation_cache_dir", folder)
    jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.0)
    jax.config.update("jax_persistent_cache_min_entry_size_bytes", -1)


def let_threads_compute() -> None:
    """Programs run in the threads that call them. JAX's own queue runs one after the other, on however many cores.

    To be called before anything is computed.
    """
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
