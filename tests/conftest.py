import gc
import os
import shutil
from pathlib import Path

import jax
import pytest
from hypothesis import settings
from testing.built import BUILD, COMPILER, make

from jaxmotor._runtime import WHOLE_LOOPS
from jaxmotor.bench._emulator import PACKAGES, find_or_build, missing_tools
from jaxmotor.cli import _progress

# What tests compile runs once or twice, for milliseconds: LLVM's passes and XLA's newer way to compile fusions take
# longer than they gain. The package's large programs state how they are compiled, whatever stands here. XLA ends a
# program whose flags it does not know, so only versions that were tried are given them; subprocesses inherit them.
QUICKLY = (
    "--xla_cpu_use_fusion_emitters=false",
    "--xla_backend_optimization_level=0",
    "--xla_cpu_parallel_codegen_split_count=1",
)
FLAGS = [*os.environ.get("XLA_FLAGS", "").split(), WHOLE_LOOPS]
if jax.__version_info__[:2] <= (0, 10):
    FLAGS += QUICKLY
os.environ["XLA_FLAGS"] = " ".join(dict.fromkeys(FLAGS))

# Workers would each take most of a GPU's memory; what tests compute outside the package would go there.
jax.config.update("jax_platforms", os.environ.setdefault("JAX_PLATFORMS", "cpu"))
jax.config.update("jax_numpy_dtype_promotion", "strict")
jax.config.update("jax_numpy_rank_promotion", "raise")

# Workers share what one of them has compiled, and a second run starts with it: also the hundreds of small programs of
# single operations, which take longer to compile than to read. Commands, which look for the cache themselves, share it.
CACHE = str(Path(__file__).parent.parent / ".pytest_cache" / "jax")
os.environ["JAXMOTOR_CACHE"] = CACHE
jax.config.update("jax_compilation_cache_dir", CACHE)
jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.0)
jax.config.update("jax_persistent_cache_min_entry_size_bytes", -1)

# What a command prints must not depend on how long it takes.
_progress.QUIET_S = float("inf")

# The first example pays for a compilation; a deadline would measure that.
settings.register_profile("jaxmotor", deadline=None, derandomize=True)
settings.load_profile("jaxmotor")


BROWSERS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")

MAPS = Path("/proc/self/maps")
MANY_MAPS = 25_000


@pytest.fixture(autouse=True)
def forget_programs():
    """Compiled programs take memory maps, of which Linux gives a process 65530; past tests' are let go."""
    yield
    if MAPS.exists() and len(MAPS.read_bytes().splitlines()) > MANY_MAPS:
        jax.clear_caches()
        gc.collect()


@pytest.fixture(autouse=True)
def one_cache():
    """A test that asked for another cache of compiled programs leaves the next one that of all."""
    yield
    if jax.config.values["jax_compilation_cache_dir"] != CACHE:
        jax.config.update("jax_compilation_cache_dir", CACHE)


@pytest.fixture
def x64():
    with jax.enable_x64(True):
        yield


@pytest.fixture(scope="session")
def plant_library() -> Path:
    """The emulated bench's plant alone, built; a C compiler is enough for it."""
    if missing := [tool for tool in COMPILER if not shutil.which(tool)]:
        pytest.skip(f"the plant library: no {', '.join(missing)}; apt install build-essential")
    make("plant")
    return BUILD / "libplant.so"


@pytest.fixture(scope="session")
def emulator() -> Path:
    """The emulated bench, built."""
    if missing := missing_tools():
        pytest.skip(f"emulated bench: no {', '.join(missing)}; apt install {PACKAGES}")
    return find_or_build()


@pytest.fixture(scope="session")
def browser():
    """Headless Chromium, the system's or playwright's own; tests that open pages skip without one."""
    sync_api = pytest.importorskip("playwright.sync_api", reason="playwright is not installed")
    system = next((path for path in map(shutil.which, BROWSERS) if path), None)
    with sync_api.sync_playwright() as playwright:
        try:
            started = playwright.chromium.launch(executable_path=system, args=["--no-sandbox"])
        except sync_api.Error as error:
            pytest.skip(f"there is no Chromium that starts: {str(error).splitlines()[0]}")
        yield started
        started.close()
