"""Makes the bundled recording of a linear motor anew (seconds); a test holds that the bytes are the same."""

from pathlib import Path

import jaxmotor
from jaxmotor.bench._paper_plan import paper_recording
from jaxmotor.bench._plant import Plant
from jaxmotor.recording import write

if __name__ == "__main__":
    path = Path(jaxmotor.__file__).parent / "recording" / "bundled" / "linear.csv"
    path.parent.mkdir(exist_ok=True)
    write(paper_recording(Plant()), path)
    print(path)
