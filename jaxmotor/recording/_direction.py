"""Which way the shaft turns, and when, by the input that drives it."""

import numpy as np

from jaxmotor.recording._jumps import follows_at_once, spikes
from jaxmotor.recording._recording import Recording, Segment, mean_speeds

SLOWEST_RAD_S = 1e-9
"""A speed, or a change of it, that is none: a turn in 200 years."""
FEW_BACK = 0.15
"""Share of rows that turn back where speeds have no sign: undoing a filter that smoothed them may make some."""
STILL, STRUCK = 0.05, 0.5
"""Of the largest speed, what is next to none, and what no shaft reaches before it is driven: read half a row late at
most, few motors are that fast."""
FAST, BOTH_WAYS = 0.2, 0.1
"""Of the largest speed, from which a shaft is driven and does not swing; and the share of rows with an input, all of
one sign, in which it turns so fast either way where that sign has been lost."""
ZERO_ROWS, STEADY = 50, 0.02
"""Rows without an input, at least, in which the shaft turns steadily: its speed changes by no more than that part."""
AT_ZERO = "the shaft turns on without an input"
"""How the note on that begins."""
EARLY = (
    "the shaft moves before it is driven: the log seems to hold the input that was applied until each row, not from it "
    "on; import it with --input-acts before"
)


def warn_sign(recording: Recording) -> list[str]:
    """A shaft that turns against the voltage, forward whatever the voltage is, or back with none that is negative."""
    volts = np.concatenate([segment.volts[:-1] for segment in recording.segments])
    speed = np.concatenate([mean_speeds(recording, segment) for segment in recording.segments])
    if _is_magnitude(volts, speed):
        return ["speeds have no sign: the motor is driven back and seems to turn on; give each that of its direction"]
    if _is_size(volts, speed):
        return [
            "the motor turns either way with inputs of one sign: they seem to be sizes; give each the sign of its "
            "direction, unless a load turns the motor back"
        ]
    if volts @ speed >= -0.1 * np.linalg.norm(volts) * np.linalg.norm(speed):
        return []
    return ["the motor turns against the voltage; swap the sign of the input or of the output"]


def warn_early(recording: Recording) -> list[str]:
    """A shaft that is still while there is no voltage, but for the last row of that, from which on it turns."""
    early = [index for index, segment in enumerate(recording.segments) if _is_early(recording, segment)]
    if not early:
        return []
    wrong = {(one.segment, one.row + k) for one in spikes(recording) for k in range(one.rows)}
    sound = [index for index in early if (index, _first_driven(recording.segments[index])) not in wrong]
    return [EARLY] if sound else []


def warn_zero(recording: Recording) -> list[str]:
    """A shaft that turns on steadily where the input is zero."""
    for index, segment in enumerate(recording.segments):
        stretches = _without_input(segment)
        speed = mean_speeds(recording, segment) if stretches else np.zeros(1)
        fastest = np.abs(speed).max()
        for start, stop in stretches:
            before, after = (float(np.median(np.array_split(speed[start:stop], 4)[k])) for k in (1, 3))
            if abs(after) > FAST * fastest and abs(after - before) < STEADY * abs(after):
                lasts = segment.time_s[stop] - segment.time_s[start]
                return [
                    f"{AT_ZERO}, in segment {index} at a steady {after:.4g} rad/s for {lasts:.3g} s: if something "
                    "else than the logged 0 is no voltage, state that (jaxmotor import: --input COL:duty:FULL@ZERO), "
                    "or log all that drives the motor"
                ]
    return []


def _without_input(segment: Segment) -> list[tuple[int, int]]:
    """Where the input is zero for many rows, in a segment that has another, too."""
    still = segment.volts[:-1] == 0
    edges = np.flatnonzero(np.diff(still.astype(int), prepend=0, append=0)).reshape(-1, 2)
    long = edges[edges[:, 1] - edges[:, 0] >= ZERO_ROWS]
    return [] if still.all() else [(start, stop) for start, stop in long.tolist()]


def _first_driven(segment: Segment) -> int:
    return int(np.argmax(segment.volts != 0))


def _is_early(recording: Recording, segment: Segment) -> bool:
    first = _first_driven(segment)
    # Over lost rows it may have been driven.
    if first < 2 or not follows_at_once(segment)[first - 1]:
        return False
    speed = mean_speeds(recording, segment)
    share = speed / max(np.abs(speed).max(), SLOWEST_RAD_S)
    # A reading that is off goes back in the next row, or back and forth.
    goes_on = len(share) > first and (np.sign(share[first - 1]) * share[first - 1 : first + 1] > STRUCK).all()
    return bool(np.abs(share[: first - 1]).max() < STILL and goes_on)


def _is_magnitude(volts: np.ndarray, speed: np.ndarray) -> bool:
    """The shaft hardly ever turns back, and follows the size of voltages of either sign better than the voltages."""
    back = volts < 0
    if not (back.any() and (volts > 0).any()) or (speed < 0).mean() > FEW_BACK:
        return False
    follows = abs(volts) @ speed > 2 * abs(volts @ speed)
    return bool(follows and speed[back].mean() > 0.2 * speed[~back].mean())


def _is_size(volts: np.ndarray, speed: np.ndarray) -> bool:
    """Inputs have one sign, and in a good part of the rows that have one the shaft turns fast to either side."""
    driven = volts != 0
    if volts.min() < 0 < volts.max() or not driven.any():
        return False
    fast = np.sign(speed[driven]) * (np.abs(speed[driven]) > FAST * np.abs(speed).max())
    return bool(min((fast > 0).mean(), (fast < 0).mean()) > BOTH_WAYS)
