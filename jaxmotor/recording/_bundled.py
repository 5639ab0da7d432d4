"""The recordings that come with the package."""

from pathlib import Path

from jaxmotor.recording._read import read
from jaxmotor.recording._recording import Recording

FOLDER = Path(__file__).parent / "bundled"


def bundled(name: str = "paper") -> Recording:
    """The bundled recording `name`: "paper", the paper's experiments."""
    return read(FOLDER / f"{name}.csv")
