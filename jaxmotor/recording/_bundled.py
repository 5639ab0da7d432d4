"""The recordings that come with the package."""

from pathlib import Path

from jaxmotor.recording._read import read
from jaxmotor.recording._recording import Recording

FOLDER = Path(__file__).parent / "bundled"


def bundled(name: str = "paper") -> Recording:
    """A bundled recording: "paper" and "full" are those plans run by the firmware on the emulated bench, with a motor
    that has 0.2 V of friction; "linear" is the paper's plan on a linear motor, without a board.

    **Raises:** `RecordingError` for any other name.
    """
    return read(FOLDER / f"{name}.csv")
