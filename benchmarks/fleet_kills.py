"""A worker of a local Dask cluster is killed at a random moment of a run, again and again: the results must be those of
a run without a cluster, every motor once. `--times 3` makes it short.
"""

import argparse
import os
import random
import signal
import tempfile
import threading
import time
from pathlib import Path

import jax
import pyarrow.parquet as parquet
from fleet_scaling import motors

from jaxmotor.fleet import identify_fleet, write_parquet


def children() -> list[int]:
    """Processes that multiprocessing started for this one's workers, as the system lists them."""
    found = []
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                parent = int((entry / "stat").read_text().rsplit(")", 1)[1].split()[1])
                command = (entry / "cmdline").read_bytes()
            except (OSError, IndexError, ValueError):
                continue
            if parent == os.getpid() and b"spawn_main" in command:
                found.append(int(entry.name))
    return found


def killer(begun: threading.Event, wait: float, killed: list[int]) -> None:
    begun.wait()
    time.sleep(wait)
    running = children()
    if running:
        os.kill(random.choice(running), signal.SIGKILL)
        killed.append(1)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--times", type=int, default=20)
    parser.add_argument("--motors", type=int, default=1200)
    given = parser.parse_args()
    random.seed(0)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        jax.config.update("jax_compilation_cache_dir", str(folder / "cache"))
        jax.config.update("jax_persistent_cache_min_compile_time_secs", 0.0)
        write_parquet(motors(given.motors), folder / "fleet.parquet")
        identify_fleet(folder / "fleet.parquet", folder / "whole.parquet")
        expected = parquet.read_table(folder / "whole.parquet").to_pylist()
        same, kills = 0, 0
        for turn in range(given.times):
            output, begun, killed = folder / f"r{turn}.parquet", threading.Event(), []
            thread = threading.Thread(target=killer, args=(begun, random.uniform(0, 1.5), killed))
            thread.start()
            identify_fleet(
                folder / "fleet.parquet", output, cluster="local", workers=2, progress=lambda _, e=begun: e.set()
            )
            thread.join()
            kills += len(killed)
            same += parquet.read_table(output).to_pylist() == expected
            print(f"run {turn}: {'killed' if killed else 'had ended before'}; same results so far {same}", flush=True)
    print(f"{kills} workers killed in {given.times} runs of {given.motors} motors; {same} runs gave the same results")


if __name__ == "__main__":
    main()
