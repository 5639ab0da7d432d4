"""The one file that opens a port: a serial port, socket://HOST:PORT, or the emulated bench."""

import contextlib
import dataclasses
import errno
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import serial
from serial.tools import list_ports

from jaxmotor.bench._emulator import Emulator
from jaxmotor.bench._protocol import RecorderError

EMULATED = "emulated"
WAIT_S = 0.02
"""Longest time that a read waits."""
_PORT_ERRORS = (serial.SerialException, OSError, TypeError)
"""pyserial raises a TypeError when another thread closes the port under a read."""


@dataclasses.dataclass(frozen=True)
class Patience:
    """How long to wait for a board."""

    hello_s: float = 4.0
    """For the first word; a bootloader takes two of them."""
    again_s: float = 0.3
    """For an answer, until it is asked again."""
    silent_s: float = 2.0
    """For any word at all, once it was heard."""


EMULATED_PATIENCE = Patience(hello_s=20.0, silent_s=20.0)
"""The emulated bench answers when it gets to it."""


class PortGone(RecorderError):
    """The port vanished while it was in use."""


class Port:
    """Bytes to and from the board. `name` is what the user called it."""

    def __init__(
        self,
        name: str,
        baud: int = 115200,
        *,
        plant: Path | None = None,
        seed: int | None = None,
        options: Sequence[str] = (),
        patience: Patience | None = None,
    ) -> None:
        """`plant`, `seed` and `options` are for the emulated bench.

        **Raises:** `RecorderError` where the port cannot be opened, with the reason and what to do.
        """
        self.name = name
        self.emulator = Emulator(plant, seed, options) if name == EMULATED else None
        self.patience = patience or (Patience() if self.emulator is None else EMULATED_PATIENCE)
        url = name if self.emulator is None else self.emulator.url
        self._is_socket = url.startswith("socket:")
        self._serial: Any = None
        try:
            self._serial = serial.serial_for_url(url, baudrate=baud, timeout=WAIT_S, write_timeout=1, exclusive=True)
        except (serial.SerialException, OSError, ValueError) as error:
            self.close()
            raise RecorderError(_why_not(name, error)) from error

    @property
    def lockstep(self) -> bool:
        """Time passes as fast as the board can: waits by the wall clock mean little."""
        return self.emulator is not None

    @property
    def baud(self) -> int:
        """Now."""
        return self._serial.baudrate

    @baud.setter
    def baud(self, rate: int) -> None:
        try:
            self._serial.baudrate = rate
        except _PORT_ERRORS as error:
            raise RecorderError(f"{self.name}: the port does not do {rate} baud ({error})") from error

    def read(self) -> bytes:
        """What has come, after at most `WAIT_S`; empty where nothing has.

        **Raises:** `PortGone`.
        """
        try:
            return self._read_socket() if self._is_socket else self._serial.read(max(1, self._serial.in_waiting))
        except _PORT_ERRORS as error:
            raise PortGone(_gone(self.name)) from error

    def _read_socket(self) -> bytes:
        """A socket does not tell how much waits, and pyserial's read drops what it has when it meets the end."""
        self._serial.timeout = WAIT_S
        first = self._serial.read(1)
        self._serial.timeout = 0
        with contextlib.suppress(*_PORT_ERRORS):
            first += self._serial.read(65536) if first else b""
        return first

    def write(self, data: bytes) -> None:
        """**Raises:** `PortGone`."""
        try:
            self._serial.write(data)
        except _PORT_ERRORS as error:
            raise PortGone(_gone(self.name)) from error

    def close(self) -> None:
        """Let the port go; the emulated bench ends."""
        if self._serial is not None:
            # pyserial forgets to close a socket whose other end has gone.
            forgotten = getattr(self._serial, "_socket", None)
            with contextlib.suppress(*_PORT_ERRORS):
                self._serial.close()
            if forgotten is not None:
                forgotten.close()
        if self.emulator is not None:
            self.emulator.close()

    def __enter__(self) -> "Port":
        return self

    def __exit__(self, *exc: object) -> None:
        self.close()


def _gone(name: str) -> str:
    return f"{name}: the port has vanished; plug the board in again, and continue with --resume"


def _why_not(name: str, error: Exception) -> str:
    number = getattr(error, "errno", None)
    text = str(error)
    if number == errno.EACCES:
        remedy = "add yourself to the group dialout (sudo usermod -aG dialout $USER) and log in again"
        return f"{name}: no permission to open the port; {remedy}"
    if number in (errno.EBUSY, errno.EWOULDBLOCK) or "exclusively lock" in text:
        return f"{name}: the port is in use; close the serial monitor or the other recorder that has it open"
    if name.startswith("socket:"):
        return f"{name}: nothing answers there ({_reason(error)}); start what listens, or correct host and port"
    if number in (errno.ENOENT, errno.ENODEV, errno.ENXIO):
        return f"{name}: there is no such port; {_those_there()}"
    return f"{name}: the port cannot be opened ({_reason(error)}); {_those_there()}"


def _reason(error: Exception) -> str:
    text = str(error)
    return text.rpartition(": ")[2] if text else type(error).__name__


def _those_there() -> str:
    ports = [port.device for port in list_ports.comports() if sys.platform != "linux" or port.hwid != "n/a"]
    if ports:
        return f"there are {', '.join(sorted(ports))}"
    return "no board is plugged in; connect it by USB, or record from the emulated bench with --port emulated"
