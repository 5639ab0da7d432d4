"""Listens to a run: every message to the journal first, then to whoever watches."""

import contextlib
import dataclasses
import signal
import threading
import time
from collections.abc import Iterator
from typing import Protocol, runtime_checkable

from jaxmotor.bench._assemble import Run
from jaxmotor.bench._journal import Journal, Kept
from jaxmotor.bench._log import Piece
from jaxmotor.bench._protocol import Message, RecorderError
from jaxmotor.bench._session import Session
from jaxmotor.bench._stops import check_end

LOOK_EVERY = 50
"""Samples between two checks of whether a segment may end early."""
STOPS = (signal.SIGINT, signal.SIGTERM)


@dataclasses.dataclass(frozen=True)
class Progress:
    """Where a recording stands."""

    experiment: int
    """Index in the plan."""
    experiments: int
    kind: str
    done_s: float
    """Of the whole plan [s]."""
    total_s: float
    lost: int
    """Samples that never came."""


@runtime_checkable
class Watch(Protocol):
    """Whoever wants to know while it records."""

    def say(self, text: str) -> None:
        """Something worth a line."""

    def progress(self, progress: Progress) -> None:
        """A few times a second."""

    def ended(self, run: Run, piece: Piece) -> None:
        """A segment is whole."""

    def enough(self, run: Run, piece: Piece) -> bool:
        """Whether the segment under way may end early."""
        return False


class Silent(Watch):
    """Watches nothing."""


def listen(session: Session, run: Run, journal: Journal, kept: Kept, watch: Watch) -> None:
    """Take in what comes of `run`, which was started, up to its end, and have the board account for its ticks.

    **Raises:** `RecorderError` where it ended early; `KeyboardInterrupt` after the motor has been stopped.
    """
    told, looked, skipped = 0.0, 0, -1
    try:
        for batch in _between_batches(session):
            for piece in _keep(batch, run, journal):
                watch.ended(run, piece)
            now = run.log.now
            if now is not None and not now.ended and abs(len(now) - looked) >= LOOK_EVERY:
                looked = len(now)
                segment = max(run.log.pieces)
                if skipped != segment and watch.enough(run, now):
                    skipped = segment
                    session.skip(segment)
            if now is not None and time.monotonic() - told > 0.1:
                told = time.monotonic()
                watch.progress(_progress(kept, run, now))
    except KeyboardInterrupt:
        _keep(session.stop(), run, journal)
        with contextlib.suppress(RecorderError):
            _account(session, run, journal)
        raise
    _account(session, run, journal)
    if run.log.now is not None:
        watch.progress(_progress(kept, run, run.log.now))
    check_end(session, run.log)


def _account(session: Session, run: Run, journal: Journal) -> None:
    journal.append([message.line for message in session.account(run.log) if message.line])


def _keep(batch: list[Message], run: Run, journal: Journal) -> list[Piece]:
    """Write messages down, then take them in; the pieces that they complete."""
    journal.append([message.line for message in batch if message.line])
    pieces = [run.log.feed(message) for message in batch]
    return [piece for piece in pieces if piece is not None]


def _between_batches(session: Session) -> Iterator[list[Message]]:
    """The session's messages; Ctrl-C comes between two batches, so that none is lost on its way to the journal."""
    pressed: list[int] = []
    mine = threading.current_thread() is threading.main_thread()
    before = {number: signal.getsignal(number) for number in STOPS if mine}
    try:
        for number in before:
            signal.signal(number, lambda number, frame: pressed.append(number))
        for batch in session.messages():
            yield batch
            if pressed:
                raise KeyboardInterrupt
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _progress(kept: Kept, run: Run, now: Piece) -> Progress:
    plan = kept.plan
    index = run.experiments[now.planned.slot]
    before = sum(e.ticks + e.rest_ticks for e in plan.experiments[:index])
    within = now.tick[-1] + 1 if now.tick else 0
    if now.planned.kind != "rest" or run.slots[now.planned.slot].kind == "rest":
        within += plan.experiments[index].rest_ticks
    lost = sum(each.log.lost for each in kept.runs)
    done = (before + within) * plan.period_s
    return Progress(index, len(plan.experiments), now.planned.kind, done, plan.seconds, lost)
