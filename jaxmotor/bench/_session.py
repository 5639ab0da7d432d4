"""One conversation with a board: hello, commands with their answers, a plan uploaded, a run listened to."""

import contextlib
import time
from collections.abc import Iterator, Sequence

from jaxmotor.bench._board import Board, baud_for, board_of, gather
from jaxmotor.bench._link import Link
from jaxmotor.bench._port import Port
from jaxmotor.bench._protocol import Answer, Begin, Hello, Message, RecorderError, RunEnd, Sample, Status
from jaxmotor.bench._slots import Rig, Slot

HELLO_S = 4.0
"""A bootloader takes two of them."""
LOCKSTEP_S = 20.0
"""The emulated bench answers when it gets to it."""
AGAIN_S = 0.3
TRIES = 6
REFUSALS = {
    "supply": "the supply of {supply:.2f} V is too low to start; charge the battery, or lower supply_min_V in the plan",
    "full": "the plan has more experiments than the board holds",
    "busy": "the board is busy with a run that it was not told to stop",
}


class Session:
    """A board that has said hello. Use it as a context; leaving it stops the motor and lets the port go."""

    def __init__(self, port: Port) -> None:
        """**Raises:** `RecorderError` where nobody, somebody else or another protocol answers."""
        self.port = port
        self.link = Link(port)
        self._later: list[Message] = []
        self._running = False
        self._stopping = False
        try:
            self.values = self._hello()
            self.board: Board = board_of(self.values, port.name)
        except BaseException:
            self.link.close()
            raise

    def __enter__(self) -> "Session":
        return self

    def __exit__(self, *exc: object) -> None:
        if self._running:
            with contextlib.suppress(RecorderError):
                self.stop()
        self.link.close()

    def prepare(self, rig: Rig, drive: str, limits: tuple[int, int, int]) -> None:
        """Set the line's rate, the period, the bridge, and the `limits`: travel [counts], time [ms], supply [mV].

        **Raises:** `RecorderError`.
        """
        rate = baud_for(rig.period_ms, self.port.baud)
        if rate != self.port.baud:
            self.command("U", rate)
            self.port.baud = rate
            self._hello()
        self.command("P", rig.period_ms, 0 if drive == "brake" else 1)
        self.command("L", *limits)
        self.link.keep_alive()

    def start(self, slots: Sequence[Slot]) -> None:
        """Upload `slots` and run them.

        **Raises:** `RecorderError` where the board refuses.
        """
        self.command("C")
        for index, slot in enumerate(slots):
            self.command("S", index, slot.kind, slot.rest, slot.ticks, *slot.numbers)
        self._later.clear()
        self.command("G", len(slots))
        self._running = True

    def messages(self) -> Iterator[list[Message]]:
        """What comes of the run, up to its end; empty lists from time to time, so that the caller can do other things.

        **Raises:** `RecorderError` where the port is gone, the board was reset, or falls silent.
        """
        last = time.monotonic()
        asked = False
        quiet = 3.0 if self.port.lockstep else 0.6
        while self._running:
            batch = self._receive(0.05)
            now = time.monotonic()
            if batch:
                last, asked = now, asked and not any(isinstance(m, Sample) for m in batch)
                self._check_reset(batch)
                ended = any(isinstance(m, RunEnd) or (isinstance(m, Status) and not m.running) for m in batch)
                self._running = not ended
            elif now - last > quiet and not asked:
                asked = True
                self.link.send("Q")  # the line that told the end may be the one that was lost
            elif now - last > (LOCKSTEP_S if self.port.lockstep else 2.0):
                self._running = False
                raise RecorderError(
                    f"{self.port.name}: the board has fallen silent in mid-run; check its cable and its supply, then "
                    "continue with --resume"
                )
            yield batch

    def skip(self) -> None:
        """End the segment that runs, and go on with the next."""
        self.link.send("J")

    def stop(self) -> list[Message]:
        """Stop the motor; what still came. The board stops by itself 250 ms after the last keepalive in any case."""
        came: list[Message] = []
        self._running = False
        for _ in range(3):
            self.link.send("X")
            deadline = time.monotonic() + (5 if self.port.lockstep else 0.5)
            while time.monotonic() < deadline:
                batch = self._receive(0.05)
                came += batch
                if any(isinstance(message, RunEnd) for message in batch):
                    return came
        return came

    def command(self, kind: str, *fields: int | str) -> None:
        """Send a command and wait until it is obeyed; send it again where no answer comes.

        **Raises:** `RecorderError` where it is refused, or never answered.
        """
        number = self.link.send(kind, *fields)
        for again in range(TRIES):
            answer = self._answer(number, LOCKSTEP_S if self.port.lockstep else AGAIN_S, started_by=kind == "G")
            if answer is not None:
                if answer.refusal and not (kind == "G" and again and answer.refusal == "busy"):
                    self._refused(kind, fields, answer.refusal)
                return
            self.link.repeat(number, kind, *fields)
        raise RecorderError(
            f"{self.port.name}: the board does not answer any more; check its cable, and its rate (--baud)"
        )

    def _answer(self, number: int, timeout_s: float, *, started_by: bool) -> Answer | None:
        deadline = time.monotonic() + timeout_s
        while (left := deadline - time.monotonic()) > 0:
            batch = self.link.receive(left)
            answers = [m for m in batch if isinstance(m, Answer) and m.command == number]
            self._later += [m for m in batch if not isinstance(m, Answer)]
            if started_by and not answers and any(isinstance(m, Begin | Sample) for m in batch):
                return Answer("", 0, number, "")  # the answer was lost; that the run goes on says as much
            if answers:
                return answers[0]
        return None

    def _receive(self, timeout_s: float) -> list[Message]:
        if self._later:
            later, self._later = self._later, []
            return later
        return self.link.receive(timeout_s)

    def _refused(self, kind: str, fields: Sequence[int | str], word: str) -> None:
        sentence = REFUSALS.get(word, "the board refuses '{what}' ({word})")
        what = " ".join(map(str, (kind, *fields)))
        raise RecorderError(f"{self.port.name}: " + sentence.format(supply=self.board.supply_V, what=what, word=word))

    def _check_reset(self, batch: list[Message]) -> None:
        for message in batch:
            if isinstance(message, Hello) and message.command == 0:
                self._running = False
                raise RecorderError(
                    f"{self.port.name}: the board was reset in mid-run; check its supply and cable, then continue with "
                    "--resume"
                )

    def _hello(self) -> dict[str, str]:
        number = self.link.send("H")
        began = asked = time.monotonic()
        limit = LOCKSTEP_S if self.port.lockstep else HELLO_S
        seen: list[Hello] = []
        while time.monotonic() - began < limit:
            seen += [m for m in self.link.receive(0.05) if isinstance(m, Hello)]
            values = gather(part for part in seen if part.command == number)
            if values is not None:
                return values
            if not self.port.lockstep and time.monotonic() - asked > 0.5:
                asked = time.monotonic()
                self.link.repeat(number, "H")
        raise RecorderError(f"{self.port.name}: {_stranger(bytes(self.link.heard), bool(seen), self.port.baud)}")


def _stranger(heard: bytes, hello: bool, baud: int) -> str:
    """Who may be at the other end, from what was heard of them."""
    rates = f"the board may be set to another rate than {baud} baud, try --baud 500000, 250000 or 1000000"
    if not heard:
        return "nothing comes from the board; check that it is powered and flashed, and that this is its port"
    if hello:
        return f"the board is heard but does not hear; {rates}"
    text = sum(32 <= byte < 127 or byte in b"\r\n\t" for byte in heard)
    if text < 0.9 * len(heard):
        return f"only noise comes; {rates}"
    line = next((part for part in heard.decode("ascii", "replace").splitlines() if part.strip()), "")
    what = line.strip()[:60]
    return f"another program answers ({what!r}); flash the rig's firmware with make -C firmware flash PORT=..."
