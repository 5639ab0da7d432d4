"""The folders tell a story, measure -> estimate -> diagnose -> present, and imports only look back."""

import ast
import graphlib
import re
import subprocess
import sys
from pathlib import Path

import pytest

import jaxmotor

PACKAGE = Path(jaxmotor.__file__).parent
LAYERS = (
    *("recording", "bench", "motor", "prediction", "estimate", "validation", "control", "diagnosis"),
    *("fleet", "text", "present", "cli"),
)
LATE = {"__init__.py", "_shown.py"}
"""Names are fetched from their folder when they are asked for, and so is what draws a result."""
TESTED = {"docs", "firmware"}
"""Folders of tests beside those of the package."""
FIRMWARE = PACKAGE.parent / "firmware"
NUMPY_ONLY = {"recording", "bench"}
HEAVY = {"jax", "equinox", "optimistix", "lineax", "matplotlib", "scipy"}
OF_MATLAB = "_matlab.py"
"""Where SciPy is asked, when there is a file of MATLAB to read."""


def imported(path: Path) -> set[str]:
    names = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: imports are absolute"
            names.add(node.module or "")
            names |= {f"{node.module}.{alias.name}" for alias in node.names}
    return names


def needed(path: Path, files: set[str]) -> set[str]:
    """Of `files`; of a folder from which another file is imported, that file alone."""
    names = imported(path) & files
    return {name for name in names if not any(other.startswith(f"{name}._") for other in names)}


def circle(graph: dict[str, set[str]]) -> list[str]:
    """One circle among files, each after what needs it."""
    try:
        graphlib.TopologicalSorter(graph).prepare()
    except graphlib.CycleError as error:
        return error.args[1]
    return []


def layers_of(names: set[str]) -> set[str]:
    return {name.split(".")[1] for name in names if name.startswith("jaxmotor.")} & set(LAYERS)


@pytest.mark.parametrize("layer", LAYERS)
def test_imports_look_back(layer):
    for path in (PACKAGE / layer).rglob("*.py"):
        later = {name for name in layers_of(imported(path)) if LAYERS.index(name) > LAYERS.index(layer)}
        assert not later, f"{path} imports {later}, which come later in the story"


@pytest.mark.parametrize("layer", sorted(NUMPY_ONLY))
def test_measuring_needs_only_numpy(layer):
    for path in (PACKAGE / layer).rglob("*.py"):
        allowed = {"scipy"} if path.name == OF_MATLAB else set()
        assert not {name.split(".")[0] for name in imported(path)} & HEAVY - allowed, path


def test_every_folder_has_its_place():
    folders = {path.name for path in PACKAGE.iterdir() if path.is_dir() and (path / "__init__.py").exists()}
    assert folders <= set(LAYERS)


def test_tests_mirror_the_package():
    for folder in (path for path in Path(__file__).parent.rglob("*/") if any(path.glob("test_*.py"))):
        name = folder.relative_to(Path(__file__).parent)
        assert name.as_posix() in {".", *TESTED} or (PACKAGE / name).is_dir(), name


def test_no_file_needs_one_that_needs_it():
    of = {".".join(path.relative_to(PACKAGE.parent).with_suffix("").parts): path for path in PACKAGE.rglob("*.py")}
    of = {name.removesuffix(".__init__"): path for name, path in of.items()}
    graph = {name: needed(path, set(of)) - {name, "jaxmotor"} for name, path in of.items()}
    assert len(graph) > 250 and not circle(graph)


def test_only_what_is_fetched_late_is_imported_by_name():
    for path in PACKAGE.rglob("*.py"):
        by_name = re.search(r'import_module\(f?"jaxmotor', path.read_text())
        assert by_name is None or path.name in LATE, path


@pytest.mark.parametrize("folder", ["motor_rig", "emulator"])
def test_no_c_file_needs_one_that_needs_it(folder):
    """A `.c` with its header; the plant's parts are one."""
    graph: dict[str, set[str]] = {}
    for path in (FIRMWARE / folder).glob("*.[ch]"):
        names = re.findall(r'#include "([^"]+)"', path.read_text())
        subject = path.stem.partition("plant_")[0] or "plant"
        graph.setdefault(subject, set()).update(Path(name).stem.partition("plant_")[0] or "plant" for name in names)
    graph = {subject: needed - {subject} for subject, needed in graph.items()}
    assert sum(map(len, graph.values())) > 10 and not circle(graph)


def test_scipy_solves_and_integrates_for_fleets_only():
    """Elsewhere that is the tests' reference; its special functions and its linear algebra serve all."""
    for path in PACKAGE.rglob("*.py"):
        parts = {f"{name}.".split(".")[1] for name in imported(path) if name.split(".")[0] == "scipy"}
        allowed = {"io"} if path.name == OF_MATLAB else {"special", "linalg"}
        assert path.parent.name == "fleet" or parts <= allowed, path


def test_no_import_waits_for_scipy():
    """It takes a quarter of a second."""
    code = "import sys, jaxmotor.fleet, jaxmotor.present; sys.exit('scipy.special' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
