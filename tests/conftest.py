import gc
from pathlib import Path

import jax
import pytest
from hypothesis import settings

jax.config.update("jax_numpy_dtype_promotion", "strict")
jax.config.update("jax_numpy_rank_promotion", "raise")

# Workers share what one of them has compiled, and a second run starts with it.
jax.config.update("jax_compilation_cache_dir", str(Path(__file__).parent.parent / ".pytest_cache" / "jax"))
jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.2)

# The first example pays for a compilation; a deadline would measure that.
settings.register_profile("jaxmotor", deadline=None, derandomize=True)
settings.load_profile("jaxmotor")


MAPS = Path("/proc/self/maps")
MANY_MAPS = 25_000


@pytest.fixture(autouse=True)
def forget_programs():
    """Compiled programs take memory maps, of which Linux gives a process 65530; past tests' are let go."""
    yield
    if MAPS.exists() and len(MAPS.read_bytes().splitlines()) > MANY_MAPS:
        jax.clear_caches()
        gc.collect()


@pytest.fixture
def x64():
    with jax.enable_x64(True):
        yield
