"""Records a plan: the board runs it, the journal keeps it, and at the end stands a recording in format 1."""

import contextlib
import dataclasses
import time
from collections.abc import Callable, Iterator
from pathlib import Path

from jaxmotor._errors import JaxmotorError
from jaxmotor.bench._account import missing, tallies
from jaxmotor.bench._assemble import recording_of
from jaxmotor.bench._journal import Journal, Kept, journal_path, new_run, read_journal
from jaxmotor.bench._listen import Silent, Watch, listen
from jaxmotor.bench._plan import Plan
from jaxmotor.bench._port import Port
from jaxmotor.bench._protocol import RecorderError
from jaxmotor.bench._session import Session
from jaxmotor.bench._slots import Rig, rig_for, slots_for
from jaxmotor.bench._wiring import check_wiring
from jaxmotor.recording import Recording, check_jumps, write

FOREVER = 0x7FFFFFFF


class Incomplete(RecorderError):
    """What was recorded is sound, but not all that the plan asks for. `recording` is what was written, if anything."""

    def __init__(self, sentence: str, recording: Recording | None) -> None:
        super().__init__(sentence)
        self.recording = recording


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

    `resume` records the experiments of which something is missing in `output`'s journal, whose plan it takes. `force`
    replaces what is there. `check` looks for wiring faults first. Whatever is missing at the end, be it that the run
    was stopped or that single samples were lost on the line, leaves a valid recording of all that came and a journal
    to resume from.

    **Raises:** `Incomplete`, `RecorderError`, `PlanError`; `KeyboardInterrupt` after the motor has been stopped and all
    is written.
    """
    kept = _what_is_there(plan, output, resume, force)
    journal: Journal | None = None
    began = False
    try:
        with open_port() as port, Session(port) as session:
            rig = _prepare(kept, session, check=check, watch=watch or Silent())
            journal = Journal(journal_path(output), None if resume else kept.plan)
            began = True
            _run_all(kept, session, rig, journal, watch or Silent())
    except BaseException as error:
        recording = None
        with contextlib.suppress(JaxmotorError):
            recording = _save(kept, journal, output)
        if began and isinstance(error, RecorderError):
            raise _incomplete(str(error), kept, recording) from error
        raise
    recording = _save(kept, journal, output)
    if recording is None:
        raise RecorderError(f"{output}: no sample came; nothing was written")
    try:
        check_jumps(recording)
    except JaxmotorError as error:
        raise Incomplete(
            f"{error}; the recording is as the board sent it: mend the cause, then record again with --force", recording
        ) from error
    found = tallies(kept.plan, kept.runs)
    whole = sum(map(len, recording.segments)) >= sum(tally.planned - tally.skipped for tally in found)
    if not whole or any(not tally.whole for tally in found):
        raise _incomplete(f"{output}", kept, recording)
    journal_path(output).unlink(missing_ok=True)
    return recording


def recover(output: Path, watch: Watch | None = None) -> Recording:
    """Write to `output` what its journal holds, without a board; the journal stays. `watch` is told what is missing.

    **Raises:** `RecorderError` where there is no journal, or it holds too little.
    """
    kept = read_journal(journal_path(output))
    recording = recording_of(kept.plan, kept.runs, kept.port, kept.damaged)
    if recording is None:
        raise RecorderError(f"{journal_path(output)}: no segment is in it; record again with --force")
    write(recording, output)
    if kept.damaged:
        (watch or Silent()).say(f"note: {kept.damaged} lines of the journal are damaged and left out")
    if what := missing(tallies(kept.plan, kept.runs)):
        (watch or Silent()).say(f"note: {what}; record it with --resume")
    return recording


def _incomplete(sentence: str, kept: Kept, recording: Recording | None) -> Incomplete:
    """The sentence, what is missing, and what to do."""
    what = missing(tallies(kept.plan, kept.runs))
    remedy = "what came is kept, continue with --resume"
    said = sentence.replace(", then continue with --resume", "").replace(", and continue with --resume", "")
    return Incomplete(": ".join(part for part in (said, what) if part) + f"; {remedy}", recording)


def _prepare(kept: Kept, session: Session, *, check: bool, watch: Watch) -> Rig:
    """Board and wiring as the plan needs them, before anything is written."""
    plan = kept.plan
    rig = _rig(kept, session)
    slots_for(plan, rig)
    session.prepare(rig, plan.drive, _limits(plan, rig))
    notes = list(_doubts(plan, session))
    if check:
        notes += check_wiring(session, rig, plan.largest_V, plan.no_load_rad_s)
    for note in notes:
        watch.say(f"note: {note}")
    return rig


def _run_all(kept: Kept, session: Session, rig: Rig, journal: Journal, watch: Watch) -> None:
    """Run what is to do, block after block."""
    kept.port = session.port.name
    count = kept.runs[-1].session + 1 if kept.runs else 0
    supply_mV = round(session.board.supply_V * 1000)
    slots = slots_for(kept.plan, rig)
    damaged = kept.damaged
    for block in list(_blocks(kept, session.board.slots)):
        number = session.start([slots[index] for index in block])
        began = None if session.port.lockstep else time.time()
        run = new_run(kept.plan, rig, block, supply_mV, began, count, number)
        kept.runs.append(run)
        journal.begin(run, session.values, session.port.name)
        try:
            listen(session, run, journal, kept, watch)
        finally:
            kept.damaged = damaged + session.link.decoder.damaged


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


def _save(kept: Kept, journal: Journal | None, output: Path) -> Recording | None:
    """Close the journal and write the recording of all that came, if it makes one."""
    if journal is not None:
        journal.close()
    if not any(run.log.pieces for run in kept.runs):
        return None
    recording = recording_of(kept.plan, kept.runs, kept.port, kept.damaged)
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
