"""Jumps of the encoder that no motor can make.

A shaft has inertia: it may turn fast, but it does not turn fast for one row only. So a jump is impossible where the
motion from one row to the next

- is more than 8 times the motion on either side of it (for a glitch there and back: of what surrounds both jumps), and
- is more than 8 times what 99 % of all rows of the recording stay below, and
- is more than 20 counts, so that a slow motor's 0, 0, 1, 0 counts for nothing, and
- has no input to blame: the voltage held meanwhile is not itself 8 times that before and after.

Motion is taken per elapsed tick, so lost samples are no jumps. Starts, stops, reversals, steps, coasting and PRBS
pass because their motion lasts, and a single pulse into a motor much faster than the sampling by the last condition.
A jump within 20 counts (and the motion around it) of a power of two is a counter that wrapped; these are recognised
by the first condition alone, since a narrow counter wraps often. Of logged speeds a row is told on the same conditions,
with 20 times the smallest speed in the place of 20 counts; it is no error, for a long log may bear it. Less is enough
where the speed goes back while the voltage stays: up to three rows are told where they are left by a change that is
more than 8 times what the next two rows bring, and nearly all do under a voltage that stays, and that were entered by
one the other way. So it is with an angle that is off for one row: it is more than 8 times as far from the straight line
between its neighbours as nearly all rows are, and what these are off is what that one makes of them.
A speed of 0 for up to three rows under a voltage that stays, between speeds one way that are more than 4 times the
smallest, is that of a row without a pulse, where there are many such rows, and hardly any with little in place of 0.
"""

from typing import NamedTuple

import numpy as np

from jaxmotor.recording._recording import Recording, RecordingError, Segment

FACTOR = 8.0
"""Times the motion around it, from which a change of count is a jump."""
LEAST = 20
"""Counts of a jump at least."""
BACK = 3.0
"""Times what its neighbours are off without it, from which an angle is off alone."""
USUAL = 0.97
"""Quantile of angles' distances from their neighbours: a lost reading in a short log is three of the largest. And of
changes of a speed."""
FEW = 3
"""Rows that a wrong speed lasts at most."""
MANY = 10
"""Rows without a pulse that show what a program prints for them."""
PULSES = 4.0
"""Times the smallest speed, from which the next row's is not 0 as that of counts per row may be."""
LOST = 1.5
"""Times the usual length of a row, from which rows were lost."""
WIDTHS = (16, 24, 32)
"""Widths of counters that may wrap [bit]."""


def check_jumps(recording: Recording) -> None:
    """**Raises:** `RecordingError` for a count or angle that jumps by more than the motor could move."""
    if recording.measured == "speed":
        return
    # One pass over all segments: from the last row of one to the first of the next is no motion, but a border.
    ends = np.cumsum([len(segment) for segment in recording.segments]).tolist()
    borders = np.array(ends[:-1], int) - 1
    jump = np.diff(np.concatenate([segment.shaft for segment in recording.segments]))
    motion = jump / np.maximum(_elapsed(recording, ends), 1.0)
    motion[borders] = np.inf
    around = _around(motion)
    isolated = np.abs(motion) > FACTOR * around
    isolated[borders] = False
    if recording.measured == "angle":
        doubtful = isolated & (np.abs(np.abs(jump) - 2 * np.pi) < 0.2 * np.pi)
    else:
        doubtful = isolated & (np.abs(jump) > LEAST)
    if not doubtful.any():
        return
    usual = float(np.quantile(np.abs(np.delete(motion, borders)), 0.99))
    for index, (segment, end) in enumerate(zip(recording.segments, ends, strict=True)):
        rows = slice(end - len(segment), end - 1)
        if not doubtful[rows].any():
            continue
        if recording.measured == "angle":
            raise _one_turn(recording, index, int(np.argmax(doubtful[rows])))
        large = doubtful[rows] & (np.abs(motion[rows]) > FACTOR * usual) & ~_pulsed(segment.volts)
        _check_counts(recording, index, jump[rows], doubtful[rows], around[rows], large)


class Spike(NamedTuple):
    """Rows of which no motor has the speed or angle, beside those around them."""

    segment: int
    row: int
    """The first one."""
    rows: int = 1


def spikes(recording: Recording) -> list[Spike]:
    """Of the logged speeds or angles, in their order."""
    return {"speed": _speed_spikes, "angle": _angle_spikes, "count": lambda _: []}[recording.measured](recording)


