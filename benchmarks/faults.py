"""What damage between board and recorder, and to the recorder, costs: counted, on the emulated board.

    python benchmarks/faults.py [--small]

docs/reliability.md holds the figures of a full run.
"""

import argparse
import contextlib
import random
import selectors
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterable
from pathlib import Path

from testing.line import Board, Samples, damage, noise, samples_in, samples_of

from jaxmotor.bench import Decoder, Incomplete, Plan, Port, RecorderError, parse_plan, record, recover
from jaxmotor.bench._protocol import Sample
from jaxmotor.recording import read

PLAN = """
period_ms = 5
rest_s = 0.1
[[experiment]]
kind = "sine"
frequency_Hz = [2.007, 5.013]
amplitude_V = 5.1
duration_s = 1.5
[[experiment]]
kind = "step"
amplitude_V = [4, -4]
duration_s = 0.5
"""
SLOW = PLAN.replace("duration_s = 1.5", "duration_s = 30")
RECORDER = """
import sys
from pathlib import Path
from jaxmotor.bench import Port, parse_plan, record
plan, port, output = sys.argv[1:]
record(parse_plan(plan, "plan"), lambda: Port(port), Path(output), check=False)
"""


def short_plan(text: str = PLAN) -> Plan:
    """The plan that is recorded over and over."""
    return parse_plan(text, "faults")


class Relay:
    """An emulated board on a TCP port, and a line to it that damages what the board says.

    `damage` gets what the board said and returns what arrives. `cut_after` bytes the line breaks.
    """

    def __init__(
        self,
        damage: Callable[[bytes], bytes] = bytes,
        cut_after: int | None = None,
        mode: str = "lockstep",
        options: Iterable[str] = (),
    ) -> None:
        self._bench = Board(*options, mode=mode, once=True)
        self._board = socket.create_connection(("127.0.0.1", int(self._bench.url.rpartition(":")[2])))
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.url = f"socket://127.0.0.1:{self._listener.getsockname()[1]}"
        self.said = bytearray()
        """All that the board said, undamaged."""
        self.passed: list[tuple[float, int]] = []
        """When how much of it had been passed on."""
        self._damage, self._left = damage, cut_after
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def __enter__(self) -> "Relay":
        return self

    def __exit__(self, *exc: object) -> None:
        self._listener.close()
        self._board.close()
        self._thread.join(timeout=5)
        self._bench.__exit__()

    def _run(self) -> None:
        with contextlib.suppress(OSError):
            host, _ = self._listener.accept()
            host.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            with host, selectors.DefaultSelector() as selector:
                for side in (host, self._board):
                    selector.register(side, selectors.EVENT_READ)
                while all(self._pass(key.fileobj is host, host) for key, _ in selector.select(0.5)):
                    pass
                self._hang_up(host)
            self._board.close()

    @staticmethod
    def _hang_up(host: socket.socket) -> None:
        """Say no more and read on: closing at once would take back what is still on its way to the host."""
        with contextlib.suppress(OSError):
            host.shutdown(socket.SHUT_WR)
            host.settimeout(2)
            while host.recv(65536):
                pass

    def _pass(self, from_host: bool, host: socket.socket) -> bool:
        data = (host if from_host else self._board).recv(65536)
        if from_host:
            self._board.sendall(data)
            return bool(data)
        self.said += data
        if self._left is not None:
            self._left -= len(data)
            if self._left <= 0:
                host.sendall(data[: len(data) + self._left])
                return False
        host.sendall(self._damage(data))
        self.passed.append((time.monotonic(), len(self.said)))
        return bool(data)


def byte_errors(faults: int, per_log: int, rng: random.Random) -> tuple[int, int, int]:
    """Faults in a log, read by the decoder: faults made, samples accepted, samples wrong."""
    with tempfile.TemporaryDirectory() as folder, Relay() as relay:
        record(short_plan(), lambda: Port(relay.url), Path(folder) / "r.csv", check=False)
        log = bytes(relay.said)
    sent = samples_in(log)
    made = accepted = wrong = 0
    while made < faults:
        for message in Decoder().feed(damage(log, per_log, rng)):
            if isinstance(message, Sample):
                accepted += 1
                wrong += sent.get((message.segment, message.tick)) != (message.duty, message.count)
        made += per_log
    return made, accepted, wrong


