"""Programs of the firmware's folder: its plant library, emulated bench and firmware, made where they are older."""

import fcntl
import subprocess
from pathlib import Path

FIRMWARE = Path(__file__).parents[2] / "firmware"
BUILD = FIRMWARE / "build"
COMPILER = ("make", "cc")
"""What the plant library needs."""


def make(target: str) -> None:
    """Make `target`; several processes may come at once.

    **Raises:** `RuntimeError` with what the compiler said.
    """
    BUILD.mkdir(exist_ok=True)
    with open(BUILD / ".lock", "w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        made = subprocess.run(["make", "-C", FIRMWARE, target], check=False, capture_output=True, text=True)
    if made.returncode:
        raise RuntimeError(f"make {target}: {made.stdout}{made.stderr}")
