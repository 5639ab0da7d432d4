"""Time and memory of `identify_fleet` over the number of motors; one core against two; one Dask worker against two.

Motors are made and written to Parquet one by one, and identified each in a process of its own, whose peak memory the
system reports. Programs are compiled before, so that times are of the work. `--sizes 100 300` makes it small;
`--sizes 100 1000 10000 100000` is the whole claim.
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
from made import recording, sine, step

from jaxmotor.fleet import write_parquet
from jaxmotor.recording import Recording

RUNS = [sine(0.73, 240), sine(2.9, 240), sine(7.7, 240), step(5.1, 120), step(-3.3, 120)]
CHILD = """
import json, os, resource, sys, time
flags = os.environ.get("FLEET_CORES")
if flags: os.sched_setaffinity(0, range(int(flags)))
import jax
jax.config.update("jax_compilation_cache_dir", sys.argv[3])
jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.0)
from jaxmotor.fleet import identify_fleet
if __name__ == "__main__":
    marks = []
    def heard(done):
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        marks.append((time.perf_counter(), done.motors, peak))
    cluster = None if sys.argv[4] == "none" else sys.argv[4]
    begin = time.perf_counter()
    identify_fleet(sys.argv[1], sys.argv[2], cluster=cluster, workers=int(sys.argv[5]), progress=heard)
    print(json.dumps({"total": time.perf_counter() - begin, "marks": marks}))
"""


def motors(number: int) -> Iterator[tuple[str, Recording]]:
    rng = np.random.default_rng(0)
    for k in range(number):
        yield f"m{k}", recording(k, gain=rng.normal(11, 0.5), pole=rng.normal(40, 3), runs=RUNS)


def run(data: Path, folder: Path, cluster: str, workers: int, cores: int | None = None) -> dict:
    output = folder / "results.parquet"
    output.unlink(missing_ok=True)
    environment = os.environ | ({} if cores is None else {"FLEET_CORES": str(cores)})
    script = folder / "child.py"
    script.write_text(CHILD)
    command = [sys.executable, script, data, output, folder / "cache", cluster, str(workers)]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    return json.loads(done.stdout.splitlines()[-1])


def between(marks: list) -> float:
    """Seconds for each motor from the first finished part to the last: starting up is not in it."""
    return (marks[-1][0] - marks[0][0]) / max(sum(number for _, number, _ in marks[1:]), 1)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--sizes", type=int, nargs="+", default=[100, 1000, 3000])
    parser.add_argument("--compared", type=int, default=2000, help="motors for one core against two")
    parser.add_argument("--rounds", type=int, default=2)
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        data = {n: folder / f"fleet{n}.parquet" for n in sorted({*given.sizes, given.compared})}
        for number, path in data.items():
            write_parquet(motors(number), path)
        run(data[min(data)], folder, "none", 1)
        print("motors   total s   ms/motor   peak MB   peak MB when a quarter was done")
        for number in given.sizes:
            found = run(data[number], folder, "none", 1, 1)
            marks = found["marks"]
            early = marks[len(marks) // 4][2] / 1024
            print(f"{number:7d} {found['total']:8.1f} {1e3 * found['total'] / number:9.2f}", end="  ")
            print(f"{marks[-1][2] / 1024:8.0f} {early:12.0f}", flush=True)
        best: dict[str, float] = {}
        for _ in range(given.rounds):
            for cluster, workers in (("none", 1), ("none", 2), ("local", 1), ("local", 2)):
                cores = workers if cluster == "none" else None
                each = between(run(data[given.compared], folder, cluster, workers, cores)["marks"])
                key = f"{'Dask workers' if cluster == 'local' else 'cores'} {workers}"
                best[key] = min(each, best.get(key, np.inf))
        for key, each in best.items():
            print(f"{key:16s} {1e3 * each:8.2f} ms/motor")
        print(f"two cores over one {best['cores 1'] / best['cores 2']:.2f};", end=" ")
        print(f"two Dask workers over one {best['Dask workers 1'] / best['Dask workers 2']:.2f}")


if __name__ == "__main__":
    main()
