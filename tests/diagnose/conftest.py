import fcntl
import shutil
import subprocess
from pathlib import Path

import pytest

FIRMWARE = Path(__file__).parents[2] / "firmware"


@pytest.fixture(scope="session")
def plant_library() -> None:
    if not all(map(shutil.which, ("make", "cc"))):
        pytest.skip("the plant library needs a C compiler; apt install build-essential")
    (FIRMWARE / "build").mkdir(exist_ok=True)
    with open(FIRMWARE / "build" / ".lock", "w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        made = subprocess.run(["make", "-C", FIRMWARE, "plant"], check=False, capture_output=True, text=True)
    assert made.returncode == 0, made.stderr
