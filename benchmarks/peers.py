"""Gain, pole and friction of the same recordings by jaxmotor and by what else there is: errors and time.

    make -C firmware plant && python benchmarks/peers.py [--motors 10] [--peers-python PYTHON] [--only NAME...]

Random motors with Coulomb friction of 2-8 % of the supply on random plans (hidden.py): sines at two amplitudes, steps,
ramps, a closed loop; counts of the finely integrated plant. Everybody is given the same ticks, duties in volts and
counts, nothing else. What is missing is left out with a line that says how to install it. jax-sysid wants another JAX
than jaxmotor: give the peers an environment of their own and its Python as `--peers-python`,

    python -m venv peers && peers/bin/pip install sysidentpy sippy-unipi jax-sysid

Models in discrete time become gain, pole and friction by `from_discrete` in _peer_records.py. Times are of the
processor, on all cores together: machines are shared.
"""

import argparse
import json
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from _peer_records import Found, Record
from hidden import Hidden, draw
from scipy.io import savemat
from scipy.optimize import minimize

from jaxmotor._runtime import keep_programs
from jaxmotor.diagnosis import diagnose
from jaxmotor.estimate import identify
from jaxmotor.recording import Recording

HERE = Path(__file__).parent
LIMIT_S = 1800
FINE = 5
"""Steps in a tick of the simulation that one would write by hand."""
INSTALL = {
    "octave": "apt-get install octave, or octave.org",
    "sysidentpy": "pip install sysidentpy",
    "sippy_unipi": "pip install sippy-unipi",
    "jax_sysid": "pip install jax-sysid, in an environment of its own (it wants jax 0.4.31)",
}
PACKAGES = {
    "sysidentpy": ("SysIdentPy, extended least squares, sgn v", "sysidentpy"),
    "sippy_armax": ("SIPPY, ARMAX, sgn v", "sippy_unipi"),
    "sippy_n4sid": ("SIPPY, N4SID, sgn v", "sippy_unipi"),
    "jax_sysid_linear": ("jax-sysid, linear", "jax_sysid"),
    "jax_sysid_friction": ("jax-sysid, tanh friction written by hand", "jax_sysid"),
}
Row = tuple[float, float, float, float]
"""Gain, pole, friction, seconds."""


def record_of(recording: Recording) -> Record:
    segments = recording.segments
    assert recording.period_s and recording.counts_per_rev
    counts = [segment.count for segment in segments if segment.count is not None]
    lengths = [len(segment) for segment in segments]
    about = {
        name: np.array([float(segment.parameters.get(name, np.nan)) for segment in segments])
        for name in ("frequency_Hz", "amplitude_V")
    }
    return Record(
        np.concatenate([segment.volts for segment in segments]),
        np.concatenate(counts).astype(float),
        np.cumsum([0, *lengths[:-1]]),
        np.array([segment.kind for segment in segments]),
        about["frequency_Hz"],
        about["amplitude_V"],
        recording.period_s,
        2 * np.pi / recording.counts_per_rev,
    )


def sysid(record: Record) -> Found:
    """WPILib's SysId, as its sources do it: central accelerations over three rows; ramps without their rest, steps from
    their largest acceleration until 90 % of their speed is reached, and as long again as it took to get going."""
    rows = []
    for kind, volts, angle in record.segments:
        if kind not in ("ramp", "step"):
            continue
        table = _accelerations(volts, angle, record.period_s, 1)
        if kind == "ramp":
            noise = float(np.std(table[:, 0] - np.convolve(table[:, 0], np.full(9, 1 / 9), "same")))
            table = table[(table[:, 1] != 0) & (np.abs(table[:, 0]) > noise)]
        else:
            direction = np.sign(volts[-1])
            first = int(np.argmax(direction * table[:, 3]))
            reached = int(np.argmax(np.abs(table[:, 0]) > 0.9 * np.abs(table[:, 0]).max()))
            table = table[first : max(reached + first, first + 3)]
        rows.append(table)
    return _regressed(np.concatenate(rows))


def smoothed_regression(record: Record) -> Found:
    """The same regression on everything that moves, speeds and accelerations over nine ticks."""
    tables = [_accelerations(volts, angle, record.period_s, 4) for _, volts, angle in record.segments]
    table = np.concatenate(tables)
    return _regressed(table[np.abs(table[:, 0]) > 4 * record.rad_per_count / record.period_s])


def _accelerations(volts: np.ndarray, angle: np.ndarray, period_s: float, half: int) -> np.ndarray:
    """(n, 4) speed, mean voltage, sign of the speed, and acceleration, all centred on the tick: no delay is left in."""
    width = 2 * half
    speed = (angle[width:] - angle[:-width]) / (width * period_s)
    mean_volts = np.convolve(volts, np.full(width, 1 / width), "valid")[: len(speed)]
    acceleration = (speed[width:] - speed[:-width]) / (width * period_s)
    inner = slice(half, len(speed) - half)
    return np.stack([speed[inner], mean_volts[inner], np.sign(speed[inner]), acceleration], axis=1)


