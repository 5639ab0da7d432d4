"""On Dask: the same results, whatever becomes of the workers."""

import os
import random
import signal
import subprocess
import sys
import time

import pytest
from fleets import short
from test_fleet_run import table

import jaxmotor as jm
from jaxmotor.fleet import identify_fleet
from jaxmotor.fleet._cluster import check_versions, on_cluster, versions

pytestmark = pytest.mark.filterwarnings("ignore")  # Dask's own, about its own threads and sockets


def slow_square(task):
    """A stand-in for a part that takes a while: writes its own pid, then a result."""
    folder, number = task
    (folder / f"{number}.{os.getpid()}.pid").write_text("")
    time.sleep(0.4)
    return number, number**2, 0


@pytest.mark.parametrize("seed", range(2))
def test_a_killed_worker_costs_a_retry_only(tmp_path, seed):
    """Killed at a random moment by the system's hand; each part's result comes once."""
    tasks = [(tmp_path, number) for number in range(8)]
    results, killed = [], False
    wait = random.Random(seed).uniform(0.0, 0.3)
    for result in on_cluster(tasks, slow_square, "local", 2):
        results.append(result)
        if not killed:
            time.sleep(wait)
            newest = max(tmp_path.glob("*.pid"), key=lambda path: path.stat().st_mtime_ns)
            os.kill(int(newest.name.split(".")[1]), signal.SIGKILL)
            killed = True
    assert sorted(results) == [(k, k**2, 0) for k in range(8)]
    begun = [int(path.name.split(".")[0]) for path in tmp_path.glob("*.pid")]
    assert len(begun) > 8, "no part was done again: the worker was killed between parts"


def test_same_results_as_without(tmp_path, monkeypatch):
    monkeypatch.setattr("jaxmotor.fleet._dataset.FILES_PER_PART", 2)
    folder = tmp_path / "fleet"
    folder.mkdir()
    for seed in range(3):
        jm.write(short(seed, gain=9.0 + seed), folder / f"m{seed}.csv")
    identify_fleet(folder, tmp_path / "here.parquet", workers=1)
    identify_fleet(folder, tmp_path / "there.parquet", cluster="local", workers=1)
    assert table(tmp_path / "here.parquet") == table(tmp_path / "there.parquet")


SCRIPT = """
import sys

import jax

from jaxmotor.fleet._cluster import on_cluster


def kept_there(task):
    return task, int(jax.config.values["jax_compilation_cache_dir"] == sys.argv[1]), 0


if __name__ == "__main__":
    jax.config.update("jax_compilation_cache_dir", sys.argv[1])
    print(list(on_cluster([5], kept_there, "local", 1)))
"""


def test_workers_compile_as_the_caller_does(tmp_path):
    """Also where the caller's script, which a worker imports first, imports JAX."""
    script = tmp_path / "script.py"
    script.write_text(SCRIPT)
    done = subprocess.run(
        [sys.executable, script, tmp_path / "kept"], capture_output=True, text=True, timeout=120, check=True
    )
    assert done.stdout.splitlines()[-1] == "[(5, 1, 0)]"


def test_no_scheduler_is_one_sentence(tmp_path, monkeypatch):
    monkeypatch.setattr("jaxmotor.fleet._cluster.CONNECT_S", 0.5)
    with pytest.raises(jm.JaxmotorError, match="no Dask scheduler answers"):
        list(on_cluster([1], slow_square, "tcp://127.0.0.1:9", None))
    with pytest.raises(jm.JaxmotorError, match="no Dask scheduler answers"):
        list(on_cluster([1], slow_square, "not an address", None))


def test_other_versions_are_one_sentence():
    here = versions()
    check_versions(here, {"tcp://a": dict(here)})
    with pytest.raises(jm.JaxmotorError, match=r"worker tcp://b has jax 0\.1, here it is"):
        check_versions(here, {"tcp://a": dict(here), "tcp://b": here | {"jax": "0.1"}})
    with pytest.raises(jm.JaxmotorError, match="has pyarrow none"):
        check_versions(here, {"tcp://b": {key: value for key, value in here.items() if key != "pyarrow"}})
