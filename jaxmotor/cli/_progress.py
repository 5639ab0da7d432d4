"""What a command is doing, on the error stream: on a terminal at once and with the time, elsewhere only where it takes
long."""

import contextlib
import sys
import threading
import time
from collections.abc import Callable, Iterator

QUIET_S = 5.0
"""Before the first plain line, and between two of them."""


@contextlib.contextmanager
def progress(doing: str, lasts: str = "") -> Iterator[Callable[[str], None]]:
    """Say that the command is `doing` something and how long all of it usually `lasts`, and give the function that says
    what it does next."""
    if not sys.stderr.isatty():
        with _Plain(doing) as plain:
            yield plain.tell
        return
    from rich.console import Console
    from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

    columns = [SpinnerColumn(), TimeElapsedColumn(), TextColumn("{task.description}", markup=False)]
    if lasts:
        columns.insert(2, TextColumn(f"({lasts})", style="dim", markup=False))
    console = Console(stderr=True)
    with Progress(*columns, console=console, transient=True, redirect_stdout=False, redirect_stderr=False) as bar:
        task = bar.add_task(doing)
        yield lambda text: bar.update(task, description=text, refresh=True)


class _Plain:
    """A line where nothing was said for `QUIET_S`: what is done now."""

    def __init__(self, doing: str):
        self.began = self.said = time.monotonic()
        self.doing, self.ended, self.lock = doing, threading.Event(), threading.Lock()
        self.thread = threading.Thread(target=self._repeat, daemon=True)

    def __enter__(self) -> "_Plain":
        self.thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.ended.set()
        self.thread.join()

    def tell(self, text: str) -> None:
        with self.lock:
            self.doing = text
            self._say()

    def _say(self) -> None:
        if time.monotonic() - self.said > QUIET_S:
            self.said = time.monotonic()
            print(f"{self.said - self.began:.0f} s: {self.doing}", file=sys.stderr, flush=True)

    def _repeat(self) -> None:
        while not self.ended.wait(min(max(0.1, self.said + QUIET_S - time.monotonic()), threading.TIMEOUT_MAX)):
            with self.lock:
                self._say()
