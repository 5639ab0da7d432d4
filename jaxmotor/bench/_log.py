"""What has come of a run, by segment; kept as numbers, a lost sample simply is not there.

How long each segment ran is what the board says of it, in the line that ends it, in the one that begins the next, or
when it is asked; it is never guessed. So what is missing can be told from what never was.
"""

import dataclasses
from array import array
from collections.abc import Iterator, Sequence

from jaxmotor.bench._protocol import Begin, End, Message, Ran, RunEnd, Sample, Status
from jaxmotor.bench._slots import Planned

COMPLETE = ("done", "skipped")
RUNNING = ("running", "idle")


@dataclasses.dataclass
class Piece:
    """One segment as it came."""

    planned: Planned
    tick: array = dataclasses.field(default_factory=lambda: array("q"))
    duty: array = dataclasses.field(default_factory=lambda: array("q"))
    count: array = dataclasses.field(default_factory=lambda: array("q"))
    supply_mV: array = dataclasses.field(default_factory=lambda: array("q"))
    """The last one told before or at the row; the board tells it every 100 ms."""
    ended: str = ""
    """Why; empty while it runs."""
    ran: int | None = None
    """Ticks; None while the board has not said."""
    began: int | None = None
    """Ticks since the run began; None where the board has not said."""

    def __len__(self) -> int:
        return len(self.tick)

    @property
    def complete(self) -> bool:
        """Came to its end, whatever was lost on the way."""
        return self.ended in COMPLETE

    @property
    def whole(self) -> bool:
        """Came to its end, and every tick that it ran is there."""
        fits = not self.tick or self.ran is None or self.tick[-1] < self.ran
        return self.complete and fits and self.ran == len(self.tick)

    @property
    def lost(self) -> int:
        """Samples that never came, as far as is known."""
        ticks = self.tick[-1] + 1 if self.tick else 0
        return max(0, (ticks if self.ran is None else self.ran) - len(self.tick))


class RunLog:
    """One run of the board: feed it messages."""

    def __init__(self, layout: Sequence[Planned], supply_mV: int, number: int) -> None:
        self.layout = tuple(layout)
        self.number = number
        """Of the run; what the board says of another is not taken."""
        self.pieces: dict[int, Piece] = {}
        self.reason = ""
        """Why the run ended; empty where that was not told."""
        self.ticks: int | None = None
        """That it ran in all; None where that was not told."""
        self.illegal = 0
        """Illegal encoder transitions."""
        self._supply_mV = supply_mV

    @property
    def now(self) -> Piece | None:
        """The segment under way."""
        return self.pieces[max(self.pieces)] if self.pieces else None

    @property
    def lost(self) -> int:
        """Samples that never came."""
        return sum(piece.lost for piece in self.pieces.values())

    @property
    def accounted(self) -> bool:
        """Whether the board has said why the run ended, and of each tick that it ran in which segment."""
        known = [piece.ran for piece in self.pieces.values() if piece.ran is not None]
        return bool(self.reason) and len(known) == len(self.pieces) and sum(known) == self.ticks

    def starts(self) -> Iterator[tuple[Piece, int]]:
        """The segments that came, each with the ticks since the run began at which it did."""
        at = 0
        for segment, planned in enumerate(self.layout):
            piece = self.pieces.get(segment)
            if piece is None:
                at += planned.ticks if self.ticks is None else 0
                continue
            at = at if piece.began is None else piece.began
            yield piece, at
            at += planned.ticks if piece.ran is None else piece.ran

    def feed(self, message: Message) -> Piece | None:
        """Take a message in; the piece that it completes, if it does."""
        if isinstance(message, Sample):
            self._add(message)
        elif getattr(message, "run", self.number) != self.number:
            return None
        elif isinstance(message, Begin):
            self._begin(message)
        elif isinstance(message, End):
            self.illegal = message.illegal
            return self._end(message)
        elif isinstance(message, RunEnd) or (isinstance(message, Status) and message.state not in RUNNING):
            self._end_run(message)
        elif isinstance(message, Ran) and self.reason:
            self._account(message)
        return None

    def _piece(self, segment: int) -> Piece | None:
        """A segment that begins ends those before it, should these lines have been lost."""
        if segment >= len(self.layout):
            return None
        if segment not in self.pieces:
            self.pieces[segment] = Piece(self.layout[segment])
            for before, piece in self.pieces.items():
                if before < segment and not piece.complete:
                    piece.ended = "done"
        return self.pieces[segment]

    def _begin(self, begin: Begin) -> None:
        piece = self._piece(begin.segment)
        if piece is None:
            return
        piece.began = begin.start
        before = self.pieces.get(begin.segment - 1)
        if before is not None and before.ran is None and before.began is not None:
            self._ran(before, begin.start - before.began)

    def _add(self, sample: Sample) -> None:
        piece = self._piece(sample.segment)
        if piece is None or self.reason or piece.ran is not None or sample.tick >= piece.planned.ticks:
            return
        if sample.supply_mV is not None:
            self._supply_mV = sample.supply_mV
        piece.tick.append(sample.tick)
        piece.duty.append(sample.duty)
        piece.count.append(sample.count)
        piece.supply_mV.append(self._supply_mV)

    def _end(self, end: End) -> Piece | None:
        piece = self._piece(end.segment)
        if piece is None:
            return None
        piece.ended, piece.ran = end.reason, end.ticks
        return piece

    def _end_run(self, end: RunEnd | Status) -> None:
        self.reason = end.reason if isinstance(end, RunEnd) else end.state
        self.ticks, self.illegal = end.ticks, end.illegal
        if self.now is not None and not self.now.ended:
            self.now.ended = self.reason

    def _account(self, told: Ran) -> None:
        """What the board says of slots, once the run is over."""
        by_slot = dict(enumerate(told.ticks, told.slot))
        for segment, planned in enumerate(self.layout):
            if planned.slot not in by_slot:
                continue
            ran = by_slot[planned.slot][not planned.is_rest_before]
            piece = self._piece(segment) if ran or segment in self.pieces else None
            if piece is not None:
                self._ran(piece, ran)
        if self.now is not None and self.now.ran != self.now.planned.ticks:
            self.now.ended = self.reason

    @staticmethod
    def _ran(piece: Piece, ticks: int) -> None:
        piece.ran = ticks
        if piece.ended == "done" and ticks < piece.planned.ticks:
            piece.ended = "skipped"
