import shutil

import pytest
from exported import make


@pytest.fixture(scope="session")
def plant_library() -> None:
    """The emulated bench's plant, built."""
    if not all(map(shutil.which, ("make", "cc"))):
        pytest.skip("the plant library needs a C compiler; apt install build-essential")
    make("plant")
