"""Logs of small boards, imported as their users would and diagnosed: is what was hidden named, and nothing else?

    python benchmarks/board_logs.py [--programs arm fan ...] [--draws 1] [--seed 1] [--write DIR]

Each program of `testing/board_programs.py` drives a motor with friction and what its name says. Right: of each set that
was wanted one effect is named, or an alternative of it that the log does not tell from it, and no other.
"""

import argparse
import contextlib
import io
import tempfile
import time
from pathlib import Path

from _calibration import alike
from testing.board_logs import BoardLog, draw_log
from testing.board_programs import PROGRAMS

from jaxmotor import JaxmotorError, diagnose
from jaxmotor._runtime import keep_programs
from jaxmotor.cli import main as jaxmotor
from jaxmotor.diagnosis import Diagnosis
from jaxmotor.motor.effects import LEARNED
from jaxmotor.recording import Recording, read


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--programs", nargs="*", choices=PROGRAMS, default=list(PROGRAMS))
    parser.add_argument("--draws", type=int, default=1)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--write", type=Path, metavar="DIR", help="keep logs and recordings there")
    chosen = parser.parse_args()
    keep_programs(threads=True)
    columns = ("program", "seed", "rows", "named (probability)", "verdict", "drift chi2 held out")
    columns += ("gain, pole: errors off", "right", "s")
    print(f"| {' | '.join(columns)} |\n|{'---|' * len(columns)}", flush=True)
    asked = [(name, seed) for seed in range(chosen.seed, chosen.seed + chosen.draws) for name in chosen.programs]
    with tempfile.TemporaryDirectory() as temporary:
        folder = chosen.write or Path(temporary)
        folder.mkdir(parents=True, exist_ok=True)
        right = [_one(name, seed, folder) for name, seed in asked]
    print(f"\nright {sum(right)} of {len(right)}")


def _one(name: str, seed: int, folder: Path) -> bool:
    log = draw_log(name, seed)
    begin = time.perf_counter()
    try:
        recording = imported(log, folder / f"{name}-{seed}")
        found = diagnose(recording)
    except JaxmotorError as error:
        print(f"| {name} | {seed} | | {error} | | | | NO | |", flush=True)
        return False
    right, seconds = is_right(log, found), time.perf_counter() - begin
    causes = ", ".join(f"{' or '.join(alike(one))} ({one.family_probability:.2f})" for one in found.effects)
    held, rows = found.held_out, sum(map(len, recording.segments))
    print(
        f"| {name} | {seed} | {rows} | {causes or 'none'} | {found.verdict} "
        f"| {held.drift_before:.3g} -> {held.drift_after:.3g} | {_off(log, found)} | {'yes' if right else 'NO'} "
        f"| {seconds:.0f} |",
        flush=True,
    )
    return right


def imported(log: BoardLog, path: Path) -> Recording:
    """`log` through `jaxmotor import`, beside `path`."""
    text, own = path.with_suffix(".txt"), path.with_suffix(".csv")
    text.write_text(log.text)
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()) as said:
        if jaxmotor(["import", str(text), "-o", str(own), "--force", *log.flags]):
            raise JaxmotorError(said.getvalue().strip())
    return read(own)


def is_right(log: BoardLog, found: Diagnosis) -> bool:
    """Of the log's effects each is named, and no other."""
    named = [set(alike(one)) for one in found.effects if one.is_named]
    learned = {one.name for one in found.effects if one.name in LEARNED}
    asked = all(any(one & wanted for one in named) for wanted in log.wanted)
    allowed = log.allowed.union(*log.wanted)
    return asked and learned <= allowed and all(one & allowed for one in named if not one & set(LEARNED))


def _off(log: BoardLog, found: Diagnosis) -> str:
    """Gain and pole less the true ones, in standard errors."""
    motor, own = log.motor, found.motor.linear
    true = {"gain": motor.torque_Nm_A / motor.resistance / motor.damping_Nm_s, "pole": motor.pole_rad_s}
    error = dict(zip(true, found.standard_error.values(), strict=False))
    return ", ".join(f"{(float(getattr(own, name)) - value) / error[name]:.1f}" for name, value in true.items())


if __name__ == "__main__":
    main()
