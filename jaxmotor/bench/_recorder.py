"""Records a plan: the board runs it, the journal keeps it, and at the end stands a recording in format 1."""

import contextlib
import dataclasses
import time
from collections.abc import Callable, Iterator
from pathlib import Path

from jaxmotor._errors import JaxmotorError
from jaxmotor.bench._assemble import recording_of
from jaxmotor.bench._journal import Journal, Kept, journal_path, new_run, read_journal
from jaxmotor.bench._listen import Silent, Watch, listen
from jaxmotor.bench._plan import Plan
from jaxmotor.bench._port import Port
from jaxmotor.bench._protocol import RecorderError
from jaxmotor.bench._session import Session
from jaxmotor.bench._slots import Rig, rig_for, slots_for
from jaxmotor.bench._wiring import check_wiring
from jaxmotor.recording import Recording, write

FOREVER = 0x7FFFFFFF


def record(
    plan: Plan | None,
    open_port: Callable[[], Port],
    output: Path,
    *,
    resume: bool = False,
    force: bool = False,
    check: bool = True,
    watch: Watch | None = None,
) -> Recording:
    """Run `plan` on the board behind `open_port` and write what came to `output`.

    `resume` goes on after the last whole experiment of `output`'s journal, whose plan it takes. `force` replaces what
    is there. `check` looks for wiring faults first. What stops a run early leaves a valid recording of all that came
    and a journal to resume from.

    **Raises:** `RecorderError`, `PlanError`; `KeyboardInterrupt` after the motor has been stopped and all is written.
    """
    kept = _what_is_there(plan, output, resume, force)
    plan = kept.plan
    journal: Journal | None = None
    damaged = 0
    try:
        with open_port() as port, Session(port) as session:
            rig = _rig(kept, session)
            blocks = list(_blocks(kept, session.board.slots))
            slots_for(plan, rig)
            session.prepare(rig, plan.drive, _limits(plan, rig))
            notes = list(_doubts(plan, session))
            if check:
                notes += check_wiring(session, rig, plan.largest_V, plan.no_load_rad_s)
            for note in notes:
                (watch or Silent()).say(f"note: {note}")
            journal = Journal(journal_path(output), None if resume else plan)
            kept.port = port.name
            number = kept.runs[-1].session + 1 if kept.runs else 0
            for block in blocks:
                began = None if port.lockstep else time.time()
                run = new_run(plan, rig, block, round(session.board.supply_V * 1000), began, number)
                kept.runs.append(run)
                journal.begin(run, session.values, port.name)
                try:
                    listen(session, run, journal, kept, watch or Silent())
                finally:
                    damaged = session.link.decoder.damaged
    except BaseException:
        with contextlib.suppress(JaxmotorError):
            _save(kept, journal, output, damaged)
        raise
    recording = _save(kept, journal, output, damaged)
    if recording is None:
        raise RecorderError(f"{output}: no sample came; nothing was written")
    journal_path(output).unlink(missing_ok=True)
    return recording


def recover(output: Path) -> Recording:
    """Write to `output` what its journal holds, without a board; the journal stays.

    **Raises:** `RecorderError` where there is no journal, or it holds too little.
    """
    kept = read_journal(journal_path(output))
    recording = recording_of(kept.plan, kept.runs, kept.port)
    if recording is None:
        raise RecorderError(f"{journal_path(output)}: no segment is in it; record again with --force")
    write(recording, output)
    return recording


def _what_is_there(plan: Plan | None, output: Path, resume: bool, force: bool) -> Kept:
    part = journal_path(output)
    if resume:
        kept = read_journal(part)
        if plan is not None and plan != kept.plan:
            raise RecorderError(f"{part}: was recorded by another plan ({kept.plan.name}); leave --plan out to go on")
        if len(kept.done) == len(kept.plan.experiments):
            raise RecorderError(f"{part}: all experiments are there; write the recording with --recover")
        return kept
    if plan is None:
        raise RecorderError(f"{output}: name a plan to record (--plan paper, --plan full, or a TOML file)")
    if part.exists() and not force:
        raise RecorderError(
            f"{part}: is left from a recording that was interrupted; continue it with --resume, write what it holds "
            "with --recover, or discard it with --force"
        )
    if output.exists() and not force:
        raise RecorderError(f"{output}: exists already; choose another name, or replace it with --force")
    if not output.absolute().parent.is_dir():
        raise RecorderError(f"{output}: its folder does not exist; make it, or name another")
    return Kept(plan, [], "")


def _rig(kept: Kept, session: Session) -> Rig:
    """As in the runs before, so that one header holds for all; else as plan and board say."""
    rig = rig_for(kept.plan, session.board)
    if not kept.runs:
        return rig
    before = kept.runs[0].rig
    if before.board.full_scale != session.board.full_scale:
        raise RecorderError(f"{session.port.name}: another firmware than the one that began this recording; start anew")
    return dataclasses.replace(rig, supply_V=before.supply_V, counts_per_rev=before.counts_per_rev)


def _limits(plan: Plan, rig: Rig) -> tuple[int, int, int]:
    travel = FOREVER if plan.travel_rev is None else max(1, round(plan.travel_rev * rig.counts_per_rev))
    supply = rig.board.supply_min_V if plan.supply_min_V is None else plan.supply_min_V
    return min(travel, FOREVER), round((plan.seconds * 1.05 + 5) * 1000), round(supply * 1000)


def _blocks(kept: Kept, slots: int) -> Iterator[list[int]]:
    """The experiments that are to do, as many at a time as the board holds."""
    left = [index for index in range(len(kept.plan.experiments)) if index not in kept.done]
    for first in range(0, len(left), slots):
        yield left[first : first + slots]


def _save(kept: Kept, journal: Journal | None, output: Path, damaged: int) -> Recording | None:
    """Close the journal and write the recording of all that came, if it makes one."""
    if journal is not None:
        journal.close()
    if not any(run.log.pieces for run in kept.runs):
        return None
    recording = recording_of(kept.plan, kept.runs, kept.port, damaged)
    if recording is not None:
        try:
            write(recording, output)
        except JaxmotorError as error:
            raise RecorderError(
                f"{error}; {journal_path(output)} has all that came, write it with --recover"
            ) from error
    return recording


def _doubts(plan: Plan, session: Session) -> Iterator[str]:
    """Where plan and board say different things of the same rig."""
    board = session.board
    if plan.supply_V is not None and abs(board.supply_V / plan.supply_V - 1) > 0.05:
        yield (
            f"the supply is stated as {plan.supply_V:g} V and the board measures {board.supply_V:.2f} V; the gain "
            "found will be wrong by as much as the stated one is"
        )
    if plan.counts_per_rev is not None and abs(board.counts_per_rev / plan.counts_per_rev - 1) > 1e-3:
        yield (
            f"counts_per_rev is stated as {plan.counts_per_rev:g} and the board says {board.counts_per_rev:g}; the "
            "stated one is taken"
        )
