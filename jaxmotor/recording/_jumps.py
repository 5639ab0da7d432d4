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
by the first condition alone, since a narrow counter wraps often.
"""

import numpy as np

from jaxmotor.recording._recording import Recording, RecordingError, Segment

FACTOR = 8.0
LEAST = 20
WIDTHS = (16, 24, 32)
"""Widths of counters that may wrap [bit]."""


def check_jumps(recording: Recording) -> None:
    """**Raises:** `RecordingError` for a count or angle that jumps by more than the motor could move."""
    if recording.measured == "speed":
        return
    motions = [_motion(recording, segment) for segment in recording.segments]
    usual = float(np.quantile(np.abs(np.concatenate(motions)), 0.99)) if any(map(len, motions)) else 0.0
    for index, (segment, motion) in enumerate(zip(recording.segments, motions, strict=True)):
        around = _around(motion)
        isolated = np.abs(motion) > FACTOR * around
        if recording.measured == "count":
            _check_counts(
                recording,
                index,
                isolated,
                around,
                isolated & (np.abs(motion) > FACTOR * usual) & ~_pulsed(segment.volts),
            )
        else:
            _check_turns(recording, index, segment, isolated)


def _check_counts(
    recording: Recording, index: int, isolated: np.ndarray, around: np.ndarray, large: np.ndarray
) -> None:
    count = recording.segments[index].count
    assert count is not None
    jump = np.diff(count)
    for width in WIDTHS:
        wrapped = isolated & (np.abs(np.abs(jump) - 2.0**width) <= LEAST + 2 * around)
        if wrapped.any():
            row = int(np.argmax(wrapped))
            raise _impossible(
                recording, index, row, jump[row], f"the {width}-bit counter wrapped; unwrap it when logging"
            )
    large &= np.abs(jump) > LEAST
    if large.any():
        row = int(np.argmax(large))
        if count[row + 1] == 0:
            reason = "the counter was set back; log the running count, or begin a segment there (count_resets)"
        else:
            reason = "check the encoder's wiring and the log"
        raise _impossible(recording, index, row, jump[row], reason)


def _check_turns(recording: Recording, index: int, segment: Segment, isolated: np.ndarray) -> None:
    assert segment.angle_rad is not None
    jump = np.diff(segment.angle_rad)
    wrapped = isolated & (np.abs(np.abs(jump) - 2 * np.pi) < 0.2 * np.pi)
    if wrapped.any():
        row = int(np.argmax(wrapped))
        raise RecordingError(
            f"{recording.source}: the angle jumps by one turn in segment {index} at {when(segment, row + 1)}: it was "
            "logged within one turn only; unwrap it before importing"
        )


def when(segment: Segment, row: int) -> str:
    """The row as the file names it: `tick 17` or `time_s 0.34`."""
    return f"time_s {segment.time_s[row]:g}" if segment.tick is None else f"tick {segment.tick[row]}"


def _impossible(recording: Recording, index: int, row: int, jump: np.int64, reason: str) -> RecordingError:
    place = f"segment {index} at {when(recording.segments[index], row + 1)}"
    return RecordingError(
        f"{recording.source}: the count jumps by {jump} in {place}, more than the supply could cause: {reason}"
    )


def _motion(recording: Recording, segment: Segment) -> np.ndarray:
    """(n - 1,) motion from each row to the next, per tick (per usual time step where time was logged)."""
    shaft = segment.count if segment.count is not None else segment.angle_rad
    assert shaft is not None
    elapsed = np.diff(segment.time_s if segment.tick is None else segment.tick).astype(np.float64)
    if segment.tick is None and len(elapsed):
        elapsed /= np.median(elapsed)
    return np.diff(shaft) / np.maximum(elapsed, 1.0)


def _pulsed(volts: np.ndarray) -> np.ndarray:
    """(n - 1,) the voltage held is 8 times that before and after: a pulse."""
    size = np.abs(volts)
    before, after = np.concatenate([[0.0], size[:-2]]), size[1:]
    return (size[:-1] > 0) & (size[:-1] >= FACTOR * np.maximum(before, after))


def _around(motion: np.ndarray) -> np.ndarray:
    """(n - 1,) the larger size of the motions beside each one.

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
