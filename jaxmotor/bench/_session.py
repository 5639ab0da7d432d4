"""One conversation with a board: hello, commands with their answers, a plan uploaded, a run listened to."""

import binascii
import contextlib
import itertools
import struct
import time
from collections.abc import Iterator, Sequence
from typing import NoReturn

from jaxmotor.bench._board import Board, baud_for, board_of, gather
from jaxmotor.bench._link import Link
from jaxmotor.bench._log import RUNNING, RunLog
from jaxmotor.bench._port import Port
from jaxmotor.bench._protocol import Answer, Begin, End, Hello, Message, Ran, RecorderError, RunEnd, Sample, Status
from jaxmotor.bench._slots import Rig, Slot

TRIES = 6
UPLOADS = 3
KINDS = ("rest", "step", "ramp", "sine", "multisine", "chirp", "prbs", "loop")
"""As the board numbers them."""
ANEW = ("busy", "empty", "old", "order", "plan")
"""Refusals after which the plan is sent once more: a line that was late undid something."""
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
        self.run = 0
        """Number of the run that was started last."""
        self._settings: tuple[tuple[int, ...], tuple[int, ...]] = ((5, 0), (1, 1, 0))
        self._later: list[Message] = []
        self._running = False
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
        """Set the line's rate; period, bridge and `limits` are for the runs: travel [counts], time [ms], supply [mV].

        **Raises:** `RecorderError`.
        """
        rate = baud_for(rig.period_ms, self.port.baud)
        if rate != self.port.baud:
            self._change_rate(rate)
        self._settings = (rig.period_ms, 0 if drive == "brake" else 1), limits
        self.link.keep_alive()

    def start(self, slots: Sequence[Slot]) -> int:
        """Upload `slots` and run them, once; the run's number, which everything that is said of it carries.

        **Raises:** `RecorderError` where the board refuses.
        """
        refusal = "busy"
        for _ in range(UPLOADS):
            refusal = self._upload(slots)
            if not refusal:
                self._later.clear()
                self._running = True
                refusal = self.command("G", self.run, len(slots), self._sum(slots), may_refuse=ANEW)
            if not refusal:
                return self.run
            self._running = False
        self._refused("G", (self.run, len(slots)), refusal)

    def messages(self) -> Iterator[list[Message]]:
        """What comes of the run, up to its end; empty lists from time to time, so that the caller can do other things.

        **Raises:** `RecorderError` where the port is gone, the board was reset, or falls silent.
        """
        patience = self.port.patience
        received = asked = time.monotonic()
        while self._running:
            batch = self._receive(min(0.05, patience.again_s))
            now = time.monotonic()
            doubt = any(isinstance(m, Hello) and m.command == 0 for m in batch)  # a reset, or an old line
            received = now if batch else received
            if any(isinstance(m, Status) and m.run != self.run for m in batch):
                self._running = False
                raise RecorderError(self._was_reset())
            self._running = not any(self._ends(message) for message in batch)
            if self._running and (doubt or now - max(received, asked) > patience.again_s):
                asked = now
                self.link.send("Q")  # the line that told the end may be the one that was lost
            if now - received > patience.silent_s:
                self._running = False
                raise RecorderError(
                    f"{self.port.name}: the board has fallen silent in mid-run; check its cable and its supply, then "
                    "continue with --resume"
                )
            yield batch

    def account(self, log: RunLog) -> list[Message]:
        """Ask the board what it ran, until `log` knows each tick of it or the board has no more to say; its answers.

        **Raises:** `RecorderError` where the board does not answer.
        """
        answers: list[Message] = []
        if not log.reason:
            answers.append(self.ask("Q"))
        for slot in [] if log.accounted else sorted({planned.slot for planned in log.layout}):
            if not any(isinstance(m, Ran) and m.slot <= slot < m.slot + len(m.ticks) for m in answers):
                answers.append(self.ask("R", slot))
        for answer in answers:
            log.feed(answer)
        return answers

    def skip(self, segment: int) -> None:
        """End that segment, if it still runs, and go on with the next."""
        self.link.send("J", self.run, segment)

    def stop(self) -> list[Message]:
        """Stop the motor; what still came. The board stops by itself 250 ms after the last keepalive in any case."""
        came: list[Message] = []
        self._running = False
        for _ in range(TRIES):
            self.link.send("X")
            self.link.send("Q")
            deadline = time.monotonic() + self.port.patience.again_s
            while time.monotonic() < deadline:
                batch = self._receive(min(0.05, self.port.patience.again_s))
                came += batch
                if any(self._ends(message) for message in batch):
                    return came
        return came

    def command(self, kind: str, *fields: int | str, may_refuse: Sequence[str] = ()) -> str:
        """Send a command until it is answered; the word of a refusal that `may_refuse` has, else nothing.

        **Raises:** `RecorderError` where it is refused, or never answered.
        """
        answer = self.ask(kind, *fields)
        refusal = answer.refusal if isinstance(answer, Answer) else ""
        if refusal and refusal not in may_refuse:
            self._refused(kind, fields, refusal)
        return refusal

    def ask(self, kind: str, *fields: int | str) -> Message:
        """Send a command until it is answered, again and again under one number; the answer.

        **Raises:** `RecorderError` where it is never answered.
        """
        patience = self.port.patience
        number = self.link.send(kind, *fields)
        began = time.monotonic()
        for attempt in itertools.count(1):
            answer = self._answer(number, patience.again_s, starts=kind == "G")
            if answer is not None:
                return answer
            if attempt >= TRIES and time.monotonic() - began >= patience.silent_s:
                break
            self.link.repeat(number, kind, *fields)
        raise RecorderError(
            f"{self.port.name}: the board does not answer any more; check its cable, and its rate (--baud)"
        )

    def _upload(self, slots: Sequence[Slot]) -> str:
        """Settings and slots under a number that no run had; the word of a refusal."""
        self.run = max(self.run, self.board.last_run, 0 if self.port.lockstep else int(time.time())) + 1
        period, limits = self._settings
        lines = [("P", *period), ("L", *limits), ("C", self.run)]
        lines += [("S", n, slot.kind, slot.rest, slot.ticks, *slot.numbers) for n, slot in enumerate(slots)]
        refusals = (self.command(*line, may_refuse=ANEW) for line in lines)
        return next((refusal for refusal in refusals if refusal), "")

    def _sum(self, slots: Sequence[Slot]) -> int:
        """Over all that a `G` starts, so that the board runs what was meant or nothing (docs/protocol.md)."""
        (period, drive), (travel, limit_ms, supply_mV) = self._settings
        data = struct.pack("<BBiIH", period, drive, travel, limit_ms, supply_mV)
        for slot in slots:
            data += struct.pack("<BHHIih", KINDS.index(slot.kind), slot.rest, slot.ticks, *slot.numbers)
        return binascii.crc_hqx(data, 0xFFFF)

    def _change_rate(self, rate: int) -> None:
        """The answer to the change may be lost: whether it was obeyed shows at the new rate."""
        before = self.port.baud
        for _ in range(TRIES):
            number = self.link.send("U", rate)
            answer = self._answer(number, self.port.patience.again_s)
            if isinstance(answer, Answer) and answer.refusal:
                self._refused("U", (rate,), answer.refusal)
            self.port.baud = rate
            with contextlib.suppress(RecorderError):
                self._hello(None if answer else 3 * self.port.patience.again_s)
                return
            self.port.baud = before
        raise RecorderError(f"{self.port.name}: the board does not answer at {rate} baud; check its cable")

    def _ends(self, message: Message) -> bool:
        """Whether it says that the run is over."""
        if isinstance(message, Status):
            return message.state not in RUNNING
        return isinstance(message, RunEnd) and message.run == self.run

    def _answer(self, number: int, timeout_s: float, *, starts: bool = False) -> Message | None:
        deadline = time.monotonic() + timeout_s
        while (left := deadline - time.monotonic()) > 0:
            batch = self.link.receive(left)
            answers = [m for m in batch if isinstance(m, Answer | Status | Ran) and m.command == number]
            self._later += [m for m in batch if not isinstance(m, Answer)]
            if starts and not answers and any(isinstance(m, Sample) or self._is_of_run(m) for m in batch):
                return Answer("", 0, number, "")  # the answer was lost; that the run goes on says as much
            if answers:
                return answers[0]
        return None

    def _is_of_run(self, message: Message) -> bool:
        return isinstance(message, Begin | End | RunEnd) and message.run == self.run

    def _receive(self, timeout_s: float) -> list[Message]:
        if self._later:
            later, self._later = self._later, []
            return later
        return self.link.receive(timeout_s)

    def _refused(self, kind: str, fields: Sequence[int | str], word: str) -> NoReturn:
        sentence = REFUSALS.get(word, "the board refuses '{what}' ({word})")
        what = " ".join(map(str, (kind, *fields)))
        raise RecorderError(f"{self.port.name}: " + sentence.format(supply=self.board.supply_V, what=what, word=word))

    def _was_reset(self) -> str:
        """The sentence for it, with the board's own reason."""
        cause = "check its supply and cable"
        with contextlib.suppress(RecorderError):
            if self._hello(3 * self.port.patience.again_s).get("reset") == "watchdog":
                cause = "its program hung and its watchdog restarted it; check its supply and what disturbs it"
        return f"{self.port.name}: the board was reset in mid-run; {cause}, then continue with --resume"

    def _hello(self, limit_s: float | None = None) -> dict[str, str]:
        patience = self.port.patience
        limit_s = patience.hello_s if limit_s is None else limit_s
        number = self.link.send("H")
        began = asked = time.monotonic()
        seen: list[Hello] = []
        while time.monotonic() - began < limit_s:
            seen += [m for m in self.link.receive(min(0.05, patience.again_s)) if isinstance(m, Hello)]
            values = gather(part for part in seen if part.command == number)
            if values is not None:
                return values
            if time.monotonic() - asked > patience.again_s:
                asked = time.monotonic()
                self.link.repeat(number, "H")
        raise RecorderError(f"{self.port.name}: {_stranger(bytes(self.link.received), bool(seen), self.port.baud)}")


def _stranger(received: bytes, hello: bool, baud: int) -> str:
    """Who may be at the other end, from what was heard of them."""
    rates = f"the board may be set to another rate than {baud} baud, try --baud 500000, 250000 or 1000000"
    if not received:
        return "nothing comes from the board; check that it is powered and flashed, and that this is its port"
    if hello:
        return f"the board sends but does not receive; {rates}"
    text = sum(32 <= byte < 127 or byte in b"\r\n\t" for byte in received)
    if text < 0.9 * len(received):
        return f"only noise comes; {rates}"
    line = next((part for part in received.decode("ascii", "replace").splitlines() if part.strip()), "")
    what = line.strip()[:60]
    return f"another program answers ({what!r}); flash the rig's firmware with make -C firmware flash PORT=..."
