"""From what came of the runs to a recording in format 1."""

import dataclasses
from collections.abc import Iterator, Sequence

import numpy as np

from jaxmotor.bench._log import Piece, RunLog
from jaxmotor.bench._plan import Plan
from jaxmotor.bench._slots import Rig, Slot
from jaxmotor.recording import Recording, Segment, supplied

LEAST = 20
"""Samples of an interrupted segment that are worth a segment; fewer are left out."""
STILL = 10
"""Samples without a count that mean rest."""


@dataclasses.dataclass
class Run:
    """One run of the board: which experiments of the plan, on which rig, and what came."""

    experiments: tuple[int, ...]
    slots: tuple[Slot, ...]
    rig: Rig
    log: RunLog
    began_s: float | None
    """Wall clock [s]; None on the emulated bench, whose time is not ours."""
    session: int = 0
    """The board's count begins anew with each."""

    @property
    def done(self) -> set[int]:
        """Experiments that came to their end, with every sample of theirs and of the rest before them."""
        whole = {segment for segment, piece in self.log.pieces.items() if piece.whole}
        short = {planned.slot for segment, planned in enumerate(self.log.layout) if segment not in whole}
        return {index for slot, index in enumerate(self.experiments) if slot not in short}


def recording_of(plan: Plan, runs: Sequence[Run], port: str, damaged: int = 0) -> Recording | None:
    """All that came; None where that is too little for a segment."""
    first = runs[0].rig if runs else None
    segments = tuple(_segments(plan, runs))
    if first is None or not segments:
        return None
    header = dict(plan.header)
    header.setdefault("rig", "emulated board" if port == "emulated" else f"board at {port}")
    header |= {"firmware": f"motor_rig {first.board.firmware}", "plan": plan.name}
    numbers = {
        "lost_samples": sum(run.log.lost for run in runs),
        "damaged_lines": damaged,
        "illegal_transitions": sum(run.log.illegal for run in runs),
    }
    recording = Recording(
        segments,
        plan.name,
        period_s=plan.period_s,
        counts_per_rev=float(first.counts_per_rev),
        duty_full_scale=float(first.board.full_scale),
        supply_V=float(first.supply_V),
        drive="coast" if plan.drive == "coast" else "brake",
        duty_delay_s=first.board.duty_delay_s,
        count_resets=len({run.session for run in runs}) > 1,
        header=header | numbers,
    )
    return supplied(recording)


def _segments(plan: Plan, runs: Sequence[Run]) -> Iterator[Segment]:
    over = 0.0
    for run in runs:
        began = 0.0 if run is runs[0] else over
        if run.began_s is not None and runs[0].began_s is not None:
            began = max(began, run.began_s - runs[0].began_s)
        before: Piece | None = None
        for piece, start in run.log.starts():
            if len(piece) >= (2 if piece.complete else LEAST):
                yield _segment(run, piece, round(began + start * plan.period_s, 6), _at_rest(before, piece, start))
            before = piece
            over = began + (start + max(piece.ran or 0, len(piece))) * plan.period_s


def _segment(run: Run, piece: Piece, start_s: float, at_rest: bool) -> Segment:
    kind = piece.planned.kind
    parameters = {} if kind == "rest" else dict(run.slots[piece.planned.slot].header)
    if not piece.complete:
        parameters["interrupted"] = True
        turns = len(piece) * run.rig.period_s * float(parameters.get("frequency_Hz", 0.0))
        kind = "other" if kind == "sine" and turns < 2 else kind
    tick, duty, count, supply = (
        np.array(c, dtype=np.int64) for c in (piece.tick, piece.duty, piece.count, piece.supply_mV)
    )
    return Segment(
        kind,
        start_s,
        at_rest,
        parameters,
        tick * run.rig.period_s,
        duty / run.rig.board.full_scale * run.rig.supply_V,
        tick=tick,
        duty=duty,
        count=count,
        supply_V=supply / 1000,
    )


def _at_rest(before: Piece | None, piece: Piece, start: int) -> bool:
    """Whether the shaft stood still when the segment began: a run begins so, and a rest may end so."""
    if not piece.tick or piece.tick[0] != 0:
        return False
    if before is None:
        return start == 0
    if before.planned.kind != "rest" or len(before) < STILL or before.tick[-STILL] < before.planned.ticks - 2 * STILL:
        return False
    return len({*before.count[-STILL:], piece.count[0]}) == 1
