"""The C header as a library for the Arduino IDE: a folder with the header and a sketch that holds a speed."""

import os
from importlib.resources import files

from jaxmotor._arguments import path_of, taken
from jaxmotor._errors import JaxmotorError
from jaxmotor._files import write_text
from jaxmotor.estimate import AnyModel
from jaxmotor.present.exports._c_header import to_c
from jaxmotor.present.exports._design import Design

PROPERTIES = """\
name=JaxmotorMotor
version=1.0.0
author=jaxmotor export
maintainer=jaxmotor export
sentence=A DC motor and controllers designed for it, identified from measurements.
paragraph=Feed-forward, speed loop, position loop and estimator in integers; written by jaxmotor export --to arduino.
category=Device Control
url=
architectures=*
includes=JaxmotorMotor.h
"""
SKETCH = "SpeedLoop"


def to_arduino(model: AnyModel, design: Design) -> dict[str, str]:
    """The library's files by their path in its folder.

    **Raises:** `JaxmotorError` where a number does not fit into the integers.
    """
    sketch = files("jaxmotor.present.exports").joinpath(f"{SKETCH}.ino").read_text(encoding="utf-8")
    return {
        "library.properties": PROPERTIES,
        "src/JaxmotorMotor.h": to_c(model, design),
        f"examples/{SKETCH}/{SKETCH}.ino": sketch,
    }


def write_library(folder: str | os.PathLike[str], library: dict[str, str]) -> None:
    """Write `library` into `folder`, which is made; another library's folder is left as it is.

    **Raises:** `JaxmotorError`.
    """
    folder = path_of(folder, "the path of a folder")
    taken(library, dict, "a library (of to_arduino)")
    properties = folder / "library.properties"
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        mine = properties.is_file() and properties.read_bytes()[:19] == PROPERTIES.encode()[:19]
        if not mine:
            raise JaxmotorError(f"{folder}: has something else in it; name a new folder for the library")
    try:
        for path in library:
            (folder / path).parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise JaxmotorError(f"{folder}: cannot be made ({error.strerror})") from error
    for path, text in library.items():
        write_text(folder / path, text)
