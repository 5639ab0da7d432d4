"""One motor on the CPU and on the GPU, and many at once: why the package computes on the CPU where there are both.

    python benchmarks/devices.py

Each is measured in a process of its own: `identify` and `diagnose` of a bundled recording on the CPU and, by
`JAX_PLATFORMS=cuda`, on the GPU, cold and again; then the programs of `identify_fleet`, its motors one after the other
as the fleet does them, and side by side by thousands on the GPU. What a motor takes in Python beside them, to be
prepared and to become a row, is measured too. Without a GPU only the first of each is there.
"""

import argparse
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from typing import Any

import jax
import numpy as np
from fleet_scaling import motors as motors_of_a_fleet

import jaxmotor as jm
from jaxmotor._precision import device, in_float64, to_jax
from jaxmotor.fleet._batch import batch_program, identify_batch
from jaxmotor.fleet._ready import Ready, ready, stack
from jaxmotor.recording import bundled

UNLIKE = 32
"""Motors that are made; larger batches repeat them."""


def timed(call: Callable[[], Any]) -> tuple[float, float, Any]:
    """Seconds of a first call and of a second, and what it returns."""
    begin = time.perf_counter()
    jax.block_until_ready(call())
    middle = time.perf_counter()
    found = jax.block_until_ready(call())
    return middle - begin, time.perf_counter() - middle, found


def one_motor(where: str) -> None:
    given = bundled("paper")
    cold, warm, fit = timed(lambda: jm.identify(given))
    print(f"{where}: identify {cold:.1f} s cold, {warm:.2f} s warm (gain {fit.motor.gain:.9f} rad/s/V)", flush=True)
    cold, warm, found = timed(lambda: jm.diagnose(given))
    print(f"{where}: diagnose {cold:.1f} s cold, {warm:.1f} s warm ({', '.join(e.name for e in found.effects)})")


@in_float64
def many_motors(where: str, sizes: list[int]) -> None:
    given = [one for _, one in motors_of_a_fleet(UNLIKE)]
    begin = time.perf_counter()
    motors = [ready(one) for one in given]
    prepared = (time.perf_counter() - begin) / UNLIKE
    print(f"{where}: {1e3 * prepared:.2f} ms for each motor to be prepared, in Python")
    cold, warm, _ = timed(lambda: identify_batch(motors))
    each = 1e3 * warm / UNLIKE
    print(f"{where}: {UNLIKE} motors, one after the other, {cold:.1f} s cold, {each:.3f} ms each", flush=True)
    for size in sizes:
        cold, warm, _ = timed(lambda size=size: side_by_side(motors, size))
        print(f"{where}: {size} motors side by side, {cold:.1f} s cold, {1e3 * warm / size:.3f} ms each", flush=True)


def side_by_side(motors: list[Ready], size: int) -> Any:
    cases = stack([motors[k % UNLIKE].case for k in range(size)], size)
    one = to_jax(np.int32(1))
    return _side_by_side(to_jax(cases), one)


@jax.jit
def _side_by_side(cases: Any, one: jax.Array) -> Any:
    def alone(case: Any) -> Any:
        return batch_program(jax.tree.map(lambda leaf: leaf[None], case), one, one.astype("uint32"))

    return jax.vmap(alone)(cases)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sizes", type=int, nargs="*", default=[1024, 8192])
    parser.add_argument("--measured", help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.measured == "one":
        return one_motor(device().platform)
    if given.measured == "many":
        return many_motors(device().platform, given.sizes if device().platform != "cpu" else [])
    for platform in ("cpu", "cuda"):
        for measured in ("one", "many"):
            with tempfile.TemporaryDirectory() as folder:
                own = os.environ | {"JAX_PLATFORMS": platform, "JAXMOTOR_CACHE": folder}
                command = [sys.executable, __file__, "--measured", measured, "--sizes", *map(str, given.sizes)]
                done = subprocess.run(command, check=False, env=own, stderr=subprocess.PIPE, text=True)
                if done.returncode:
                    print(f"{platform}: nothing measured ({done.stderr.strip().splitlines()[-1][:100]})", flush=True)


if __name__ == "__main__":
    main()
