import shutil

import pytest
from exported import make


@pytest.fixture(scope="session")
def plant_library() -> None:
    """The emulated bench's plant, built."""
    if not all(map(shutil.which, ("make", "cc"))):
        pytest.skip("the plant library needs a C compiler; apt install build-essential")
    make("plant")


@pytest.fixture(scope="session")
def board() -> None:
    """The emulated board, built."""
    from jaxmotor.bench._emulator import PACKAGES, find_or_build, missing_tools

    if missing := missing_tools():
        pytest.skip(f"emulated bench: no {', '.join(missing)}; apt install {PACKAGES}")
    find_or_build()
