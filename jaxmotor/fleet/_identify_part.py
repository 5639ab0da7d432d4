"""One part of a data set: read motor by motor, identified batch by batch, one row each."""

from collections.abc import Iterator
from typing import NamedTuple

from jaxmotor._errors import JaxmotorError
from jaxmotor.fleet._batch import BATCH, Identified, identify_batch
from jaxmotor.fleet._dataset import Entry, Part, read_part
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
    """Draws the encoder offsets that standard errors may rest on."""


class _Waiting(NamedTuple):
    order: int
    entry: Entry
    ready: Ready


def identify_part(part: Part, options: Options) -> list[Row]:
    """One row for each motor of `part`, in their order; never an error."""
    rows = dict(_rows(part, options))
    return [rows[order] for order in sorted(rows)]


def _rows(part: Part, options: Options) -> Iterator[tuple[int, Row]]:
    waiting: dict[Key, list[_Waiting]] = {}
    for order, entry in enumerate(read_part(part)):
        if entry.recording is None:
            yield order, row_of(entry, None, entry.problem)
            continue
        try:
            motor = ready(entry.recording)
        except Exception as error:
            yield order, row_of(entry, None, problem_of(error))
            continue
        # What waits for its batch is its arrays; the recording is kept for its name and its columns' meaning.
        group = waiting.setdefault(motor.key, [])
        group.append(_Waiting(order, entry, motor))
        if len(group) == BATCH:
            yield from _done(waiting.pop(motor.key), options)
        elif sum(map(len, waiting.values())) >= MOST_WAITING:
            yield from _done(waiting.pop(max(waiting, key=lambda key: len(waiting[key]))), options)
    for group in waiting.values():
        yield from _done(group, options)


def _done(group: list[_Waiting], options: Options) -> list[tuple[int, Row]]:
    """The rows of a batch; if the batch fails as a whole, its motors are done one by one."""
    try:
        return _batch(group, options)
    except Exception as error:
        if len(group) == 1:
            return [(group[0].order, row_of(group[0].entry, None, problem_of(error)))]
        return [row for one in group for row in _done([one], options)]


def _batch(group: list[_Waiting], options: Options) -> list[tuple[int, Row]]:
    results = identify_batch([one.ready for one in group], options.seed)
    good = [(one, found) for one, found in zip(group, results, strict=True) if isinstance(found, Identified)]
    rubbing: dict[int, Rubbing | None] = {}
    if options.friction and good:
        fits = fit_friction([one.ready for one, _ in good], [found for _, found in good])
        rubbing = {one.order: fit for (one, _), fit in zip(good, fits, strict=True)}
    rows = []
    for one, found in zip(group, results, strict=True):
        if isinstance(found, JaxmotorError):
            rows.append((one.order, row_of(one.entry, None, str(found))))
        else:
            rows.append((one.order, row_of(one.entry, found, "", rubbing.get(one.order))))
    return rows
