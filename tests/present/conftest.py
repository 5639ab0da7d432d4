"""One recording and the fits of it, made once: identifying compiles for seconds."""

import matplotlib
import pytest
from present_rig import AWKWARD, made_recording

from jaxmotor.estimate import identify
from jaxmotor.recording import Recording


@pytest.fixture(scope="session")
def recording() -> Recording:
    return made_recording({"motor": AWKWARD})


@pytest.fixture(scope="session")
def exact(recording):
    return identify(recording)


@pytest.fixture(scope="session")
def paper(recording):
    return identify(recording, method="paper")


@pytest.fixture(autouse=True)
def untouched_settings():
    """No figure may change matplotlib's settings for the program around it."""
    before = dict(matplotlib.rcParams)
    yield
    assert dict(matplotlib.rcParams) == before
