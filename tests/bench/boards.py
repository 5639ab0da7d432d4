"""Boards, and others who may sit at a port."""

import contextlib
import socket
import threading

from jaxmotor.bench._board import Board

BOARD = Board("1.0.0", 20, 250, 4e-5, 617.4, 60, 8, 7.4, 6.0, "power")


class Stranger:
    """A TCP port at which something says `greeting` to the first thing it hears, then `answer` each time."""

    def __init__(self, greeting: bytes, answer: bytes = b""):
        self._listener = socket.create_server(("127.0.0.1", 0))
        self.url = f"socket://127.0.0.1:{self._listener.getsockname()[1]}"
        self._thread = threading.Thread(target=self._run, args=(greeting, answer), daemon=True)
        self._thread.start()

    def __enter__(self) -> "Stranger":
        return self

    def __exit__(self, *exc: object) -> None:
        self._listener.close()
        self._thread.join(timeout=5)

    def _run(self, greeting: bytes, answer: bytes) -> None:
        with contextlib.suppress(OSError):
            host, _ = self._listener.accept()
            with host:
                say = greeting  # not at once: pyserial throws away what comes while it opens
                while host.recv(4096):
                    host.sendall(say)
                    say = answer
