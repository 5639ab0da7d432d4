"""Blind recordings by the firmware: random motors with an effect hidden in them, recorded as a user would.

    make -C firmware plant && python benchmarks/hidden_board.py KIND SEED OUT.csv

As `hidden.py`, but the emulated board runs the plan, times the duties, counts the edges and sends the log; the recorder
checks nothing beforehand and writes what came. Of supply and encoder the recorder is told, as a voltmeter and a data
sheet would.
"""

import sys
import tempfile
import zlib
from pathlib import Path

import numpy as np
from hidden import Hidden, plant_file, sizes
from testing.hidden_plans import Rig, draw_rig

from jaxmotor.bench import Port, parse_plan, record
from jaxmotor.recording import write

SECONDS = 75.0
"""About what a plan lasts."""


def draw_on_board(kinds: tuple[str, ...], seed: int) -> Hidden:
    """A motor with `kinds` hidden in it, as the recorder gets it from the board.

    **Raises:** `RecorderError` where there is no toolchain to build the emulated board with.
    """
    root = np.random.SeedSequence([seed, 1, *(zlib.crc32(kind.encode()) for kind in sorted(kinds))])
    of_rig, of_plan, of_sizes = (np.random.default_rng(child) for child in root.spawn(3))
    rig = draw_rig(of_rig)
    truth = {kind: sizes(kind, rig, SECONDS, of_sizes, 1.0) for kind in sorted(kinds)}
    with tempfile.TemporaryDirectory() as folder:
        plant, out = Path(folder) / "plant.toml", Path(folder) / "hidden.csv"
        plant.write_text(plant_file(rig, truth))
        plan = parse_plan(plan_text(rig, "coast" if "coast_drive" in kinds else "brake", of_plan), "drawn at random")
        found = record(plan, lambda: Port("emulated", plant=plant), out, check=False)
    lag = truth.get("electrical_pole", {}).get("time_constant_s", rig.electrical_time_constant)
    return Hidden(found, truth, rig.gain, rig.pole, lag, rig.viscous_share)


def plan_text(rig: Rig, drive: str, rng: np.random.Generator) -> str:
    """The kind of plan that `--plan full` is, at this rig's voltages and speeds."""
    large, small = (round(rig.supply_V * rng.uniform(*of), 2) for of in ((0.7, 0.9), (0.2, 0.35)))
    frequencies = np.round(np.geomspace(0.45, min(20.0, 0.1 / rig.period_s), 7), 2).tolist()
    heights = [*np.round(rig.supply_V * np.sort(rng.uniform(0.25, 0.9, 3)), 2).tolist(), rig.supply_V]
    speeds = np.round(rig.gain * rig.supply_V * rng.uniform(0.25, 0.6, 2), 1).tolist()
    rest = max(0.4, 12 / rig.pole)
    experiments = [
        {"kind": "sine", "frequency_Hz": frequencies, "amplitude_V": large, "duration_s": 2.5, "periods": 2},
        {"kind": "sine", "frequency_Hz": frequencies[:5], "amplitude_V": small, "duration_s": 2.5, "periods": 2},
        {"kind": "step", "amplitude_V": [s * h for h in heights for s in (1, -1)], "duration_s": 0.8},
        *(
            {"kind": "ramp", "from_V": begin, "to_V": end, "duration_s": 3, "rest_s": pause}
            for begin, end, pause in ((0, large, rest), (large, 0, 0), (0, -large, rest), (-large, 0, 0))
        ),
        {"kind": "prbs", "amplitude_V": [large, small], "order": 7, "hold_ticks": 6, "duration_s": 3},
        {
            "kind": "closed_loop",
            "reference_rad_s": [speeds[0], -speeds[0], speeds[1]],
            "gain": round(rng.uniform(2.0, 5.0) / rig.gain, 3),
            "duration_s": 1,
        },
    ]
    head = {
        "name": '"drawn at random"',
        "period_ms": round(1000 * rig.period_s),
        "drive": f'"{drive}"',
        "rest_s": rest,
        "detune": "true",
        "supply_V": rig.supply_V,
        "supply_min_V": round(0.5 * rig.supply_V, 2),  # a sag is no empty battery
        "counts_per_rev": rig.counts_per_rev,
    }
    lines = [f"{key} = {value}" for key, value in head.items()]
    for experiment in experiments:
        lines += ["[[experiment]]", *(f"{key} = {_toml(value)}" for key, value in experiment.items())]
    return "\n".join(lines)


def _toml(value: object) -> str:
    return f'"{value}"' if isinstance(value, str) else str(value)


def main() -> None:
    if len(sys.argv) != 4 or not sys.argv[2].isdecimal():
        sys.exit(f"usage: python {sys.argv[0]} KIND SEED OUT.csv    (KIND: none, an effect, or two joined by +)")
    kind, seed, path = sys.argv[1:]
    write(draw_on_board(() if kind == "none" else tuple(kind.split("+")), int(seed)).recording, path)


if __name__ == "__main__":
    main()
