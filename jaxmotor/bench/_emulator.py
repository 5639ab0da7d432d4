"""The emulated bench: found or built beside the package's sources, and started with a pseudo terminal."""

import os
import re
import selectors
import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path

from jaxmotor.bench._lock import lock
from jaxmotor.bench._protocol import RecorderError

FIRMWARE = Path(__file__).parents[2] / "firmware"
PACKAGES = "gcc-avr avr-libc binutils-avr libsimavr-dev libelf-dev gcc make"
TOOLS = ("make", "cc", "avr-gcc", "avr-objcopy")
HEADERS = ("/usr/include/simavr/sim_avr.h", "/usr/include/libelf.h")
START_S = 10.0
END_S = 2.0


def missing_tools() -> list[str]:
    """What of the toolchain is not installed."""
    return [tool for tool in TOOLS if not shutil.which(tool)] + [path for path in HEADERS if not os.path.exists(path)]


def find_or_build(firmware: Path = FIRMWARE) -> Path:
    """The emulated bench's program, made from the sources in `firmware` where they are newer.

    **Raises:** `RecorderError` where there are no sources, or no toolchain to build them with.
    """
    if not (firmware / "Makefile").exists():
        raise RecorderError(
            "emulated: the emulated bench is built from the folder firmware/ of jaxmotor's sources, which an installed "
            "package does not have; get the sources and install them with pip install -e ."
        )
    program = firmware / "build" / "bench"
    missing = missing_tools()
    if missing:
        if program.exists() and program.with_name("motor_rig.elf").exists():
            return program
        raise RecorderError(
            f"emulated: {', '.join(missing)} missing to build the emulated bench; "
            f"on Debian and Ubuntu: apt install {PACKAGES}"
        )
    _make(firmware)
    return program


def _make(firmware: Path) -> None:
    (firmware / "build").mkdir(exist_ok=True)
    with open(firmware / "build" / ".lock", "w") as file:
        lock(file, wait=True)  # several may come at once
        command = ["make", "-C", str(firmware), "firmware", "emulator"]
        result = subprocess.run(command, check=False, capture_output=True, text=True)
    if result.returncode:
        first = next((line for line in result.stderr.splitlines() if "rror" in line), "see make -C firmware")
        raise RecorderError(f"emulated: the emulated bench cannot be built ({first})")


class Emulator:
    """A running emulated bench; `url` is what to open. It ends when its port is closed."""

    def __init__(self, plant: Path | None = None, seed: int | None = None, options: Sequence[str] = ()) -> None:
        command = [str(find_or_build()), "--pty", "--once"]
        command += [] if plant is None else ["--plant", str(plant)]
        command += [] if seed is None else ["--set", f"bench.seed={seed}"]
        # A session of its own: Ctrl-C is for the recorder, which then stops the motor.
        self._process = subprocess.Popen(
            [*command, *options],
            stdin=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            encoding="utf-8",
            errors="backslashreplace",
            start_new_session=True,
        )
        told = self._first_line()
        match = re.search(r"/dev/\S+", told)
        if match is None:
            self.close()
            reason = told.strip().removeprefix("bench: ") or "it ended without a word"
            raise RecorderError(f"emulated: the emulated bench did not start ({reason})")
        self.url = match[0]

    @property
    def pid(self) -> int:
        """Of its process."""
        return self._process.pid

    def _first_line(self) -> str:
        assert self._process.stderr is not None
        with selectors.DefaultSelector() as selector:
            selector.register(self._process.stderr, selectors.EVENT_READ)
            ready = selector.select(START_S)
        return self._process.stderr.readline() if ready else ""

    def close(self) -> None:
        """Wait until it has ended; end it where it does not."""
        for end in (self._process.terminate, self._process.kill):
            try:
                self._process.wait(timeout=END_S)
                break
            except subprocess.TimeoutExpired:
                end()
        self._process.wait()
        if self._process.stderr is not None:
            self._process.stderr.close()
