"""How long the commands take to start, as ratios to `python -c "import jax, optimistix"` in the same run.

python benchmarks/startup.py [--runs 7]

identify    the second run on a recording of 16 000 ticks       <= 2.5
diagnose    the same, on one with friction                      <= 4
help        jaxmotor --help                                     <= 0.25
"""

import argparse
import os
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from made import recording, sine, step

from jaxmotor.recording import write

BASE = [sys.executable, "-c", "import jax, optimistix"]
JAXMOTOR = [str(Path(sys.executable).parent / "jaxmotor")]
LIMITS = {"identify": 2.5, "diagnose": 4.0, "help": 0.25}


def seconds(command: list[str], environment: dict[str, str]) -> float:
    start = time.perf_counter()
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL, env=environment)
    return time.perf_counter() - start


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--runs", type=int, default=7)
    runs = parser.parse_args().runs
    with tempfile.TemporaryDirectory() as folder:
        environment = os.environ | {"JAXMOTOR_CACHE": f"{folder}/cache"}
        path = Path(folder) / "sixteen-thousand.csv"
        plan = [sine(f) for f in np.geomspace(0.5, 10, 16) * 1.0037] + [step(h, 320) for h in np.linspace(2, 5.1, 10)]
        made = recording(0, runs=plan)
        write(made, path)
        rough = Path(folder) / "rough.csv"
        write(recording(0, friction=0.3, runs=plan), rough)
        commands = {
            "base": BASE,
            "help": [*JAXMOTOR, "--help"],
            "identify": [*JAXMOTOR, "identify", str(path)],
            "diagnose": [*JAXMOTOR, "diagnose", str(rough)],
        }
        first = {name: seconds(commands[name], environment) for name in ("identify", "diagnose")}
        # In turn, so that a machine that slows down slows all of them.
        table = [{name: seconds(command, environment) for name, command in commands.items()} for _ in range(runs)]
    print(f"{sum(map(len, made.segments))} ticks; medians of {runs} runs in turn")
    base = statistics.median(row["base"] for row in table)
    print(f"import jax, optimistix   {base:6.2f} s     1")
    for name, limit in LIMITS.items():
        ratio = statistics.median(row[name] / row["base"] for row in table)
        print(f"{name:24s} {statistics.median(row[name] for row in table):6.2f} s  {ratio:6.2f}   limit {limit}")
    for name, long in first.items():
        print(f"{name}, the first time {long:6.2f} s  {long / base:6.2f}")


if __name__ == "__main__":
    main()
