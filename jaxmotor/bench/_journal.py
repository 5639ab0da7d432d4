"""The journal beside a recording, REC.csv.part: the board's own lines as they were accepted, so that nothing is lost.

Each line carries its checksum, what the recorder adds of its own too, and that twice: so a journal that was torn or
damaged is read up to where it is whole, and what is not is said. Before each run stands what is needed to read it.
"""

import dataclasses
import errno
import json
import math
import os
import stat
import time
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

from jaxmotor.bench._assemble import Run
from jaxmotor.bench._board import board_of
from jaxmotor.bench._lock import lock
from jaxmotor.bench._log import RunLog
from jaxmotor.bench._plan import MAX_TICKS, NEEDED, Experiment, Plan
from jaxmotor.bench._protocol import Begin, Decoder, End, RecorderError, RunEnd, checksum
from jaxmotor.bench._slots import Rig, layout, slots_for

FORMAT = 2
SYNC_S = 1.0
"""At most so long after it has come a line is safe from a power failure."""
LONGEST = 1 << 24
"""Of a line [byte]: a plan's is long."""


def journal_path(output: Path) -> Path:
    """Where the journal of the recording `output` is."""
    return output.with_name(output.name + ".part")


class Journal:
    """Appends lines; each is with the operating system at once, and on the disk within a second."""

    def __init__(self, path: Path, plan: Plan | None = None) -> None:
        """A new journal of `plan`, or more of the one that is there.

        **Raises:** `RecorderError` where the file cannot be written, or another recorder writes it.
        """
        self.path = path
        flags = os.O_RDWR | os.O_APPEND | os.O_CREAT | getattr(os, "O_NONBLOCK", 0)
        try:
            self._file = os.open(path, flags, 0o666)
        except OSError as error:
            raise RecorderError(f"{path}: cannot be written ({error.strerror})") from error
        if not stat.S_ISREG(os.fstat(self._file).st_mode):
            os.close(self._file)
            raise RecorderError(f"{path}: is no file, but the journal's place; remove it, or name another output")
        try:
            lock(self._file, wait=False)
        except OSError as error:
            os.close(self._file)
            raise RecorderError(f"{path}: another recorder is writing this file; name another output") from error
        self._synced = time.monotonic()
        self._dirty = False
        if plan is None:
            self.append([""])  # ends a line that was torn
        else:
            os.ftruncate(self._file, 0)
            self.note("plan", {"journal": FORMAT, "plan": dataclasses.asdict(plan)})

    def begin(self, run: Run, values: dict[str, str], port: str) -> None:
        """Say what the lines from here on belong to. `values` are the board's hello."""
        told = {
            "number": run.log.number,
            "port": port,
            "session": run.session,
            "experiments": run.experiments,
            "supply_V": run.rig.supply_V,
            "counts_per_rev": run.rig.counts_per_rev,
            "began_s": run.began_s,
            "board": values,
        }
        self.note("run", told)
        self.sync()

    def note(self, what: str, values: dict[str, Any]) -> None:
        """Write down what is needed to read the lines that follow; twice and apart, so that damage leaves one."""
        text = f"# {what} {json.dumps(values)}"
        line = f"{text}*{checksum(text.encode()).decode()}"
        self.append(["", line, "", line])

    def append(self, lines: Iterable[str]) -> None:
        """Write lines out.

        **Raises:** `RecorderError` where the disk does not take them.
        """
        left = memoryview("".join(line + "\n" for line in lines).encode("ascii"))
        try:
            while left:
                left = left[os.write(self._file, left) :]
                self._dirty = True
            if time.monotonic() - self._synced >= SYNC_S:
                self.sync()
        except OSError as error:
            raise RecorderError(self._full(error)) from error

    def sync(self) -> None:
        """Wait until the disk has all of it."""
        if self._dirty:
            os.fsync(self._file)
        self._synced, self._dirty = time.monotonic(), False

    def close(self) -> None:
        """**Raises:** `RecorderError` where the disk does not take what is left."""
        try:
            self.sync()
        except OSError as error:
            raise RecorderError(self._full(error)) from error
        finally:
            os.close(self._file)

    def _full(self, error: OSError) -> str:
        what = "the disk is full" if error.errno in (errno.ENOSPC, errno.EDQUOT) else f"{error.strerror}"
        if error.errno == errno.EFBIG:
            what = "the file may not grow any more"
        return (
            f"{self.path}: {what}; the motor was stopped, and what had been written is kept there: make room, then "
            "continue with --resume"
        )


@dataclasses.dataclass
class Kept:
    """What a journal holds."""

    plan: Plan
    runs: list[Run]
    port: str
    damaged: int = 0
    """Lines that are not as they were written."""

    @property
    def done(self) -> set[int]:
        """Experiments that came to their end, nothing of them missing."""
        return set().union(*(run.done for run in self.runs))


