"""Pictures for the pages, small enough to keep beside them."""

import io
from pathlib import Path

from matplotlib.figure import Figure
from PIL import Image

from jaxmotor._files import replacing

DPI, COLOURS = 140, 64


def save_small(figure: Figure, path: Path) -> Path:
    """Write `figure` to `path`, a PNG of 64 colours."""
    whole = io.BytesIO()
    figure.savefig(whole, format="png", dpi=DPI)
    with replacing(path) as part:
        Image.open(whole).convert("RGB").quantize(COLOURS).save(part, format="png", optimize=True)
    return path
