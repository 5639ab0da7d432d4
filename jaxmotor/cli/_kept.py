"""Diagnoses that `jaxmotor diagnose` made, kept in the cache folder for `jaxmotor report` of the same recording.

One is found only under the same content of the recording, options, seed and versions, this package's files included.
"""

import contextlib
import functools
import hashlib
import json
import platform
import zlib
from collections.abc import Mapping
from importlib.metadata import version
from pathlib import Path
from typing import Any

import jaxmotor
from jaxmotor._cache import store, stored
from jaxmotor._plain_tree import from_plain, to_plain
from jaxmotor._runtime import cache_folder
from jaxmotor.diagnosis import Diagnosis
from jaxmotor.motor.effects import BUILT_IN, vocabulary
from jaxmotor.recording import Recording

MOST = 12
"""Diagnoses that are kept."""
SUFFIX = ".diagnosis"
DEFAULT: Mapping[str, Any] = {"effects": None, "exclude": []}
"""Options of a diagnosis that names no effects."""
DEPENDENCIES = ("jax", "jaxlib", "equinox", "optimistix", "numpy")


def keep_diagnosis(diagnosis: Diagnosis, recording: Recording, options: Mapping[str, Any]) -> None:
    """Keep what `diagnose(recording, **options)` gave, where there is a cache folder and the result is plain data."""
    with contextlib.suppress(TypeError):  # somebody else's classes
        path = _path(recording, options)
        if path is None:
            return
        store(path, zlib.compress(json.dumps(to_plain(diagnosis)).encode(), 1))
        _let_old_ones_go(path.parent)


def kept_diagnosis(recording: Recording, options: Mapping[str, Any]) -> tuple[Diagnosis, Path] | None:
    """What `keep_diagnosis` kept, and where; None where there is nothing, or not all of it."""
    with contextlib.suppress(TypeError, ValueError, LookupError, zlib.error):
        path = _path(recording, options)
        content = None if path is None else stored(path)
        if path is not None and content is not None:
            return from_plain(json.loads(zlib.decompress(content))), path
    return None


def _path(recording: Recording, options: Mapping[str, Any]) -> Path | None:
    folder = cache_folder()
    if folder is None or vocabulary() != BUILT_IN:  # a law of somebody else's may change without our knowing
        return None
    about = [to_plain(recording), sorted(options.items()), _program()]
    key = hashlib.sha256(json.dumps(about).encode()).hexdigest()[:32]
    return folder / f"{Path(recording.name).stem[:60]}-{key}{SUFFIX}"


@functools.cache
def _program() -> list[str]:
    """What numbers depend on beside the recording."""
    package = Path(jaxmotor.__file__).parent
    sources = hashlib.sha256()
    for path in sorted(package.rglob("*.py")):
        sources.update(path.relative_to(package).as_posix().encode() + b"\0" + path.read_bytes() + b"\0")
    return [sources.hexdigest(), platform.python_version(), platform.machine(), *map(version, DEPENDENCIES)]


def _let_old_ones_go(folder: Path) -> None:
    with contextlib.suppress(OSError):
        kept = sorted(folder.glob(f"*{SUFFIX}"), key=lambda path: path.stat().st_mtime)
        for path in kept[:-MOST]:
            path.unlink()
