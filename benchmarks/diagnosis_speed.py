"""How long a diagnosis takes once its programs are loaded, beside one scalar simulation of the recording in C.

    make -C firmware plant && python benchmarks/diagnosis_speed.py [--rounds 5]

Recordings of `hidden.py`; the C loop (`fleet_simulation.py`) simulates as many ticks of a motor with friction, exactly.
"""

import argparse
import ctypes
import statistics
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from fleet_simulation import DEAD_V, FRICTION_V, GAIN, PERIOD_S, POLE, compiled
from hidden import draw

from jaxmotor._runtime import keep_programs
from jaxmotor.diagnosis import diagnose

KINDS = ("", "coulomb_friction", "transport_delay", "supply_sag", "cogging", "coulomb_friction+transport_delay")


def seconds(function: Callable[[], object], rounds: int) -> float:
    """The median of `rounds` runs after one that is not counted."""
    function()
    times = []
    for _ in range(rounds):
        begin = time.perf_counter()
        function()
        times.append(time.perf_counter() - begin)
    return statistics.median(times)


def simulation(folder: Path, ticks: int) -> Callable[[], object]:
    loop = compiled(folder).simulate
    volts = 5 * np.sin(0.05 * np.arange(ticks))
    turn = np.empty_like(volts)
    pointers = (volts.ctypes.data_as(ctypes.c_void_p), turn.ctypes.data_as(ctypes.c_void_p))
    numbers = [ctypes.c_double(x) for x in (PERIOD_S, GAIN, POLE, FRICTION_V, DEAD_V)]
    return lambda: (volts, loop(*pointers, ctypes.c_long(1), ctypes.c_long(ticks), *numbers))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=5)
    rounds = parser.parse_args().rounds
    keep_programs(threads=True)
    print("| hidden | ticks | diagnosis, s | one simulation in C, ms | ratio |")
    print("|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        for kind in KINDS:
            made = draw(tuple(filter(None, kind.split("+"))), 4).recording
            ticks = sum(map(len, made.segments))
            own = seconds(lambda made=made: diagnose(made), rounds)
            scalar = seconds(simulation(Path(folder), ticks), 50)
            print(
                f"| {kind or 'nothing'} | {ticks} | {own:.2f} | {1e3 * scalar:.3f} | {own / scalar:.0f} |", flush=True
            )


if __name__ == "__main__":
    main()
