"""A bench on a pseudo terminal or socket, and a host that reads it with pyserial."""

import re
import subprocess
import time
from pathlib import Path

import serial
from testing.wire import Line, unseal


class Live:
    """Start the bench and open its port. `raw` is everything received."""

    def __init__(self, build: Path, *options: str, transport=("--pty",), baud: int = 115200, once: bool = True):
        self.process = subprocess.Popen(
            [build / "bench", *transport, *(["--once"] if once else []), *options], stderr=subprocess.PIPE, text=True
        )
        where = self.process.stderr.readline()
        match = re.search(r"(/dev/\S+|socket://\S+)", where)
        assert match, where
        self._url, self._baud = match[1], baud
        self._socket = self._url.startswith("socket")
        self.open()

    def open(self) -> None:
        self.port = serial.serial_for_url(self._url, baudrate=self._baud, timeout=0.02)
        self.raw = b""

    def __enter__(self) -> "Live":
        return self

    def __exit__(self, *exc: object) -> None:
        self.port.close()
        try:
            self.process.wait(timeout=5 if "--once" in self.process.args else 0)
        except subprocess.TimeoutExpired:
            self.process.terminate()
            self.process.wait()
        self.process.stderr.close()

    def send(self, data: bytes) -> None:
        self.port.write(data)

    def receive(self) -> None:
        # A socket:// port only tells whether something waits, not how much.
        self.raw += self.port.read(4096 if self._socket else max(1, self.port.in_waiting))

    def lines(self) -> list[Line]:
        """The whole lines received so far, damaged ones left out."""
        parsed = (unseal(line) for line in self.raw[: self.raw.rfind(b"\n") + 1].splitlines())
        return [line for line in parsed if line]

    def until(self, wanted, timeout_s: float = 20) -> list[Line]:
        """Read until a line is `wanted`; all lines since the start."""
        deadline = time.monotonic() + timeout_s
        while True:
            if any(wanted(line) for line in self.lines()):
                return self.lines()
            assert time.monotonic() < deadline, self.raw[-300:]
            self.receive()
