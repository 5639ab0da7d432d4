import fcntl
import importlib.util
import shutil
import subprocess
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="session")
def plant() -> ModuleType:
    """The emulated bench's plant, integrated at 10 us."""
    build = ROOT / "firmware" / "build"
    if not (ROOT / "firmware" / "Makefile").exists() or not all(map(shutil.which, ("make", "cc"))):
        pytest.skip("the plant library needs a C compiler; apt install build-essential")
    build.mkdir(exist_ok=True)
    with open(build / ".lock", "w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        made = subprocess.run(["make", "-C", ROOT / "firmware", "plant"], check=False, capture_output=True, text=True)
    if made.returncode:
        pytest.skip(f"the plant library does not compile: {made.stderr.splitlines()[-1]}")
    spec = importlib.util.spec_from_file_location("emulated_plant", ROOT / "tests" / "firmware" / "plant.py")
    assert spec and spec.loader
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module