def noisy_run(rate: float, rng: random.Random) -> tuple[int, int, int]:
    """A recording over a line with `rate` faults per byte: samples sent, recorded, wrong."""
    plan = short_plan()
    with tempfile.TemporaryDirectory() as folder, Relay(noise(rate, rng)) as relay:
        output = Path(folder) / "r.csv"
        with contextlib.suppress(Incomplete):
            record(plan, lambda: Port(relay.url), output, check=False)
        sent, came = samples_in(bytes(relay.said)), samples_of(read(output), plan)
    return len(sent), len(came), sum(sent.get(key) != value for key, value in came.items())


def disconnect(at: int, folder: Path) -> tuple[int, int, int]:
    """The line breaks after `at` bytes; then `recover`: whole samples passed on, recovered, wrong."""
    output, plan = folder / f"d{at}.csv", short_plan()
    with Relay(cut_after=at) as relay:
        with contextlib.suppress(RecorderError):
            record(plan, lambda: Port(relay.url), output, check=False, force=True)
        sent = samples_in(bytes(relay.said[:at]))
    return _compare(sent, output, plan)


def kill(after_s: float, folder: Path) -> tuple[int, int, float]:
    """SIGKILL to the recorder: samples passed on, wrong, and how old the newest sample that was lost had become [s]."""
    output, plan = folder / "k.csv", short_plan(SLOW)
    with Relay(mode="real") as relay:
        process = subprocess.Popen([sys.executable, "-c", RECORDER, SLOW, relay.url, str(output)])
        deadline = time.monotonic() + 20
        while b"\nD " not in relay.said and time.monotonic() < deadline:
            time.sleep(0.01)
        time.sleep(after_s)
        process.send_signal(signal.SIGKILL)
        killed = time.monotonic()
        process.wait()
        said, passed = bytes(relay.said), list(relay.passed)
    try:
        came = samples_of(recover(output), plan)
    except RecorderError:
        came = {}
    wrong = sum(samples_in(said).get(key) != value for key, value in came.items())
    oldest = 0.0
    for moment, length in passed:
        if moment > killed:
            break
        if not set(samples_in(said[:length])) <= set(came):
            oldest = killed - moment
            break
    for path in folder.glob("k.csv*"):
        path.unlink()
    return len(samples_in(said)), wrong, oldest


def _compare(sent: Samples, output: Path, plan: Plan) -> tuple[int, int, int]:
    came = {}
    with contextlib.suppress(RecorderError):
        whole = output.exists() and not output.with_name(output.name + ".part").exists()
        came = samples_of(read(output) if whole else recover(output), plan)
    return len(sent), len(came), sum(sent.get(key) != value for key, value in came.items())


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--small", action="store_true", help="a tenth of everything")
    scale = 10 if parser.parse_args().small else 1
    rng = random.Random(1)
    for per_log in (30, 300, 1000):
        made, accepted, wrong = byte_errors(10_000 // scale, per_log, rng)
        print(f"decoder: {made} faults, {per_log} per log: {accepted} samples accepted, {wrong} wrong", flush=True)
    runs = [noisy_run(2e-4, rng) for _ in range(20 // scale)]
    sent, came, wrong = (sum(column) for column in zip(*runs, strict=True))
    print(
        f"recorder: {len(runs)} recordings over a noisy line: {sent} sent, {came} recorded, {wrong} wrong", flush=True
    )
    with tempfile.TemporaryDirectory() as name:
        cuts = [disconnect(rng.randrange(200, 28_000), Path(name)) for _ in range(200 // scale)]
        sent, came, wrong = (sum(column) for column in zip(*cuts, strict=True))
        most = max(each[0] - each[1] for each in cuts)
        print(
            f"{len(cuts)} disconnects: {sent} arrived, {came} kept, at most {most} left out, {wrong} wrong", flush=True
        )
        kills = [kill(rng.uniform(0, 2), Path(name)) for _ in range(50 // scale)]
        sent, wrong = sum(each[0] for each in kills), sum(each[1] for each in kills)
        oldest = max(each[2] for each in kills)
        print(f"{len(kills)} kills: {sent} arrived, {wrong} wrong, lost at most the last {1000 * oldest:.0f} ms")


if __name__ == "__main__":
    main()
