"""Programs that start fast: what JAX traced is kept on disk beside what it compiled.

JAX's compilation cache saves the compiler's time but not that of tracing and lowering, which is most of a second run.
Where a compilation cache is set, a program's exported form goes into the same folder and is called from there.
"""

import contextlib
import functools
import hashlib
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax import export

from jaxmotor._errors import JaxmotorError
from jaxmotor._files import replacing

Arrays = dict[str, jax.Array]
PACKAGE = Path(__file__).parent
MOST = 96
"""Programs of one function that a process keeps; more come from the disk again."""
DIGEST = hashlib.sha256().digest_size
# Calls of LAPACK that JAX does not promise to keep from one version to the next; the key names the version.
UNPROMISED = [export.DisabledSafetyCheck.custom_call(f"lapack_{kind}ormqr_ffi") for kind in "sd"]


def program(function: Callable[..., Arrays]) -> Callable[..., Arrays]:
    """`function` of PyTrees, jitted; it returns arrays by name. Leaves that are no arrays choose the program."""
    jitted = eqx.filter_jit(function)

    @functools.wraps(function)
    def call(*arguments: Any) -> Arrays:
        folder = jax.config.values["jax_compilation_cache_dir"]
        if folder is None:
            return jitted(*arguments)
        dynamic, static = eqx.partition(arguments, eqx.is_array)
        leaves, tree = jax.tree.flatten(dynamic)
        chosen, choices = jax.tree.flatten(static)
        shapes = tuple((leaf.shape, leaf.dtype) for leaf in leaves)
        # Compared as it is, not printed: printing a large tree takes longer than running its program.
        about = (folder, tree, choices, tuple(chosen), shapes, jnp.result_type(float), jax.default_backend())
        with lock:
            called = known.pop(about, None)
            if called is not None:
                known[about] = called
        if called is None:
            path = Path(folder) / f"{function.__name__}-{_key(function, static, tree, leaves)}.traced"

            def flat(leaves: list[Any]) -> Arrays:
                return function(*eqx.combine(jax.tree.unflatten(tree, leaves), static))

            called = _called(path, flat, leaves)
            with lock:
                known[about] = called
                # The machine's memory for compiled code is not endless.
                dropped = known.pop(next(iter(known))) if len(known) > MOST else None
            if dropped is not None:
                dropped.clear_cache()
        return called(leaves)

    lock = threading.Lock()
    known: dict[Any, Any] = {}
    """By use, the latest last."""
    return call


def _called(path: Path, flat: Callable[[list[Any]], Arrays], leaves: list[Any]) -> Any:
    """The exported form in `path`, made first where there is none that is whole."""
    stored = _stored(path)
    if stored is None:
        exported = export.export(jax.jit(flat), disabled_checks=UNPROMISED)(leaves)
        _store(path, bytes(exported.serialize()))
    else:
        exported = export.deserialize(bytearray(stored))
    return jax.jit(exported.call, compiler_options=_quickly())


def _quickly() -> dict[str, Any]:
    """XLA's newer way to compile fusions takes twice as long and makes these programs a tenth faster.

    It refuses options that it does not know, so only versions that were tried are asked.
    """
    tried = jax.default_backend() == "cpu" and jax.__version_info__[:2] <= (0, 10)
    return {"xla_cpu_use_fusion_emitters": False} if tried else {}


def _stored(path: Path) -> bytes | None:
    """What `_store` put into `path`; None where there is nothing, or not all of it."""
    try:
        content = path.read_bytes()
    except OSError:
        return None
    digest, stored = content[:DIGEST], content[DIGEST:]
    return stored if hashlib.sha256(stored).digest() == digest else None


def _store(path: Path, exported: bytes) -> None:
    """Keep `exported` with its digest. A cache that cannot be written costs time on the next run, nothing else."""
    with contextlib.suppress(OSError, JaxmotorError):
        path.parent.mkdir(parents=True, exist_ok=True)
        with replacing(path) as part:
            part.write_bytes(hashlib.sha256(exported).digest() + exported)


def _key(function: Callable[..., Arrays], static: Any, tree: Any, leaves: list[Any]) -> str:
    shapes = [(leaf.shape, str(leaf.dtype)) for leaf in leaves]
    about = (
        function.__module__,
        str(tree),
        str(static),
        shapes,
        np.dtype(jnp.result_type(float)),
        jax.default_backend(),
    )
    return hashlib.sha256(repr((*about, _sources())).encode()).hexdigest()[:32]


@functools.cache
def _sources() -> str:
    """Of which version the program is: JAX's, and this package's files."""
    layers = ("motor", "estimate", "diagnosis", "fleet")
    files = [path for layer in layers for path in sorted((PACKAGE / layer).rglob("*.py"))]
    stamps = [(path.name, path.stat().st_mtime_ns, path.stat().st_size) for path in files]
    return repr((jax.__version__, stamps))
