"""Records the bundled recordings anew from the emulated bench (seconds); a test holds that the bytes are the same.

    paper.csv, full.csv    the built-in plans on the motor of pololu.toml, all in jaxmotor/recording/bundled

Needs the firmware's toolchain: gcc-avr avr-libc binutils-avr libsimavr-dev libelf-dev gcc make.
"""

import dataclasses
from pathlib import Path

import jaxmotor
from jaxmotor.bench import Port, load_plan, record

FOLDER = Path(jaxmotor.__file__).parent / "recording" / "bundled"
PLANT = FOLDER / "pololu.toml"
FILES = {"paper.csv": "paper", "full.csv": "full"}
HEADER = {
    "motor": "emulated, after a Pololu 51.45:1 micro gear motor (pololu.toml)",
    "notes": "gain 10.6 rad/s/V, pole 40 rad/s, L/R 116 us, Coulomb friction 0.2 V, supply 7.4 V behind 0.15 ohm",
}


def record_bundled(folder: Path) -> list[Path]:
    """Record all of `FILES` into `folder`; their paths."""
    written = []
    for name, plan in FILES.items():
        # The supply as a voltmeter shows it: the board's own reading is a step of its converter off.
        stated = dataclasses.replace(load_plan(plan), supply_V=7.4, header=HEADER)
        record(stated, lambda: Port("emulated", plant=PLANT), folder / name, force=True)
        written.append(folder / name)
    return written


if __name__ == "__main__":
    for path in record_bundled(FOLDER):
        print(path)
