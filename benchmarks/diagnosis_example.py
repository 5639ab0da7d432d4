"""The example of docs/diagnosis.md: a motor with dry friction, diagnosed, told and drawn.

    make -C firmware plant && python benchmarks/diagnosis_example.py [FOLDER]

Prints the story and what was hidden, and writes the figures into FOLDER (docs/img): diagnosis-missing.png,
diagnosis-causes.png, diagnosis-before-after.png.
"""

import dataclasses
import sys
from pathlib import Path

from hidden import draw

from jaxmotor._runtime import keep_programs
from jaxmotor.cli._story import diagnosis_text
from jaxmotor.diagnosis import diagnose
from jaxmotor.present import diagnosis_figures, save

HIDDEN = (("coulomb_friction",), 1)
FOLDER = Path(__file__).parent.parent / "docs" / "img"


def main() -> None:
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else FOLDER
    keep_programs(threads=True)
    hidden = draw(*HIDDEN)
    diagnosis = diagnose(dataclasses.replace(hidden.recording, source="motor.csv"))
    print(diagnosis_text(diagnosis))
    print(f"\nhidden: {hidden.truth}, gain {hidden.gain:.6g} rad/s/V, pole {hidden.pole:.6g} rad/s")
    for name, figure in diagnosis_figures(diagnosis).items():
        save(figure, folder / f"diagnosis-{name}.png")


if __name__ == "__main__":
    main()
