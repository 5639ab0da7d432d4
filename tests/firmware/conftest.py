import json
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
from testing import built
from testing.wire import Line, unseal

PACKAGES = "gcc-avr avr-libc binutils-avr libsimavr-dev libelf-dev"
TOOLS = (*built.COMPILER, "avr-gcc", "avr-objcopy")
HEADERS = {"simavr": "/usr/include/simavr/sim_avr.h", "libelf": "/usr/include/libelf.h"}


def _missing(tools: tuple[str, ...], headers: dict[str, str]) -> list[str]:
    missing = [tool for tool in tools if not shutil.which(tool)]
    return missing + [name for name, path in headers.items() if not Path(path).exists()]


def _need(tools: tuple[str, ...], headers: dict[str, str], packages: str) -> None:
    if missing := _missing(tools, headers):
        pytest.skip(f"firmware toolchain: no {', '.join(missing)}; apt install {packages}")


def pytest_collection_modifyitems(config, items):
    """Without the toolchain one test says so for all that need it."""
    if not _missing(TOOLS, HEADERS):
        return
    spare = [item for item in items if "toolchain" in getattr(item, "fixturenames", ())][1:]
    config.hook.pytest_deselected(items=spare)
    items[:] = [item for item in items if item not in spare]


@pytest.fixture(scope="session")
def toolchain() -> None:
    _need(TOOLS, HEADERS, PACKAGES)


@pytest.fixture(scope="session")
def build(toolchain) -> Path:
    """The folder with firmware, bench and plant library, built."""
    built.make("all")
    return built.BUILD


@pytest.fixture(scope="session")
def make(toolchain):
    return built.make


class Outcome:
    """What came out of a scripted run."""

    def __init__(self, raw: bytes, stats: dict, torn: int):
        self.raw = raw
        self.stats = stats
        whole = [unseal(line) for line in raw.splitlines() if line]
        assert whole.count(None) <= torn, raw
        self.lines: list[Line] = [line for line in whole if line]

    def of(self, kind: str) -> list[Line]:
        return [line for line in self.lines if line.type == kind]

    def samples(self, segment: int) -> list[list[int]]:
        """[tick, duty, count] of a segment."""
        return [line.ints()[1:4] for line in self.of("D") if line.ints()[0] == segment]

    @property
    def end(self) -> str:
        """Why the run ended."""
        [line] = self.of("Z")
        return line.fields[0]


@pytest.fixture
def bench(build, tmp_path):
    """Run a script through the emulated bench. `plant` is a plant file's text, `torn` how many lines may be damaged."""

    def run(script: bytes, *options: str, plant: str = "", elf: Path | None = None, torn: int = 0) -> Outcome:
        (tmp_path / "plant.toml").write_text(plant)
        stats = tmp_path / "stats.json"
        command = [build / "bench", "--plant", tmp_path / "plant.toml", "--stats", stats, *options]
        if elf:
            command += ["--elf", elf]
        result = subprocess.run(command, input=bytes(script), check=False, capture_output=True, timeout=60)
        assert result.returncode == 0, result.stderr.decode()
        return Outcome(result.stdout, json.loads(stats.read_text()), torn)

    return run


@pytest.fixture
def excitation() -> np.ndarray:
    """Duties that change every seventh tick, at random."""
    return np.repeat(np.random.default_rng(3).integers(-250, 251, 60), 7)
