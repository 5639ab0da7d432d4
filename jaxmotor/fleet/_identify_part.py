"""One part of a data set: read motor by motor, identified batch by batch, one row each."""

from collections.abc import Hashable, Iterator
from typing import NamedTuple

from jaxmotor._errors import JaxmotorError
from jaxmotor.fleet._batch import BATCH, Identified, Started, results_of, start_batch
from jaxmotor.fleet._dataset import Entry, Part, read_part
from jaxmotor.fleet._diagnosed import diagnosis_columns
from jaxmotor.fleet._friction import FrictionFit, fit_friction
from jaxmotor.fleet._ready import Ready, problem_of, ready
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


class _Running(NamedTuple):
    """A batch whose program runs, or what stood in the way."""

    group: list[_Waiting]
    started: Started | Exception


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
    running: _Running | None = None
    for found in _ready(part):
        if isinstance(found, _Done):
            yield found
            continue
        begun = _begun(found, options)
        # While its program runs, the batch before is brought to an end, and the next is read and prepared.
        if running is not None:
            yield from _ended(running, options)
        running = begun
    if running is not None:
        yield from _ended(running, options)


def _ready(part: Part) -> Iterator[_Done | list[_Waiting]]:
    """The motors of `part` in batches, and the rows of those that are none."""
    waiting: dict[Hashable, list[_Waiting]] = {}
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
        group = waiting.setdefault(key := motor.key, [])
        group.append(_Waiting(order, entry, motor))
        if len(group) == BATCH:
            yield waiting.pop(key)
        elif sum(map(len, waiting.values())) >= MOST_WAITING:
            yield waiting.pop(max(waiting, key=lambda key: len(waiting[key])))
    yield from waiting.values()


def _begun(group: list[_Waiting], options: Options) -> _Running:
    try:
        return _Running(group, start_batch([one.ready for one in group], options.seed))
    except Exception as error:
        return _Running(group, error)


def _ended(running: _Running, options: Options) -> list[_Done]:
    """The rows of a batch; if the batch fails as a whole, its motors are done one by one."""
    group, started = running
    try:
        if isinstance(started, Exception):
            raise started
        return _batch(group, started, options)
    except Exception as error:
        if len(group) == 1:
            [one] = group
            return [_Done(one.order, one.entry, row_of(one.entry, None, problem_of(error)))]
        return [row for one in group for row in _ended(_begun([one], options), options)]


def _batch(group: list[_Waiting], started: Started, options: Options) -> list[_Done]:
    results = results_of(started)
    good = [(one, found) for one, found in zip(group, results, strict=True) if isinstance(found, Identified)]
    friction: dict[int, FrictionFit | None] = {}
    if options.friction and good:
        fits = fit_friction([one.ready for one, _ in good], [found for _, found in good])
        friction = {one.order: fit for (one, _), fit in zip(good, fits, strict=True)}
    rows = []
    for one, found in zip(group, results, strict=True):
        if isinstance(found, JaxmotorError):
            row = row_of(one.entry, None, str(found))
        else:
            row = row_of(one.entry, found, "", friction.get(one.order))
        rows.append(_Done(one.order, one.entry, row))
    return rows
