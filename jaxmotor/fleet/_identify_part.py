"""One part of a data set: read motor by motor, identified batch by batch, one row each."""

from collections.abc import Iterator
from typing import NamedTuple

from jaxmotor._errors import JaxmotorError
from jaxmotor.fleet._batch import BATCH, Identified, identify_batch
from jaxmotor.fleet._dataset import Entry, Part, read_part
from jaxmotor.fleet._diagnosed import diagnosis_columns
from jaxmotor.fleet._friction import Rubbing, fit_friction
from jaxmotor.fleet._ready import Key, Ready, problem_of, ready
from jaxmotor.fleet._table import Row, row_of

MOST_WAITING = 4 * BATCH
"""Motors of unlike shapes that are held until their batches are full."""


class Options(NamedTuple):
    """What is asked of each motor."""

    friction: bool = False
    """Coulomb friction and a dead zone, too."""
    seed: int = 0
    """Draws the encoder offsets that standard errors may rest on, and the shuffles that chance is told by."""
    diagnose: bool = False
    """What the linear model gets wrong, too: seconds for each motor."""


class _Waiting(NamedTuple):
    order: int
    entry: Entry
    ready: Ready


class _Done(NamedTuple):
    order: int
    entry: Entry
    row: Row


def identify_part(part: Part, options: Options) -> list[Row]:
    """One row for each motor of `part`, in their order; never an error."""
    rows = {one.order: _told(one, options) for one in _rows(part, options)}
    return [rows[order] for order in sorted(rows)]


def _told(one: _Done, options: Options) -> Row:
    """Its row, diagnosed where that is asked for."""
    if not options.diagnose:
        return one.row
    return one.row | diagnosis_columns(one.entry.recording, one.row["problem"], options.seed)


def _rows(part: Part, options: Options) -> Iterator[_Done]:
    waiting: dict[Key, list[_Waiting]] = {}
    for order, entry in enumerate(read_part(part)):
        if entry.recording is None:
            yield _Done(order, entry, row_of(entry, None, entry.problem))
            continue
        try:
            motor = ready(entry.recording)
        except Exception as error:
            yield _Done(order, entry, row_of(entry, None, problem_of(error)))
            continue
        # What waits for its batch is its arrays; the recording is kept for its name and its columns' meaning.
        group = waiting.setdefault(motor.key, [])
        group.append(_Waiting(order, entry, motor))
        if len(group) == BATCH:
            yield from _identified(waiting.pop(motor.key), options)
        elif sum(map(len, waiting.values())) >= MOST_WAITING:
            yield from _identified(waiting.pop(max(waiting, key=lambda key: len(waiting[key]))), options)
    for group in waiting.values():
        yield from _identified(group, options)


def _identified(group: list[_Waiting], options: Options) -> list[_Done]:
    """The rows of a batch; if the batch fails as a whole, its motors are done one by one."""
    try:
        return _batch(group, options)
    except Exception as error:
        if len(group) == 1:
            [one] = group
            return [_Done(one.order, one.entry, row_of(one.entry, None, problem_of(error)))]
        return [row for one in group for row in _identified([one], options)]


def _batch(group: list[_Waiting], options: Options) -> list[_Done]:
    results = identify_batch([one.ready for one in group], options.seed)
    good = [(one, found) for one, found in zip(group, results, strict=True) if isinstance(found, Identified)]
    rubbing: dict[int, Rubbing | None] = {}
    if options.friction and good:
        fits = fit_friction([one.ready for one, _ in good], [found for _, found in good])
        rubbing = {one.order: fit for (one, _), fit in zip(good, fits, strict=True)}
    rows = []
    for one, found in zip(group, results, strict=True):
        if isinstance(found, JaxmotorError):
            row = row_of(one.entry, None, str(found))
        else:
            row = row_of(one.entry, found, "", rubbing.get(one.order))
        rows.append(_Done(one.order, one.entry, row))
    return rows
