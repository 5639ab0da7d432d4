"""The account of a recording: each planned tick is a row, was lost on the way, or never ran; nothing is guessed."""

import dataclasses
from collections.abc import Iterable, Iterator, Sequence

from jaxmotor.bench._assemble import Run
from jaxmotor.bench._plan import Plan

MOST_GROUPS = 3
"""Of experiments that a sentence lists."""


@dataclasses.dataclass(frozen=True)
class Tally:
    """One experiment with the rest before it, in ticks: planned = rows + lost + skipped + not_run + unknown."""

    experiment: int
    """Index in the plan."""
    kind: str
    planned: int
    rows: int = 0
    """That came."""
    lost: int = 0
    """That the board ran and that did not come."""
    skipped: int = 0
    """That it was told to leave out."""
    not_run: int = 0
    """That it says it did not run."""
    unknown: int = 0
    """Of which it said nothing."""
    whole: bool = False
    """Nothing is missing."""


def tallies(plan: Plan, runs: Sequence[Run]) -> tuple[Tally, ...]:
    """Of each experiment the best of its runs."""
    best = [
        Tally(index, each.kind, planned, not_run=planned)
        for index, each in enumerate(plan.experiments)
        for planned in (each.ticks + each.rest_ticks,)
    ]
    for run in runs:
        for slot, index in enumerate(run.experiments):
            tally = _tally(run, slot, best[index])
            if (tally.whole, tally.rows) >= (best[index].whole, best[index].rows):
                best[index] = tally
    return tuple(best)


def missing(found: Iterable[Tally]) -> str:
    """What is missing and why, as part of a sentence; empty where nothing is."""
    found = tuple(found)
    groups = list(_groups(tally for tally in found if not tally.whole))
    if not groups:
        return ""
    rows = sum(tally.rows for tally in found)
    planned = sum(tally.planned - tally.skipped for tally in found)
    more = f", and {len(groups) - MOST_GROUPS} more" if len(groups) > MOST_GROUPS else ""
    return f"{rows} of {planned} samples came; missing: {', '.join(groups[:MOST_GROUPS])}{more}"


def _tally(run: Run, slot: int, empty: Tally) -> Tally:
    rows = lost = skipped = not_run = unknown = 0
    whole = True
    for segment, planned in enumerate(run.log.layout):
        if planned.slot != slot:
            continue
        piece = run.log.pieces.get(segment)
        came = 0 if piece is None else len(piece)
        rows += came
        whole &= piece is not None and piece.whole
        if piece is None or piece.ran is None:
            not_run += planned.ticks - came if run.log.accounted else 0
            unknown += 0 if run.log.accounted else planned.ticks - came
            continue
        lost += piece.ran - came
        skipped += planned.ticks - piece.ran if piece.complete else 0
        not_run += 0 if piece.complete else planned.ticks - piece.ran
    return dataclasses.replace(
        empty, rows=rows, lost=lost, skipped=skipped, not_run=not_run, unknown=unknown, whole=whole
    )


def _groups(found: Iterable[Tally]) -> Iterator[str]:
    """Each experiment with what it lacks; neighbours of which nothing came are one group."""
    groups: list[list[Tally]] = []
    for tally in found:
        last = groups[-1][-1] if groups else tally
        nothing = not last.rows + last.lost + tally.rows + tally.lost
        if nothing and last.experiment + 1 == tally.experiment and _why(last) == _why(tally):
            groups[-1].append(tally)
        else:
            groups.append([tally])
    for first, *others in groups:
        name = f"experiment {first.experiment + 1} ({first.kind.replace('_', ' ')})"
        if others:
            name = f"experiments {first.experiment + 1} to {others[-1].experiment + 1}"
        yield f"{name} {_why(first)}"


def _why(tally: Tally) -> str:
    if tally.rows + tally.lost == 0:
        return "not run" if not tally.unknown else "not reported by the board"
    parts = [
        f"{tally.lost} lost on the line" if tally.lost else "",
        f"{tally.not_run} not run" if tally.not_run else "",
        f"{tally.unknown} not reported by the board" if tally.unknown else "",
    ]
    return " and ".join(part for part in parts if part) or "not confirmed by the board"
