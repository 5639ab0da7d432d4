"""Figures as files: the same figure gives the same bytes, and a file is written whole or not at all."""

import os

import matplotlib.style
from matplotlib.figure import Figure

from jaxmotor._arguments import path_of, taken
from jaxmotor._errors import JaxmotorError
from jaxmotor._files import replacing
from jaxmotor.present._style import STYLE

DPI = 200
METADATA = {"png": {"Software": "jaxmotor"}, "svg": {"Date": None, "Creator": "jaxmotor"}}


def save(figure: Figure, path: str | os.PathLike[str]) -> None:
    """Write `figure` to `path`, a .png of 200 dpi or a .svg, replacing what was there.

    **Raises:** `JaxmotorError` where the name ends otherwise, or the file cannot be written.
    """
    taken(figure, Figure, "a figure of matplotlib")
    path = path_of(path, "the path of a picture")
    kind = path.suffix.lower().removeprefix(".")
    if kind not in METADATA:
        raise JaxmotorError(f"{path}: a figure is written as .png or .svg; choose a name that ends in one of them")
    with matplotlib.style.context(STYLE, after_reset=True), replacing(path) as part:
        figure.savefig(part, format=kind, dpi=DPI, metadata=METADATA[kind])
