"""What a command is doing, on the error stream: on a terminal at once and with the time, elsewhere only where it takes
long."""

import contextlib
import sys
import time
from collections.abc import Callable, Iterator

QUIET_S = 5.0
"""Before the first plain line, and between two of them."""


@contextlib.contextmanager
def progress(doing: str) -> Iterator[Callable[[str], None]]:
    """Say that the command is `doing` something, and give the function that says what it does next."""
    if not sys.stderr.isatty():
        yield _plain(time.monotonic())
        return
    from rich.console import Console
    from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

    columns = SpinnerColumn(), TimeElapsedColumn(), TextColumn("{task.description}", markup=False)
    console = Console(stderr=True)
    with Progress(*columns, console=console, transient=True, redirect_stdout=False, redirect_stderr=False) as bar:
        task = bar.add_task(doing)
        yield lambda text: bar.update(task, description=text, refresh=True)


def _plain(began: float) -> Callable[[str], None]:
    said = began

    def tell(text: str) -> None:
        nonlocal said
        if time.monotonic() - said > QUIET_S:
            said = time.monotonic()
            print(f"{said - began:.0f} s: {text}", file=sys.stderr, flush=True)

    return tell