def _regressed(table: np.ndarray) -> Found:
    """dv/dt = α v + β u + γ sgn v: K = -β/α, a = -α, kS = -γ/β."""
    table = table[table[:, 3] != 0]
    alpha, beta, gamma = np.linalg.lstsq(table[:, :3], table[:, 3], rcond=None)[0].tolist()
    return -beta / alpha, -alpha, -gamma / beta


def paper_in_scipy(record: Record) -> Found:
    """The paper's procedure with scipy's Nelder-Mead, as _peer_paper.m does it with Octave's."""
    responses, frequencies, gains = [], [], []
    period = record.period_s
    for index, (kind, _, angle) in enumerate(record.segments):
        frequency, amplitude = record.frequency_Hz[index], record.amplitude_V[index]
        if kind == "sine":
            speed = np.diff(angle) / period
            turn = 2 * np.pi * frequency * period * np.arange(1, len(speed) + 1)

            def cost(x, speed=speed, turn=turn):
                return float(((speed - x[0] * np.sin(turn + x[1])) ** 2).sum())

            tries = [minimize(cost, (np.abs(speed).max(), phase), method="Nelder-Mead") for phase in (0, -1, -2)]
            best = min(tries, key=lambda one: one.fun).x
            responses.append(best[0] * np.exp(1j * best[1]) / amplitude)
            frequencies.append(frequency)
        elif kind == "step":
            half = len(angle) // 2
            gains.append((angle[-1] - angle[half]) / (period * (len(angle) - 1 - half)) / amplitude)
    gain, s = float(np.mean(gains)), 2j * np.pi * np.array(frequencies)

    def misfit(a):
        ratio = np.array(responses) * (s + a[0]) / (gain * a[0]) * s * period / (1 - np.exp(-s * period))
        return float(((20 * np.log10(np.abs(ratio))) ** 2 + np.rad2deg(np.angle(ratio)) ** 2).sum())

    return gain, float(minimize(misfit, [30.0], method="Nelder-Mead").x[0]), np.nan


def simulated_in_scipy(record: Record) -> Found:
    """Nelder-Mead on the simulated mean speed of a motor with friction, `FINE` exact steps a tick that end at rest
    where the shaft would turn back: what one would write by hand."""
    gain, pole, friction = smoothed_regression(record)
    rows = max(len(volts) for _, volts, _ in record.segments) - 1
    volts, speed, held = (np.zeros((rows, len(record.first))) for _ in range(3))
    for sequence, (_, u, angle) in enumerate(record.segments):
        volts[: len(u) - 1, sequence], held[: len(u) - 1, sequence] = u[:-1], 1.0
        speed[: len(u) - 1, sequence] = np.diff(angle) / record.period_s

    def cost(logs):
        gain, pole, friction = np.exp(logs)
        return float((held * (_mean_speed(volts, gain, pole, friction, record.period_s) - speed) ** 2).sum())

    start = np.log([gain, pole, max(friction, 0.02)])
    options = {"xatol": 1e-5, "fatol": 1e-3, "maxiter": 300}
    gain, pole, friction = np.exp(minimize(cost, start, method="Nelder-Mead", options=options).x).tolist()
    return gain, pole, friction


def _mean_speed(volts: np.ndarray, gain: float, pole: float, friction: float, period_s: float) -> np.ndarray:
    """(n, s) of motors that start at rest under `volts` (n, s)."""
    p = np.exp(-pole * period_s / FINE)
    share = (1 - p) / (pole * period_s / FINE)
    shown, speed = np.zeros_like(volts), np.zeros(volts.shape[1])
    for row, u in enumerate(volts):
        from_rest = np.sign(u) * np.maximum(np.abs(u) - friction, 0.0)
        for _ in range(FINE):
            net = gain * np.where(speed == 0, from_rest, u - friction * np.sign(speed))
            after = p * speed + (1 - p) * net
            turns = speed * after < 0
            shown[row] += np.where(turns, 0.0, share * speed + (1 - share) * net) / FINE
            speed = np.where(turns, 0.0, after)
    return shown


def linear(recording: Recording) -> Found:
    motor = identify(recording).motor
    return float(motor.gain), float(motor.pole), np.nan


def diagnosed(recording: Recording) -> Found:
    found = diagnose(recording)
    sizes = [one.parameters["volts_V"] for one in found.effects if one.name in ("coulomb_friction", "stiction")]
    motor = found.motor.linear
    return float(motor.gain), float(motor.pole), sizes[0] if sizes else np.nan


OURS: dict[str, Callable[[Recording], Found]] = {"jaxmotor identify": linear, "jaxmotor diagnose": diagnosed}
HERE_TOO: dict[str, Callable[[Record], Found]] = {
    "WPILib SysId, as in its sources": sysid,
    "the same regression, smoothed, all data": smoothed_regression,
    "the paper, scipy's Nelder-Mead": paper_in_scipy,
    "simulation with friction, scipy's Nelder-Mead": simulated_in_scipy,
}
OCTAVE = "the paper, Octave's fminsearch"


