"""Programs that start fast: what JAX traced and XLA compiled is kept on disk, and loaded without either.

JAX's compilation cache saves the compiler's time but not that of tracing and lowering, which is most of a second run.
Where a compilation cache is set, programs go into the same folder: machine code, as JAX's own cache holds, for the
user who wrote it and nobody else.
"""

import contextlib
import functools
import hashlib
import json
import os
import platform
import secrets
import threading
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.core import Tracer
from jax.experimental import serialize_executable

from jaxmotor._cache import store, stored
from jaxmotor._precision import device, in_float64

Arrays = dict[str, jax.Array]
Call = Callable[[list[Any]], Arrays]
PACKAGE = Path(__file__).parent
MOST = 96
"""Programs that a process keeps; more come from the disk again."""
PLAIN = (tuple, list, dict, type(None))
KNOWN = ("jaxmotor", "jax", "equinox")
"""Packages whose classes programs on the disk may hold, beside what is `PLAIN`."""


class Program:
    """A function of PyTrees, jitted; it returns arrays by name. Leaves that are no arrays choose the program."""

    __wrapped__: Callable[..., Arrays]

    def __init__(self, function: Callable[..., Arrays], brief: bool):
        self._function, self._brief, self._jitted = function, brief, eqx.filter_jit(function)
        functools.update_wrapper(self, function)

    def __call__(self, *arguments: Any) -> Arrays:
        found = self.ready(*arguments)
        return self._jitted(*arguments) if found is None else found[0](found[1])

    def ready(self, *arguments: Any) -> tuple[Call, list[Any]] | None:
        """The compiled program, and what it takes of `arguments`, the arrays among their leaves in their order; None
        within another program."""
        function, folder = self._function, jax.config.values["jax_compilation_cache_dir"]
        every, tree = jax.tree.flatten(arguments)
        leaves = [leaf for leaf in every if _is_array(leaf)]
        if any(isinstance(leaf, Tracer) for leaf in leaves):
            return None
        # None is no leaf of a tree: here it stands for an array.
        static = tuple(None if _is_array(leaf) else leaf for leaf in every)
        shapes = tuple((leaf.shape, leaf.dtype) for leaf in leaves)
        # Compared as it is, not printed: printing a large tree takes longer than running its program.
        about = (function, folder, tree, static, shapes, jnp.result_type(float))

        def made() -> Call:
            def flat(leaves: list[Any]) -> Arrays:
                rest = iter(leaves)
                every = [next(rest) if leaf is None else leaf for leaf in static]
                return function(*jax.tree.unflatten(tree, every))

            if folder is None or not _is_ours(tree):
                return _lowered(flat, leaves).compile(compiler_options=_quickly(self._brief))
            path = Path(folder) / f"{function.__name__}-{_key(function, static, tree, leaves)}.program"
            return _loaded(path, leaves) or _compiled(path, flat, leaves, self._brief)

        return _recent.get(about, made), leaves


def program(function: Callable[..., Arrays], *, brief: bool = False) -> Program:
    """`function` as a `Program`.

    One that is `brief` runs for milliseconds and seldom: what the compiler could gain takes longer than it saves.
    """
    return Program(function, brief)


def compile_ahead(called: Program, arguments: Callable[[], tuple[Any, ...]]) -> None:
    """Compile the `program` for arrays like those that `arguments` gives, in a thread of its own, while something else
    is computed."""

    def ready() -> None:
        with contextlib.suppress(Exception):  # whoever calls the program will see it
            called.ready(*arguments())

    threading.Thread(target=in_float64(ready)).start()


class _Recent:
    """The programs that were used last: a machine's memory for compiled code is not endless."""

    def __init__(self) -> None:
        self.lock = threading.Lock()
        self.known: dict[Any, Call] = {}
        """By use, the latest last."""
        self.making: dict[Any, threading.Lock] = {}

    def get(self, about: Any, make: Callable[[], Call]) -> Call:
        """The program, which `make` makes where it is not known: once, however many threads ask for it."""
        with self.lock:
            making = self.making.setdefault(about, threading.Lock())
        with making:
            called = self.known.get(about) or make()
            with self.lock:
                self.known.pop(about, None)
                self.known[about] = called
                if len(self.known) > MOST:
                    oldest = next(iter(self.known))
                    del self.known[oldest]
                    self.making.pop(oldest, None)
        return called


_recent = _Recent()


def _is_array(leaf: Any) -> bool:
    return isinstance(leaf, jax.Array | np.ndarray)