def _angle_spikes(recording: Recording) -> list[Spike]:
    long = {index: one for index, one in enumerate(recording.segments) if len(one) > 4}
    if not long:
        return []
    off = {index: _off_line(one.time_s, one.shaft) for index, one in long.items()}
    every = np.abs(np.concatenate([own for own, _ in off.values()]))
    moved = np.abs(np.concatenate([np.diff(one.shaft) for one in long.values()]))
    least = max(FACTOR * float(np.quantile(every, USUAL)), LEAST * float(moved[moved > 0].min(initial=np.inf)))
    found = []
    for index, (own, part) in off.items():
        middle = own[1:-1]
        beside = np.maximum(np.abs(own[:-2] + part[:-2] * middle), np.abs(own[2:] + (1 - part[2:]) * middle))
        alone = (np.abs(middle) > least) & (np.abs(middle) > BACK * beside)
        found += [Spike(index, int(row) + 2) for row in np.flatnonzero(alone)]
    return found


def _off_line(time_s: np.ndarray, angle: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(n - 2,) by how much each inner row is off the straight line between its neighbours, and how far it is on the way
    from the one to the other [1]."""
    part = (time_s[1:-1] - time_s[:-2]) / (time_s[2:] - time_s[:-2])
    return angle[1:-1] - angle[:-2] - part * (angle[2:] - angle[:-2]), part


def follows_at_once(segment: Segment) -> np.ndarray:
    """(n - 1,) no row was lost between a row and the next, and both were read."""
    lasts, read = np.diff(segment.time_s), segment.read
    return (lasts < LOST * (np.median(lasts) if len(lasts) else 1.0)) & read[1:] & read[:-1]


def _speed_spikes(recording: Recording) -> list[Spike]:
    told: dict[tuple[int, int], Spike] = {}
    for one in (*_without_pulse(recording), *_there_and_back(recording), *_far_above(recording)):
        if not any((one.segment, one.row + k) in told for k in range(one.rows)):
            told |= {(one.segment, one.row + k): one for k in range(one.rows)}
    return sorted(set(told.values()))


def _without_pulse(recording: Recording) -> list[Spike]:
    """Up to `FEW` rows of speed 0 between much faster ones, if there are many."""
    sizes = np.abs(np.concatenate([segment.shaft[segment.read] for segment in recording.segments]))
    least = PULSES * float(sizes[sizes > 0].min(initial=np.inf))
    zeros, small = [], 0
    for index, segment in enumerate(recording.segments):
        for spike in _dips(index, segment, least):
            is_zero = not segment.shaft[spike.row : spike.row + spike.rows].any()
            zeros += [spike] if is_zero else []
            small += not is_zero
    return zeros if len(zeros) >= MANY and small <= (1 - USUAL) * len(zeros) else []


def _dips(index: int, segment: Segment, least: float) -> list[Spike]:
    """Up to `FEW` rows under one voltage that are slower than half of `least` [rad/s], between two that are faster than
    it, one way."""
    speed, slow = segment.shaft.astype(np.float64), np.abs(segment.shaft) < least / 2
    changes = np.flatnonzero(np.diff(slow, prepend=False, append=False))
    same = (segment.volts[1:] == segment.volts[:-1]) & follows_at_once(segment)
    found = []
    for row, end in changes.reshape(-1, 2).tolist():
        if row == 0 or end == len(speed) or end - row > FEW or not same[row - 1 : end].all():
            continue
        before, after = speed[row - 1], speed[end]
        if np.sign(before) == np.sign(after) and min(abs(before), abs(after)) > least:
            found.append(Spike(index, row, end - row))
    return found


def _there_and_back(recording: Recording) -> list[Spike]:
    """Up to `FEW` rows whose speed is left again while the voltage stays."""
    segments = recording.segments
    changes = [np.diff(segment.shaft.astype(np.float64)) for segment in segments]
    same = [(segment.volts[1:] == segment.volts[:-1]) & follows_at_once(segment) for segment in segments]
    usual = np.abs(np.concatenate([change[stays] for change, stays in zip(changes, same, strict=True)]))
    usual = usual[np.isfinite(usual)]
    least = FACTOR * float(np.quantile(usual, USUAL)) if len(usual) else np.inf
    found = []
    for index, (change, stays) in enumerate(zip(changes, same, strict=True)):
        after = np.maximum(np.abs(change[2:-1]), np.abs(change[3:]))
        left = (np.abs(change[1:-2]) > np.maximum(least, FACTOR * after)) & stays[:-3] & stays[1:-2]
        for row in (np.flatnonzero(left) + 1).tolist():
            rows = [rows for rows in range(1, FEW + 1) if _enters(change, stays, row, rows)]
            found += [Spike(index, row + 1 - rows[0], rows[0])] if rows else []
    return found


def _enters(change: np.ndarray, stays: np.ndarray, row: int, rows: int) -> bool:
    """The speed that `row` leaves was entered `rows` before, the other way; not by a pulse of the voltage, which has
    ended since."""
    if row < rows:
        return False
    entered, left = change[row - rows], change[row]
    switched = np.count_nonzero(~stays[max(row - rows - 1, 0) : row + 1])
    return bool(np.sign(entered) == -np.sign(left) and 2 * abs(entered) > abs(left) and switched <= 1)


def _far_above(recording: Recording) -> list[Spike]:
    """Rows whose speed is many times as large as any around them."""
    sizes = [np.abs(segment.shaft.astype(np.float64)) for segment in recording.segments]
    every = np.concatenate(sizes)
    least = max(FACTOR * float(np.quantile(every, 0.99)), LEAST * float(every[every > 0].min(initial=np.inf)))
    found = []
    for index, (segment, size) in enumerate(zip(recording.segments, sizes, strict=True)):
        beside = np.maximum(size[:-2], size[2:])
        pulsed = _pulsed(segment.volts)
        alone = (size[1:-1] > FACTOR * beside) & (size[1:-1] > least) & ~(pulsed[:-1] | pulsed[1:])
        found += [Spike(index, int(row) + 1) for row in np.flatnonzero(alone)]
    return found


def _check_counts(
    recording: Recording, index: int, jump: np.ndarray, doubtful: np.ndarray, around: np.ndarray, large: np.ndarray
) -> None:
    for width in WIDTHS:
        wrapped = doubtful & (np.abs(np.abs(jump) - 2.0**width) <= LEAST + 2 * around)
        if wrapped.any():
            row = int(np.argmax(wrapped))
            raise _impossible(
                recording, index, row, jump[row], f"the {width}-bit counter wrapped; import it with --wrap {width}"
            )
    if large.any():
        row = int(np.argmax(large))
        if recording.segments[index].shaft[row + 1] == 0:
            reason = "the counter was set back; log the running count, or begin a segment there (count_resets)"
        else:
            reason = "check the encoder's wiring and the log"
        raise _impossible(recording, index, row, jump[row], reason)


def _one_turn(recording: Recording, index: int, row: int) -> RecordingError:
    return RecordingError(
        f"{recording.source}: the angle jumps by one turn in segment {index} at "
        f"{when(recording.segments[index], row + 1)}: it was logged within one turn only; import it with --wrap turn"
    )


def when(segment: Segment, row: int) -> str:
    """The row as the file names it: `tick 17` or `time_s 0.34`."""
    return f"time_s {segment.time_s[row]:g}" if segment.tick is None else f"tick {segment.tick[row]}"


def _impossible(recording: Recording, index: int, row: int, jump: np.int64, reason: str) -> RecordingError:
    place = f"segment {index} at {when(recording.segments[index], row + 1)}"
    return RecordingError(
        f"{recording.source}: the count jumps by {jump} in {place}, more than the supply could cause: {reason}"
    )


def _elapsed(recording: Recording, ends: list[int]) -> np.ndarray:
    """(rows - 1,) ticks from each row to the next, through all segments; usual time steps where time was logged."""
    stamps = [segment.time_s if segment.tick is None else segment.tick for segment in recording.segments]
    elapsed = np.diff(np.concatenate(stamps)).astype(np.float64)
    for segment, end in zip(recording.segments, ends, strict=True):
        if segment.tick is None and len(segment) > 1:
            rows = slice(end - len(segment), end - 1)
            elapsed[rows] /= np.median(elapsed[rows])
    return elapsed


def _pulsed(volts: np.ndarray) -> np.ndarray:
    """(n - 1,) the voltage held is 8 times that before and after: a pulse."""
    size = np.abs(volts)
    before, after = np.concatenate([[0.0], size[:-2]]), size[1:]
    return (size[:-1] > 0) & (size[:-1] >= FACTOR * np.maximum(before, after))


def _around(motion: np.ndarray) -> np.ndarray:
    """The larger size of the motions beside each one; an infinite one stands between segments.

    A glitch jumps there and back: of its two jumps, each is compared with what lies beyond the other.
    The first and the last motion of a segment have one neighbour and are not judged (infinite).
    """
    infinite = [np.inf, np.inf]
    padded = np.concatenate([infinite, motion, infinite])
    far_left, left, right, far_right = padded[:-4], padded[1:-3], padded[3:-1], padded[4:]
    back_left = np.abs(left + motion) < np.abs(motion) / 2
    back_right = np.abs(right + motion) < np.abs(motion) / 2
    before = np.abs(np.where(back_left & ~back_right, far_left, left))
    after = np.abs(np.where(back_right & ~back_left, far_right, right))
    return np.maximum(before, after)
