"""How long the commands take to start, as ratios to `python -c "import jax, optimistix"` in the same run.

python benchmarks/startup.py [--runs 7]

identify    the second run on a recording of 16 000 ticks       <= 2.5
diagnose    the same, on one with friction                      <= 4
help        jaxmotor --help                                     <= 0.25

And the first time, each with an empty cache: identify <= 6; diagnose of a linear motor and of one with friction
<= 20 s, of one with friction whose voltage comes late <= 30 s, of seven times as many with friction <= 60 s, 2 GB.
"""

import argparse
import dataclasses
import os
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from testing.made import recording, sine, step

from jaxmotor.recording import Recording, Segment, write

BASE = [sys.executable, "-c", "import jax, optimistix"]
JAXMOTOR = [str(Path(sys.executable).parent / "jaxmotor")]
DELAY_TICKS = 2
AGAIN = 7
FIRST = {"identify": 6.0, "linear": 20.0, "friction": 20.0, "friction and delay": 30.0, "long": 60.0}
"""identify: times as long as `BASE`; the others in seconds."""
MOST_MB = 2000
LIMITS = {"identify": 2.5, "diagnose": 4.0, "help": 0.25}


def seconds(command: list[str], environment: dict[str, str]) -> float:
    start = time.perf_counter()
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL, env=environment)
    return time.perf_counter() - start


def first_time(command: list[str], folder: str) -> tuple[float, float]:
    """Seconds that `command` takes with an empty cache, and its largest memory [MB]."""
    environment = os.environ | {"JAXMOTOR_CACHE": tempfile.mkdtemp(dir=folder)}
    begin = time.perf_counter()
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, env=environment)
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        raise subprocess.CalledProcessError(process.returncode, command)
    return time.perf_counter() - begin, usage.ru_maxrss / 1024


def late(made: Recording) -> Recording:
    """`made` as if its counts answered `DELAY_TICKS` later."""

    def moved(segment: Segment) -> Segment:
        assert segment.count is not None
        before = np.repeat(segment.count[:1], DELAY_TICKS)
        return dataclasses.replace(segment, count=np.concatenate([before, segment.count[:-DELAY_TICKS]]))

    return dataclasses.replace(made, segments=tuple(map(moved, made.segments)))


def print_first_times(files: dict[str, Path], base_s: float, folder: str) -> None:
    """Of `identify` and of `diagnose` with an empty cache."""
    for name, limit in FIRST.items():
        what = ["identify", str(files["linear"])] if name == "identify" else ["diagnose", str(files[name])]
        long, most_mb = first_time([*JAXMOTOR, *what], folder)
        if name == "identify":
            print(f"first {name:20s} {long:6.2f} s  {long / base_s:6.2f}   limit {limit}, {most_mb:.0f} MB")
        else:
            print(f"first diagnose, {name:20s} {long:6.1f} s  limit {limit:.0f} s, {most_mb:.0f} MB (limit {MOST_MB})")


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--runs", type=int, default=7)
    runs = parser.parse_args().runs
    with tempfile.TemporaryDirectory() as folder:
        environment = os.environ | {"JAXMOTOR_CACHE": f"{folder}/cache"}
        plan = [sine(f) for f in np.geomspace(0.5, 10, 16) * 1.0037] + [step(h, 320) for h in np.linspace(2, 5.1, 10)]
        made = {
            "linear": recording(0, runs=plan),
            "friction": recording(0, friction=0.3, runs=plan),
            "friction and delay": late(recording(0, friction=0.3, runs=plan)),
            "long": recording(0, friction=0.3, runs=plan * AGAIN),
        }
        files = {name: Path(folder) / f"{name}.csv" for name in made}
        for name, path in files.items():
            write(made[name], path)
        commands = {
            "base": BASE,
            "help": [*JAXMOTOR, "--help"],
            "identify": [*JAXMOTOR, "identify", str(files["linear"])],
            "diagnose": [*JAXMOTOR, "diagnose", str(files["friction"])],
        }
        for name in ("identify", "diagnose"):
            seconds(commands[name], environment)
        # In turn, so that a machine that slows down slows all of them.
        table = [{name: seconds(command, environment) for name, command in commands.items()} for _ in range(runs)]
        base = statistics.median(row["base"] for row in table)
        print(f"{sum(map(len, made['linear'].segments))} ticks; medians of {runs} runs in turn")
        print(f"import jax, optimistix   {base:6.2f} s     1")
        for name, limit in LIMITS.items():
            ratio = statistics.median(row[name] / row["base"] for row in table)
            print(f"{name:24s} {statistics.median(row[name] for row in table):6.2f} s  {ratio:6.2f}   limit {limit}")
        print_first_times(files, base, folder)


if __name__ == "__main__":
    main()
