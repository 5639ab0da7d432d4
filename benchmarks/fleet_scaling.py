"""Time and memory of `identify_fleet` over the number of motors; one core against two; one Dask worker against two.

    python benchmarks/fleet_scaling.py --sizes 100 1000 10000 100000

Motors are made and written to Parquet one by one, and identified each in a process of its own, on one core, whose peak
memory the system reports. Programs are compiled before, and a few motors are done before the clock starts: what is
measured is reading, identifying, writing and joining, all of it. On a shared machine the processor's time says more
than the clock's. To be met: the same processor time per motor within 10 %, memory that stays where it was after the
first tenth, below 4 GB, and two cores over one 1.7, which says something only where nobody else uses them. One Dask
worker has one core, too. Without `--sizes` it is smaller; `--compared 0` leaves the comparisons out.
"""

import argparse
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from testing.made import recording, sine, step

from jaxmotor.fleet import write_parquet
from jaxmotor.recording import Recording

RUNS = [sine(0.73, 240), sine(2.9, 240), sine(7.7, 240), step(5.1, 120), step(-3.3, 120)]
AT_LEAST = 1000
"""Motors that a measurement takes in all: small data sets are done again and again, and the median is taken."""
CHILD = """
import json, os, resource, sys, time
flags = os.environ.get("FLEET_CORES")
if flags: os.sched_setaffinity(0, range(int(flags)))
os.environ["JAXMOTOR_CACHE"] = sys.argv[4]
from jaxmotor._runtime import keep_programs
keep_programs(threads=False)
from jaxmotor.fleet import identify_fleet
def clocks():
    return time.perf_counter(), time.process_time(), resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
if __name__ == "__main__":
    marks = []
    def heard(done):
        marks.append((done.motors, *clocks()))
    cluster = None if sys.argv[5] == "none" else sys.argv[5]
    if cluster is None:
        identify_fleet(sys.argv[3], sys.argv[2] + ".first", workers=1)
    spans = []
    for _ in range(int(sys.argv[7])):
        if os.path.exists(sys.argv[2]): os.remove(sys.argv[2])
        begin = clocks()
        identify_fleet(sys.argv[1], sys.argv[2], cluster=cluster, workers=int(sys.argv[6]), progress=heard)
        end = clocks()
        spans.append((end[1] - begin[1], end[0] - begin[0]))
    print(json.dumps({"spans": spans, "marks": marks, "peak": end[2]}))
"""


def motors(number: int) -> Iterator[tuple[str, Recording]]:
    rng = np.random.default_rng(0)
    for k in range(number):
        yield f"m{k}", recording(k, gain=rng.normal(11, 0.5), pole=rng.normal(40, 3), runs=RUNS)


def run(data: Path, folder: Path, cluster: str, workers: int, cores: int | None = None, repeats: int = 1) -> dict:
    output = folder / "results.parquet"
    for path in (output, output.with_name("results.parquet.first")):
        path.unlink(missing_ok=True)
    environment = os.environ | ({} if cores is None else {"FLEET_CORES": str(cores)})
    script = folder / "child.py"
    script.write_text(CHILD)
    command = [sys.executable, script, data, output, folder / "first.parquet", folder / "cache", cluster]
    command += [str(workers), str(repeats)]
    done = subprocess.run(command, env=environment, stdout=subprocess.PIPE, text=True, check=True)
    return json.loads(done.stdout.splitlines()[-1])


def between(marks: list) -> float:
    """Seconds for each motor from the first finished part to the last: starting up is not in it."""
    return (marks[-1][1] - marks[0][1]) / max(sum(mark[0] for mark in marks[1:]), 1)


def scaling(sizes: list[int], data: dict[int, Path], folder: Path) -> None:
    print("motors   clock s   processor s   ms/motor   over the first   peak MB: end   after a tenth   a half")
    first = 0.0
    for number in sizes:
        found = run(data[number], folder, "none", 1, 1, max(1, AT_LEAST // number))
        processor, clock = np.median(found["spans"], axis=0)
        marks, each = found["marks"], 1e3 * processor / number
        first = first or each
        peaks = [found["peak"], *(marks[int(share * (len(marks) - 1))][3] for share in (0.1, 0.5))]
        print(f"{number:7d} {clock:9.1f} {processor:13.1f} {each:10.2f} {each / first:16.3f}", end=" ")
        print("{:14.0f} {:15.0f} {:8.0f}".format(*peaks), flush=True)


def comparison(data: Path, folder: Path, rounds: int) -> None:
    best: dict[str, float] = {}
    for _ in range(rounds):
        for cluster, workers in (("none", 1), ("none", 2), ("local", 1), ("local", 2)):
            each = between(run(data, folder, cluster, workers, workers)["marks"])
            key = f"{'Dask workers' if cluster == 'local' else 'cores'} {workers}"
            best[key] = min(each, best.get(key, np.inf))
    for key, each in best.items():
        print(f"{key:16s} {1e3 * each:8.2f} ms/motor")
    print(f"two cores over one {best['cores 1'] / best['cores 2']:.2f};", end=" ")
    print(f"two Dask workers over one {best['Dask workers 1'] / best['Dask workers 2']:.2f}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sizes", type=int, nargs="*", default=[100, 1000, 3000])
    parser.add_argument("--compared", type=int, default=2000, help="motors for one core against two, 2000 or more")
    parser.add_argument("--rounds", type=int, default=2)
    parser.add_argument("--folder", type=Path, help="keep data sets and compiled programs here")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = given.folder or Path(name)
        folder.mkdir(exist_ok=True)
        write_parquet(motors(64), folder / "first.parquet")
        numbers: list[int] = sorted({*given.sizes, *([given.compared] if given.compared else [])})
        data = {number: folder / f"fleet{number}.parquet" for number in numbers}
        for number, path in data.items():
            if not path.exists():
                write_parquet(motors(number), path)
        run(folder / "first.parquet", folder, "none", 1)
        scaling(given.sizes, data, folder)
        if given.compared:
            comparison(data[given.compared], folder, given.rounds)


if __name__ == "__main__":
    main()
