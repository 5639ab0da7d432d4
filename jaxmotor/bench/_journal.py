"""The journal beside a recording, REC.csv.part: the board's own lines as they were accepted, so that nothing is lost.

Each line carries its checksum, so a journal that a dying computer tore is read like a torn line from the board: up to
where it is whole. Before each run stands what is needed to read it.
"""

import dataclasses
import errno
import fcntl
import json
import os
import time
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from jaxmotor.bench._assemble import Run
from jaxmotor.bench._board import board_of
from jaxmotor.bench._log import RunLog
from jaxmotor.bench._plan import Experiment, Plan
from jaxmotor.bench._protocol import Decoder, RecorderError
from jaxmotor.bench._slots import Rig, layout, slots_for

FIRST = "# jaxmotor journal 1"
SYNC_S = 1.0
"""At most so long after it has come a line is safe from a power failure."""


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
        flags = os.O_RDWR | os.O_APPEND | os.O_CREAT
        try:
            self._file = os.open(path, flags, 0o666)
        except OSError as error:
            raise RecorderError(f"{path}: cannot be written ({error.strerror})") from error
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            os.close(self._file)
            raise RecorderError(f"{path}: another recorder is writing this file; name another output") from error
        self._synced = time.monotonic()
        self._dirty = False
        if plan is None:
            self.append(["", "# resumed"])
        else:
            os.ftruncate(self._file, 0)
            self.append([FIRST, "# plan " + json.dumps(dataclasses.asdict(plan))])

    def begin(self, run: Run, values: dict[str, str], port: str) -> None:
        """Say what the lines from here on belong to. `values` are the board's hello."""
        told = {
            "port": port,
            "session": run.session,
            "experiments": run.experiments,
            "supply_V": run.rig.supply_V,
            "counts_per_rev": run.rig.counts_per_rev,
            "began_s": run.began_s,
            "board": values,
        }
        self.append(["# run " + json.dumps(told)])
        self.sync()

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

    @property
    def done(self) -> set[int]:
        """Experiments that came to their end."""
        return set().union(*(run.done for run in self.runs))


def read_journal(path: Path) -> Kept:
    """All that the journal at `path` holds whole.

    **Raises:** `RecorderError` where there is none, or it is none.
    """
    try:
        lines = path.read_bytes().split(b"\n")
    except OSError as error:
        raise RecorderError(
            f"{path}: there is nothing to continue ({error.strerror}); record without --resume"
        ) from error
    if lines[0] != FIRST.encode() or len(lines) < 3 or not lines[1].startswith(b"# plan "):
        raise RecorderError(
            f"{path}: not a journal of jaxmotor, or nothing of it was written; record again with --force"
        )
    plan = _plan(json.loads(lines[1].removeprefix(b"# plan ")))
    runs: list[Run] = []
    port, decoder = "", Decoder()
    for line in lines[2:]:
        if line.startswith(b"# run ") and (told := _json(line.removeprefix(b"# run "))):
            port, decoder = told["port"], Decoder()
            runs.append(_run(plan, told))
        elif runs:
            for message in decoder.feed(line + b"\n"):
                runs[-1].log.feed(message)
    return Kept(plan, runs, port)


def new_run(
    plan: Plan, rig: Rig, experiments: Iterable[int], supply_mV: int, began_s: float | None, session: int
) -> Run:
    """A run of `experiments` (indices) of `plan`, of which nothing has come yet."""
    chosen = tuple(experiments)
    slots = slots_for(plan, rig)
    mine = tuple(slots[index] for index in chosen)
    log = RunLog(layout(mine, [plan.experiments[index].kind for index in chosen]), supply_mV)
    return Run(chosen, mine, rig, log, began_s, session)


def _run(plan: Plan, told: dict[str, Any]) -> Run:
    board = board_of(told["board"], told["port"])
    rig = Rig(board, plan.period_ms, told["supply_V"], told["counts_per_rev"])
    supply_mV = round(board.supply_V * 1000)
    return new_run(plan, rig, told["experiments"], supply_mV, told["began_s"], told["session"])


def _plan(table: dict[str, Any]) -> Plan:
    experiments = tuple(Experiment(**item) for item in table.pop("experiments"))
    return Plan(experiments=experiments, **table)


def _json(line: bytes) -> dict[str, Any] | None:
    try:
        return json.loads(line)
    except ValueError:
        return None  # torn
