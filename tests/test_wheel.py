"""The wheel in a bare environment: with what it declares that it needs, and neither compiler nor sources."""

import importlib.metadata
import json
import os
import subprocess
import sys
import venv
import zipfile
from pathlib import Path

import jax
import pytest
from packaging.requirements import Requirement

ROOT = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    folder = tmp_path_factory.mktemp("wheel")
    command = [sys.executable, "-m", "pip", "wheel", "--no-deps", "--quiet", "--wheel-dir", folder, ROOT]
    built = subprocess.run(command, capture_output=True, text=True, check=False)
    if "No matching distribution found for hatchling" in built.stderr:
        pytest.skip("the wheel's builder, hatchling, cannot be installed: there is no package index")
    assert built.returncode == 0, built.stderr
    [path] = folder.glob("*.whl")
    return path


def needed(root):
    """Names of the installed distributions that `root` declares that it needs, and those that they need."""
    found, asked = set(), [(root, "")]
    while asked:
        distribution, extra = asked.pop()
        for one in map(Requirement, distribution.requires or ()):
            if one.marker is None or one.marker.evaluate({"extra": extra}):
                wanted = {(one.name, chosen) for chosen in ("", *one.extras)} - found
                asked += [(importlib.metadata.distribution(name), chosen) for name, chosen in wanted]
                found |= wanted
    return sorted({name for name, _ in found})


@pytest.fixture(scope="module")
def bare(wheel, tmp_path_factory):
    """An environment's `bin` folder. What the wheel declares is linked from the environment that runs the tests, as
    there may be no package index; nothing else of that is to be found."""
    folder = tmp_path_factory.mktemp("bare")
    venv.create(folder, with_pip=False, symlinks=True)
    python = folder / "bin" / "python"
    pip = [sys.executable, "-m", "pip", "--python", python, "install", "--quiet", "--no-deps", "--no-index"]
    subprocess.run([*pip, wheel], check=True)
    [packages] = folder.glob("lib/python*/site-packages")
    [own] = importlib.metadata.distributions(name="jaxmotor", path=[str(packages)])
    for name in needed(own):
        distribution = importlib.metadata.distribution(name)
        for top in {file.parts[0] for file in distribution.files or ()} - {"..", "__pycache__"}:
            if not (packages / top).exists():
                (packages / top).symlink_to(str(distribution.locate_file(top)))
    return folder / "bin"


def run(bare, command, *arguments, **more):
    """With nothing on the path but the environment."""
    about = {"PATH": str(bare), "HOME": str(bare.parent), "PYTHONDONTWRITEBYTECODE": "1"} | more
    line = [bare / command, *arguments]
    ran = subprocess.run(line, env=about, capture_output=True, text=True, check=False, cwd=bare.parent)
    print(ran.stdout, ran.stderr)
    return ran


def test_it_has_every_file_of_the_package(wheel):
    package = ROOT / "jaxmotor"
    wanted = {path.relative_to(ROOT).as_posix() for path in package.rglob("*") if path.is_file()}
    wanted = {path for path in wanted if "__pycache__" not in path}
    names = set(zipfile.ZipFile(wheel).namelist())
    assert {"jaxmotor/py.typed", "jaxmotor/present/report/page.css", "jaxmotor/recording/bundled/paper.csv"} <= wanted
    assert {name for name in names if not name.startswith("jaxmotor-")} == wanted


def test_nothing_else_is_to_be_found(bare):
    code = (
        "import jaxmotor, importlib.util as u; print(jaxmotor.__file__, u.find_spec('pytest'), u.find_spec('pandas'))"
    )
    path, *others = run(bare, "python", "-c", code).stdout.split()
    assert Path(path).is_relative_to(bare.parent) and others == ["None", "None"]


def test_the_demo_runs(bare, tmp_path):
    cache = jax.config.values["jax_compilation_cache_dir"]
    ran = run(bare, "jaxmotor", "demo", "-o", str(tmp_path), JAXMOTOR_CACHE=cache, XLA_FLAGS=os.environ["XLA_FLAGS"])
    assert ran.returncode == 0 and not ran.stderr
    assert "coulomb_friction" in ran.stdout and f"all of it on one page: {tmp_path / 'paper.html'}" in ran.stdout
    made = {path.name for path in tmp_path.iterdir()}
    assert {"paper.html", "paper.json", "paper-extended.json", "paper-models.png"} <= made
    effects = json.loads((tmp_path / "paper-extended.json").read_text())["effects"]
    assert effects[0]["name"] == "coulomb_friction"


@pytest.mark.parametrize(
    ("command", "needed"),
    [
        (
            ["record", "--port", "emulated", "--plan", "paper", "-o", "log.csv"],
            "the folder firmware/",
        ),
        (["fleet", "log.parquet", "-o", "fleet"], "pip install 'jaxmotor[fleet]'"),
    ],
)
def test_what_needs_more_says_so(bare, command, needed):
    ran = run(bare, "jaxmotor", *command)
    said = ran.stderr.strip()
    assert ran.returncode == 1 and said.startswith("jaxmotor: ") and "\n" not in said and needed in said
