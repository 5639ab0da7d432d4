"""`import jaxmotor as jm`: every public name is what it says, whatever has been imported before."""

import importlib
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import jaxmotor
from jaxmotor import _programs
from jaxmotor.bench._journal import Journal

BUNDLED = Path(jaxmotor.__file__).parent / "recording" / "bundled"


def test_no_folder_hides_a_function():
    folders = {path.name for path in Path(jaxmotor.__file__).parent.iterdir() if (path / "__init__.py").exists()}
    assert not folders & set(jaxmotor._HOME)


def test_every_name_comes_from_its_home():
    for name, home in jaxmotor._HOME.items():
        module = importlib.import_module(f"jaxmotor.{home}")
        assert getattr(jaxmotor, name) is getattr(module, name), name
    assert dir(jaxmotor) == sorted([*jaxmotor.__all__, "__version__"]) and set(jaxmotor.__all__) == set(jaxmotor._HOME)


def test_an_unknown_name_is_an_attribute_error():
    assert not hasattr(jaxmotor, "no_such_thing")


def test_reading_does_not_wait_for_jax():
    code = "import sys, jaxmotor; jaxmotor.read; assert 'jax' not in sys.modules"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_the_package_runs_as_the_command_line():
    done = subprocess.run([sys.executable, "-m", "jaxmotor", "--help"], check=False, capture_output=True, text=True)
    assert done.returncode == 0 and "--install-completion" in done.stdout


def test_importing_changes_no_setting():
    code = (
        "import jax; before = dict(jax.config.values); import jaxmotor.estimate, jaxmotor.diagnosis, jaxmotor.present;"
        "assert dict(jax.config.values) == before and not jax.config.jax_enable_x64"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_test_files_have_names_of_their_own():
    """pytest imports them by their bare names; two of one name hide each other."""
    names = [path.name for path in Path(__file__).parent.rglob("*.py") if path.name != "conftest.py"]
    assert len(names) == len(set(names))


def test_all_but_recording_works_where_files_cannot_be_locked(tmp_path, monkeypatch):
    """As on Windows; pyserial's own code for Linux is loaded before the module is hidden."""
    hidden = "import serial, sys; sys.modules['fcntl'] = None"
    code = f"{hidden}; from jaxmotor.cli import main; sys.exit(main(sys.argv[1:]))"
    asked = ["encoder", "--counts-per-rev", "617.4", "-o", str(tmp_path)]
    done = subprocess.run([sys.executable, "-c", code, *asked], capture_output=True, text=True, check=False)
    assert done.returncode == 0 and (tmp_path / "encoder.png").exists(), done.stderr
    monkeypatch.setitem(sys.modules, "fcntl", None)
    with pytest.raises(jaxmotor.JaxmotorError, match="needs the file locks of Linux or macOS"):
        Journal(tmp_path / "m.csv.part")


def test_a_copy_of_the_package_has_the_same_programs_until_it_is_changed(tmp_path, monkeypatch):
    own = _programs._sources()
    shutil.copytree(_programs.PACKAGE, tmp_path / "copy", copy_function=shutil.copyfile)
    monkeypatch.setattr(_programs, "PACKAGE", tmp_path / "copy")
    assert _programs._sources.__wrapped__() == own
    with open(tmp_path / "copy" / "motor" / "_motor.py", "a") as file:
        file.write("# changed\n")
    assert _programs._sources.__wrapped__() != own


ALONE = {
    "numpy first": "import numpy, jaxmotor as jm; jm.keep_programs()",
    "numpy later": "import jaxmotor as jm; jm.keep_programs()",
    "a command": "from jaxmotor.cli import main; main(['check', 'no.csv'])",
}


@pytest.mark.parametrize("first", ALONE.values(), ids=ALONE)
@pytest.mark.parametrize("own", [None, "2"])
def test_products_are_computed_by_the_thread_that_asks(first, own):
    """But where the user has said otherwise."""
    code = (
        f"{first}; import numpy, scipy.linalg, threadpoolctl;"
        "print({one['num_threads'] for one in threadpoolctl.threadpool_info() if one['user_api'] == 'blas'})"
    )
    told = {name: value for name, value in os.environ.items() if name != "OPENBLAS_NUM_THREADS"}
    told |= {"OPENBLAS_NUM_THREADS": own} if own else {}
    said = subprocess.run([sys.executable, "-c", code], env=told, capture_output=True, text=True, check=True).stdout
    assert said.strip() == f"{{{min(int(own or 1), os.cpu_count() or 1)}}}"


def test_kept_programs_serve_the_next_session(tmp_path):
    code = (
        "import os, jaxmotor as jm; assert 'XLA_FLAGS' not in os.environ; jm.keep_programs();"
        "from jaxmotor._programs import _loaded; import jaxmotor._programs as programs; found = [];"
        "programs._loaded = lambda *given: (found.append(_loaded(*given)), found[-1])[1];"
        f"jm.identify({str(BUNDLED / 'linear.csv')!r}); print(len(found), sum(one is not None for one in found))"
    )
    own = {name: value for name, value in os.environ.items() if name != "XLA_FLAGS"} | {"JAXMOTOR_CACHE": str(tmp_path)}
    sessions = [
        subprocess.run([sys.executable, "-c", code], env=own, capture_output=True, text=True, check=True).stdout.split()
        for _ in range(2)
    ]
    (asked, loaded), (again, kept) = (map(int, session) for session in sessions)
    assert loaded == 0 and asked == again == kept > 0 and len(list(tmp_path.glob("*.program"))) == asked
