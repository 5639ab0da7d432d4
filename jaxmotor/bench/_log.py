"""What has come of a run, by segment; kept as numbers, a lost sample simply is not there."""

import dataclasses
from array import array
from collections.abc import Sequence

from jaxmotor.bench._protocol import Begin, End, Message, RunEnd, Sample
from jaxmotor.bench._slots import Planned

COMPLETE = ("done", "skipped")


@dataclasses.dataclass
class Piece:
    """One segment as it came."""

    planned: Planned
    start: int
    """Ticks since the run began."""
    tick: array = dataclasses.field(default_factory=lambda: array("q"))
    duty: array = dataclasses.field(default_factory=lambda: array("q"))
    count: array = dataclasses.field(default_factory=lambda: array("q"))
    supply_mV: array = dataclasses.field(default_factory=lambda: array("q"))
    """The last one told before or at the row; the board tells it every 100 ms."""
    ended: str = ""
    """Why; empty where it was not told."""
    ticks: int = 0
    """When it ended."""

    def __len__(self) -> int:
        return len(self.tick)

    @property
    def complete(self) -> bool:
        """Came to its end, whatever was lost on the way."""
        return self.ended in COMPLETE

    @property
    def lost(self) -> int:
        """Samples that never came."""
        ticks = self.ticks if self.ended else (self.tick[-1] + 1 if self.tick else 0)
        return max(0, ticks - len(self.tick))


class RunLog:
    """One run of the board: feed it messages."""

    def __init__(self, layout: Sequence[Planned], supply_mV: int) -> None:
        self.layout = tuple(layout)
        self.pieces: dict[int, Piece] = {}
        self.reason = ""
        """Why the run ended; empty where that was not told."""
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

    def feed(self, message: Message) -> Piece | None:
        """Take a message in; the piece that it completes, if it does."""
        if isinstance(message, Sample):
            self._add(message)
        elif isinstance(message, Begin):
            piece = self._piece(message.segment)
            if piece is not None:
                piece.start = message.start
        elif isinstance(message, End):
            self.illegal = message.illegal
            return self._end(message)
        elif isinstance(message, RunEnd):
            self.reason, self.illegal = message.reason, message.illegal
        return None

    def _piece(self, segment: int) -> Piece | None:
        if segment >= len(self.layout):
            return None
        if segment not in self.pieces:
            self._begin(segment)
        return self.pieces[segment]

    def _begin(self, segment: int) -> None:
        """A segment that begins ends the one before it, should that line have been lost."""
        start = self.layout[segment].start
        before = self.pieces.get(segment - 1)
        if before is not None:
            if not before.ended:
                before.ended, before.ticks = "done", before.planned.ticks
            start = before.start + before.ticks
        self.pieces[segment] = Piece(self.layout[segment], start)

    def _add(self, sample: Sample) -> None:
        piece = self._piece(sample.segment)
        if piece is None or piece.ended or sample.tick >= piece.planned.ticks:
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
        piece.ended, piece.ticks = end.reason, end.ticks
        return piece