def read_journal(path: Path) -> Kept:
    """All that the journal at `path` holds whole.

    **Raises:** `RecorderError` where there is none, or it is none.
    """
    kept: Kept | None = None
    reader = _RunLines()
    for line in _lines(path):
        note = _note(line)
        if note is None:
            reader.take(line)
        elif kept is None and "plan" in note:
            kept = Kept(_plan(path, note), [], "")
        elif kept is not None and "number" in note and reader.number != note["number"]:
            kept.port, run = _run(path, kept.plan, note)
            kept.runs.append(run)
            reader.begin(run)
        elif "number" in note:
            reader.trusted = True
    if kept is None:
        raise RecorderError(
            f"{path}: not a journal that this jaxmotor can read, or nothing of it is whole; record again with --force"
        )
    kept.damaged = reader.damaged
    return kept


class _RunLines:
    """The board's lines in a journal, each to the run that it belongs to or to none."""

    def __init__(self) -> None:
        self.damaged = 0
        self.trusted = False
        """A sample does not say of which run it is: only while nothing between it and its run's note is damaged."""
        self._run: Run | None = None
        self._decoder = Decoder()

    @property
    def number(self) -> int | None:
        """Of the run whose lines these are."""
        return None if self._run is None else self._run.log.number

    def begin(self, run: Run) -> None:
        self._run, self._decoder, self.trusted = run, Decoder(), True

    def take(self, line: bytes) -> None:
        before = self._decoder.damaged
        messages = self._decoder.feed(line + b"\n")
        self.damaged += self._decoder.damaged - before
        if line.startswith(b"#"):
            self.trusted = False
        for message in messages if self._run is not None else ():
            if isinstance(message, Begin | End | RunEnd):
                self.trusted = message.run == self.number
            if self.trusted and self._run is not None:
                self._run.log.feed(message)


def _lines(path: Path) -> Iterator[bytes]:
    try:
        if not path.is_file():
            raise FileNotFoundError(errno.ENOENT, "no such file")
        with path.open("rb") as file:
            while line := file.readline(LONGEST):
                if line.strip():
                    yield line.rstrip(b"\n")
    except OSError as error:
        raise RecorderError(
            f"{path}: there is nothing to continue ({error.strerror}); record without --resume"
        ) from error


def new_run(
    plan: Plan, rig: Rig, experiments: Iterable[int], supply_mV: int, began_s: float | None, session: int, number: int
) -> Run:
    """The run `number` of `experiments` (indices) of `plan`, of which nothing has come yet."""
    chosen = tuple(experiments)
    slots = slots_for(plan, rig)
    mine = tuple(slots[index] for index in chosen)
    log = RunLog(layout(mine, [plan.experiments[index].kind for index in chosen]), supply_mV, number)
    return Run(chosen, mine, rig, log, began_s, session)


def _note(line: bytes) -> dict[str, Any] | None:
    """What the recorder wrote of its own; None where the line is the board's, or is damaged."""
    body, star, sum_ = line.rpartition(b"*")
    if not body.startswith((b"# plan {", b"# run {")) or not star or checksum(body) != sum_:
        return None
    try:
        return json.loads(body[body.index(b"{") :])
    except (ValueError, RecursionError):
        return None


def _plan(path: Path, note: dict[str, Any]) -> Plan:
    try:
        if note["journal"] != FORMAT:
            raise ValueError(f"format {note['journal']}")
        return _stored_plan(note["plan"])
    except (KeyError, TypeError, ValueError, OverflowError) as error:
        raise RecorderError(f"{path}: its plan is not understood ({error}); record again with --force") from error


def _stored_plan(table: dict[str, Any]) -> Plan:
    """**Raises:** `ValueError`, `TypeError`, `KeyError` where it is none."""
    experiments = tuple(Experiment(**item) for item in table.pop("experiments"))
    plan = Plan(experiments=experiments, **table)
    numbers = (plan.supply_V, plan.counts_per_rev, plan.travel_rev, plan.supply_min_V, plan.no_load_rad_s)
    known = all(each.kind in NEEDED and set(each.parameters) >= NEEDED[each.kind] for each in experiments)
    ticks = all(2 <= each.ticks <= MAX_TICKS and 0 <= each.rest_ticks <= MAX_TICKS for each in experiments)
    values = (value for each in experiments for value in each.parameters.values())
    texts = (plan.name, plan.drive, *plan.header, *plan.header.values())
    if not known or not ticks or plan.period_ms not in range(1, 21) or not all(isinstance(t, str) for t in texts):
        raise ValueError("values that no plan has")
    if not all(math.isfinite(value) for value in (*values, *(n for n in numbers if n is not None))):
        raise ValueError("numbers that no plan has")
    return plan


def _run(path: Path, plan: Plan, note: dict[str, Any]) -> tuple[str, Run]:
    """Where the board was, and the run."""
    try:
        port, number = str(note["port"]), int(note["number"])
        board = board_of(note["board"], port)
        rig = Rig(board, plan.period_ms, float(note["supply_V"]), float(note["counts_per_rev"]))
        began = None if note["began_s"] is None else float(note["began_s"])
        experiments = [index for index in map(int, note["experiments"]) if 0 <= index < len(plan.experiments)]
        supply_mV = round(board.supply_V * 1000)
        return port, new_run(plan, rig, experiments, supply_mV, began, int(note["session"]), number)
    except (KeyError, TypeError, ValueError, OverflowError, ZeroDivisionError, AttributeError) as error:
        raise RecorderError(f"{path}: what it says of a run is not understood; record again with --force") from error
