import jax
import pytest
from hypothesis import settings

jax.config.update("jax_numpy_dtype_promotion", "strict")
jax.config.update("jax_numpy_rank_promotion", "raise")

# The first example pays for a compilation; a deadline would measure that.
settings.register_profile("jaxmotor", deadline=None, derandomize=True)
settings.load_profile("jaxmotor")


@pytest.fixture
def x64():
    with jax.enable_x64(True):
        yield
