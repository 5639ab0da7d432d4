"""How long a diagnosis takes once its programs are loaded, beside one scalar simulation of the recording in C.

    make -C firmware plant && python benchmarks/diagnosis_speed.py [--rounds 5] [--ticks 100000]

Recordings of `hidden.py`, and a long one of so many ticks (0: none), diagnosed once more. The C loop
(`fleet_simulation.py`) simulates as many ticks of a motor with friction, exactly.
"""

import argparse
import ctypes
import statistics
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from fleet_simulation import DEAD_V, FRICTION_V, GAIN, PERIOD_S, POLE, SUPPLY_V, compiled
from hidden import draw

from jaxmotor._runtime import keep_programs
from jaxmotor.diagnosis import diagnose
from jaxmotor.recording import Recording, from_arrays

COUNTS_PER_REV = 1400.0
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


def simulation(folder: Path, volts: np.ndarray) -> Callable[[], np.ndarray]:
    """Gives the turn of the shaft in each tick [rad]."""
    loop = compiled(folder).simulate
    turn = np.empty_like(volts)
    pointers = (volts.ctypes.data_as(ctypes.c_void_p), turn.ctypes.data_as(ctypes.c_void_p))
    numbers = [ctypes.c_double(x) for x in (PERIOD_S, GAIN, POLE, FRICTION_V, DEAD_V)]
    return lambda: (volts, loop(*pointers, ctypes.c_long(1), ctypes.c_long(len(volts)), *numbers), turn)[-1]


def long_recording(folder: Path, ticks: int) -> Recording:
    """Of a motor with friction and a dead zone, under random voltages that are held for 10 to 100 ticks."""
    rng = np.random.default_rng(1)
    volts = np.repeat(rng.uniform(-SUPPLY_V, SUPPLY_V, ticks // 10), rng.integers(10, 100, ticks // 10))[:ticks]
    angle = np.append(0.0, np.cumsum(simulation(folder, volts)())[:-1])
    counts = np.floor(angle * COUNTS_PER_REV / (2 * np.pi)).astype(int)
    return from_arrays(
        time_s=PERIOD_S * np.arange(ticks),
        volts=volts,
        counts=counts,
        counts_per_rev=COUNTS_PER_REV,
        supply_V=SUPPLY_V,
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--ticks", type=int, default=100_000)
    given = parser.parse_args()
    keep_programs(threads=True)
    print("| hidden | ticks | diagnosis, s | one simulation in C, ms | ratio |")
    print("|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        logs = [(kind, draw(tuple(filter(None, kind.split("+"))), 4).recording, given.rounds) for kind in KINDS]
        if given.ticks:
            logs.append(("coulomb_friction+dead_zone", long_recording(Path(folder), given.ticks), 1))
        for kind, made, rounds in logs:
            ticks = sum(map(len, made.segments))
            own = seconds(lambda made=made: diagnose(made), rounds)
            scalar = seconds(simulation(Path(folder), 5 * np.sin(0.05 * np.arange(ticks))), 50)
            print(
                f"| {kind or 'nothing'} | {ticks} | {own:.2f} | {1e3 * scalar:.3f} | {own / scalar:.0f} |", flush=True
            )


if __name__ == "__main__":
    main()