def timed(estimate: Callable[..., Found], given: Recording | Record) -> Row:
    begin = time.process_time()
    found = estimate(given)
    return *found, time.process_time() - begin


def in_octave(records: list[Record], folder: Path) -> list[Row] | str:
    """Rows, or why there are none."""
    if shutil.which("octave-cli") is None:
        return f"octave is missing: {INSTALL['octave']}"
    codes = {"sine": 1.0, "step": 2.0}
    files = []
    for index, record in enumerate(records):
        files.append(str(folder / f"{index}.mat"))
        values = record._asdict() | {"first": record.first + 1.0, "kind": [codes.get(k, 0.0) for k in record.kind]}
        savemat(files[-1], values)
    command = ["octave-cli", "--quiet", "--no-gui", "--no-init-file", str(HERE / "_peer_paper.m"), *files]
    return [(gain, pole, np.nan, seconds) for gain, pole, seconds in _lines(command)]


def in_package(name: str, records: list[Record], folder: Path, python: str) -> list[Row] | str:
    """Rows, or why there are none."""
    _, module = PACKAGES[name]
    if subprocess.run([python, "-c", f"import {module}"], check=False, capture_output=True).returncode:
        return f"{module} is missing: {INSTALL[module]} (and --peers-python)"
    files = [str(folder / f"{index}.npz") for index in range(len(records))]
    for file, record in zip(files, records, strict=True):
        np.savez(file, **record._asdict())
    return [(row[0], row[1], row[2], row[3]) for row in _lines([python, str(HERE / "_peer_packages.py"), name, *files])]


def _lines(command: list[str]) -> list[list[float]]:
    done = subprocess.run(command, stdout=subprocess.PIPE, text=True, timeout=LIMIT_S, check=True)
    return [json.loads(line) for line in done.stdout.splitlines() if line.startswith("[")]


def errors(rows: list[Row], hidden: list[Hidden]) -> np.ndarray:
    """(motor, 3) [%] of gain, pole and friction; NaN where there is no estimate."""
    truth = np.array([(one.gain, one.pole, one.truth["coulomb_friction"]["volts_V"]) for one in hidden])
    return 100 * np.abs(np.array(rows)[:, :3] / truth - 1)


def shown(name: str, rows: list[Row], off: np.ndarray) -> str:
    cells = []
    for column in off.T:
        good = column[np.isfinite(column)]
        missing = len(column) - len(good)
        few = f" ({missing} without)" if 0 < missing < len(column) else ""
        cells.append(f"{np.median(good):.2g} / {good.max():.2g}{few}" if len(good) else "-")
    seconds = [row[3] for row in rows]
    return f"| {name} | {' | '.join(cells)} | {np.median(seconds):.2g} ({seconds[0]:.2g}) |"


def ratios(offs: dict[str, np.ndarray]) -> list[str]:
    """The best peer's median error over ours, and the worst; what gives no estimate of a motor is no best peer."""
    lines = []
    for index, name in enumerate(("gain", "pole", "friction")):
        mine = offs["jaxmotor diagnose"][:, index]
        for word, of in (("median", np.median), ("worst", np.max)):
            peers = {peer: of(off[:, index]) for peer, off in offs.items() if peer not in OURS}
            peers = {peer: value for peer, value in peers.items() if np.isfinite(value)}
            if peers:
                best = min(peers, key=lambda peer: peers[peer])
                lines.append(f"{name}, {word}: {peers[best] / of(mine):.3g} times ours is the best peer's ({best})")
    return lines


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--motors", type=int, default=10)
    parser.add_argument("--first", type=int, default=5000, help="seed of the first")
    parser.add_argument("--peers-python", default=sys.executable, help="Python of an environment with the peers")
    parser.add_argument("--only", nargs="*", help="parts of names")
    given = parser.parse_args()
    keep_programs(threads=False)
    hidden = [draw(("coulomb_friction",), given.first + k) for k in range(given.motors)]
    records = [record_of(one.recording) for one in hidden]
    offs: dict[str, np.ndarray] = {}
    print("| | gain, % off: median / worst | pole | friction | processor s per motor (the first) |")
    print("|---|---|---|---|---|")

    def tell(name: str, found: list[Row] | str) -> None:
        if isinstance(found, str):
            print(f"| {name} | left out: {found} | | | |", flush=True)
            return
        offs[name] = errors(found, hidden)
        print(shown(name, found, offs[name]), flush=True)

    def wanted(name: str) -> bool:
        return given.only is None or any(part in name for part in given.only)

    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for peer, estimate in OURS.items():
            if wanted(peer):
                tell(peer, [timed(estimate, one.recording) for one in hidden])
        for peer, estimate in HERE_TOO.items():
            if wanted(peer):
                tell(peer, [timed(estimate, record) for record in records])
        if wanted(OCTAVE):
            tell(OCTAVE, in_octave(records, folder))
        for key, (peer, _) in PACKAGES.items():
            if wanted(peer):
                tell(peer, in_package(key, records, folder, given.peers_python))
    if "jaxmotor diagnose" in offs:
        print("\n".join(["", *ratios(offs)]))


if __name__ == "__main__":
    main()
