"""The folders tell a story, measure -> estimate -> diagnose -> present, and imports only look back."""

import ast
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
DRAWS = {"diagnosis/_diagnosis.py": {"present"}}
"""A diagnosis draws itself when asked, by what comes later in the story."""
NUMPY_ONLY = {"recording", "bench"}
HEAVY = {"jax", "equinox", "optimistix", "lineax", "matplotlib", "scipy"}


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


def layers_of(names: set[str]) -> set[str]:
    return {name.split(".")[1] for name in names if name.startswith("jaxmotor.")} & set(LAYERS)


@pytest.mark.parametrize("layer", LAYERS)
def test_imports_look_back(layer):
    for path in (PACKAGE / layer).rglob("*.py"):
        later = {name for name in layers_of(imported(path)) if LAYERS.index(name) > LAYERS.index(layer)}
        later -= DRAWS.get(path.relative_to(PACKAGE).as_posix(), set())
        assert not later, f"{path} imports {later}, which come later in the story"


@pytest.mark.parametrize("layer", sorted(NUMPY_ONLY))
def test_measuring_needs_only_numpy(layer):
    for path in (PACKAGE / layer).rglob("*.py"):
        assert not {name.split(".")[0] for name in imported(path)} & HEAVY, path


def test_every_folder_has_its_place():
    folders = {path.name for path in PACKAGE.iterdir() if path.is_dir() and (path / "__init__.py").exists()}
    assert folders <= set(LAYERS)


def test_scipy_solves_and_integrates_for_fleets_only():
    """Elsewhere that is the tests' reference; its special functions and its linear algebra serve all."""
    for path in PACKAGE.rglob("*.py"):
        parts = {f"{name}.".split(".")[1] for name in imported(path) if name.split(".")[0] == "scipy"}
        assert path.parent.name == "fleet" or parts <= {"special", "linalg"}, path


def test_no_import_waits_for_scipy():
    """It takes a quarter of a second."""
    code = "import sys, jaxmotor.fleet, jaxmotor.present; sys.exit('scipy.special' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