def _compiled(path: Path, flat: Call, leaves: list[Any], brief: bool) -> Call:
    """`flat`, compiled for `leaves`, and kept in `path`."""
    # A program that comes from JAX's own cache cannot be stored a second time; under a new name it is not found there.
    flat.__name__ = f"program_{secrets.token_hex(8)}"
    lowered = _lowered(flat, leaves)
    compiled = lowered.compile(compiler_options=_quickly(brief))
    with contextlib.suppress(OSError):
        for copy in path.parent.glob(f"jit_{flat.__name__}-*"):
            copy.unlink()
    # Kinds of devices whose programs cannot be stored say so in one of these ways; JAX's own errors are RuntimeErrors.
    with contextlib.suppress(ValueError, RuntimeError):
        code, _, results = serialize_executable.serialize(compiled)
        names = sorted(jax.tree.unflatten(results, range(results.num_leaves)))
        about = {"names": names, "lapack": "lapack" in lowered.as_text()}
        store(path, json.dumps(about).encode() + b"\n" + code)
    return compiled


def _lowered(flat: Call, leaves: list[Any]) -> jax.stages.Lowered:
    with jax.default_device(device()):
        return jax.jit(flat, keep_unused=True).lower(leaves)


def _loaded(path: Path, leaves: list[Any]) -> Call | None:
    """What `_compiled` kept in `path`; None where there is nothing that is whole and that this machine can run."""
    kept = stored(path)
    if kept is None:
        return None
    head, _, code = kept.partition(b"\n")
    about = json.loads(head)
    if about["lapack"]:
        _register_lapack()
    given, results = jax.tree.structure(((leaves,), {})), jax.tree.structure(dict.fromkeys(about["names"], 0))
    try:
        return serialize_executable.deserialize_and_load(code, given, results, execution_devices=[device()])
    except Exception:  # whatever stands in the way, compiling again is the answer
        return None


def _register_lapack() -> None:
    """JAX makes LAPACK known to compiled programs only while it lowers one that calls it."""
    jax.jit(jnp.linalg.cholesky).lower(jax.ShapeDtypeStruct((1, 1), jnp.result_type(float)))


def _quickly(brief: bool = False) -> dict[str, Any]:
    """Options with which XLA compiles these programs in half of the time on a CPU; they run a quarter faster, too.

    Its newer way to compile fusions takes twice as long. Of LLVM's passes the last ones gain nothing here, and parts
    compiled side by side repeat work while other programs wait. Vectors are as wide as the processor has them.
    `brief` programs get none of LLVM's passes: compiled in two fifths of the time, they run two to four times as long.
    XLA refuses options that it does not know, so only versions that were tried are asked.
    """
    tried = device().platform == "cpu" and jax.__version_info__[:2] <= (0, 10)
    options = {
        "xla_cpu_use_fusion_emitters": False,
        "xla_backend_optimization_level": 0 if brief else 1,
        "xla_cpu_parallel_codegen_split_count": 1,
        "xla_cpu_prefer_vector_width": 512,
    }
    return options if tried else {}


def _key(function: Callable[..., Arrays], static: Any, tree: Any, leaves: list[Any]) -> str:
    shapes = [(leaf.shape, str(leaf.dtype)) for leaf in leaves]
    about = (function.__module__, str(tree), str(static), shapes, np.dtype(jnp.result_type(float)))
    return hashlib.sha256(repr((*about, _machine(), _sources())).encode()).hexdigest()[:32]


def _is_ours(tree: Any) -> bool:
    """All classes in `tree` are of known sources. A program with the law of somebody else's would outlive a change of
    that law: only JAX's own cache, which knows what was lowered, keeps it."""
    about = tree.node_data()
    known = about is None or about[0] in PLAIN or about[0].__module__.partition(".")[0] in KNOWN
    return known and all(map(_is_ours, tree.children()))


@functools.cache
def _machine() -> str:
    """What the machine code is for: the kind of processor with all that it can do, or of accelerator; and how it is
    compiled."""
    flags = os.environ.get("XLA_FLAGS", "")
    about = [platform.machine(), flags, device().platform, device().device_kind]
    with contextlib.suppress(OSError):
        lines = Path("/proc/cpuinfo").read_text(errors="replace").splitlines()
        about += [line for line in lines if line.startswith(("flags", "Features"))][:1]
    return repr(about)


@functools.cache
def _sources() -> str:
    """Of which version the program is: JAX's, and what this package's files say, wherever they are installed."""
    layers = ("motor", "prediction", "estimate", "validation", "diagnosis", "fleet")
    digest = hashlib.sha256()
    for path in (path for layer in layers for path in sorted((PACKAGE / layer).rglob("*.py"))):
        digest.update(path.name.encode() + path.read_bytes())
    return repr((jax.__version__, version("jaxlib"), digest.hexdigest()))
