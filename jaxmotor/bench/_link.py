"""A thread that reads the port and keeps the board alive; nothing in it waits for a disk."""

import contextlib
import queue
import threading
import time

from jaxmotor.bench._port import Port
from jaxmotor.bench._protocol import KEEPALIVE, Decoder, Message, encode

GATHER_S = 0.002
"""After something came, wait so long for more: fewer, longer reads."""
KEEPALIVE_S = 0.1
"""The board stops after 250 ms of silence."""


class Link:
    """Commands go out, messages come in; an error of the port comes out of `receive`."""

    def __init__(self, port: Port) -> None:
        self.decoder = Decoder()
        self.received = bytearray()
        """The first bytes received, to tell what else may be at the other end."""
        self._port = port
        self._numbers = 0
        self._messages: queue.SimpleQueue[Message | Exception] = queue.SimpleQueue()
        self._stopped = threading.Event()
        self._keep_alive = threading.Event()
        self._writing = threading.Lock()
        self._thread = threading.Thread(target=self._run, name="board", daemon=True)
        self._thread.start()

    def send(self, kind: str, *fields: int | str) -> int:
        """Send a command; its number.

        **Raises:** `RecorderError` where the port is gone.
        """
        self._numbers = self._numbers % 65535 + 1
        self.repeat(self._numbers, kind, *fields)
        return self._numbers

    def repeat(self, number: int, kind: str, *fields: int | str) -> None:
        """Send the command once more under its number."""
        with self._writing:
            self._port.write(encode(kind, number, *fields))

    def keep_alive(self) -> None:
        """From now on, tell the board every 100 ms that somebody is there."""
        self._keep_alive.set()

    def receive(self, timeout_s: float) -> list[Message]:
        """What has come, waiting at most `timeout_s` for the first.

        **Raises:** `RecorderError` where the port is gone.
        """
        try:
            items = [self._messages.get(timeout=timeout_s)]
        except queue.Empty:
            return []
        while not self._messages.empty():
            items.append(self._messages.get_nowait())
        messages = [item for item in items if isinstance(item, Message)]
        errors = [item for item in items if isinstance(item, Exception)]
        if errors and not messages:
            raise errors[0]
        for error in errors:  # after the messages that came before it
            self._messages.put(error)
        return messages

    def close(self) -> None:
        """End the thread."""
        self._stopped.set()
        self._thread.join(timeout=5)

    def _run(self) -> None:
        told = 0.0
        try:
            while not self._stopped.is_set():
                if self._read():
                    time.sleep(GATHER_S)
                now = time.monotonic()
                if self._keep_alive.is_set() and now - told >= KEEPALIVE_S:
                    told = now
                    with self._writing:
                        self._port.write(KEEPALIVE)
        except Exception as error:
            with contextlib.suppress(Exception):  # a port that takes nothing any more may still have something to say
                while self._read():
                    pass
            self._messages.put(error)

    def _read(self) -> bool:
        data = self._port.read()
        if len(self.received) < 4096:
            self.received += data
        for message in self.decoder.feed(data) if data else ():
            self._messages.put(message)
        return bool(data)
