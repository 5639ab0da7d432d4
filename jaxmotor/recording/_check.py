"""What the data themselves tell: errors for the impossible, warnings for what weakens an estimate."""

import functools
import os
from fractions import Fraction

import numpy as np

from jaxmotor._arguments import is_number
from jaxmotor.recording._bunches import warn_bunches
from jaxmotor.recording._direction import SLOWEST_RAD_S, warn_early, warn_sign, warn_zero
from jaxmotor.recording._fixed_time import seen_fixed_time_s
from jaxmotor.recording._jumps import check_jumps, spikes, when
from jaxmotor.recording._pulse_windows import check_pulses, seen_pulses_per_rev
from jaxmotor.recording._ranges import ranges
from jaxmotor.recording._read import recording_of
from jaxmotor.recording._recording import Recording, RecordingError, Segment
from jaxmotor.recording._stopped import warn_stopped
from jaxmotor.recording._supply import begins_at_V, logs_supply

SATURATED_SHARE = 0.2
"""Share of saturated rows of a sine that is still no warning."""
CALIBRATION = 0.02
"""Relative difference of a stated and a logged supply that a divider may have."""
BEYOND = 1.1
"""Times the supply, up to which an input may be measured with an error, or at a battery that is full."""
NO_WINDOW = (
    "it is not known over how long each speed was averaged; state speed_window_s (jaxmotor import: --speed-window; 0 "
    "for an instantaneous one), or a delay will be seen that the motor does not have"
)
NO_SUPPLY = (
    "the supply voltage is not known, so effects that need it are left out: supply_sag, coast_drive (unless one "
    "voltage is switched on and off), and inputs that are cut off at full duty; state supply_V (jaxmotor import: "
    "--supply)"
)
LEAST_DUTY = 0.01
"""Share of the supply that turns no motor."""
WHOLE = 0.01
"""Part of a number of pulses per turn by which it may be off from a whole one, which it then is."""
LONG, FEW = 20.0, 0.02
"""A gap between rows over the usual time between them; and the share of rows up to which there are such gaps: with more
it is a way to log."""
PERIODIC = ("sine", "multisine", "chirp")


def check(recording: Recording | str | os.PathLike[str]) -> tuple[str, ...]:
    """Warnings, one sentence each and without the file's name, about what weakens an estimate from `recording`,
    which may be the path of its file.

    **Raises:** `RecordingError` where no estimate is possible: input or output never change, the count jumps by
    more than the motor could move, a sine without frequency or above the Nyquist frequency.
    """
    recording = recording_of(recording)
    check_input(recording)
    check_output(recording)
    check_sines(recording)
    check_jumps(recording)
    warns = (
        *(warn_saturation, warn_repetition, warn_lost_ticks, warn_unread, warn_gaps, warn_bunches, warn_overlap),
        *(warn_sign, warn_early, warn_zero, warn_stopped, warn_unknowns, warn_supply, warn_beyond_supply, warn_share),
        *(warn_repeats, warn_pulses, warn_fixed_time, warn_spikes),
    )
    return tuple(text for warn in warns for text in warn(recording))


def warn_imported(recording: Recording) -> list[str]:
    """What is seen of the log that a recording was imported from, and depends on how it was read."""
    of_readings = (warn_unread, warn_early, warn_pulses, warn_fixed_time, warn_spikes, warn_bunches, warn_stopped)
    return [text for warn in (*of_readings, warn_beyond_supply, warn_share) for text in warn(recording)]


def check_input(recording: Recording) -> None:
    """**Raises:** `RecordingError` where the input is never anything but zero."""
    if not any(segment.volts.any() for segment in recording.segments):
        raise RecordingError(
            f"{recording.source}: the input is 0 V throughout, so nothing can be identified; record steps, sines or a "
            "PRBS"
        )


def check_output(recording: Recording) -> None:
    """**Raises:** `RecordingError` where the shaft never moved, or its speed never changed, or is not known to be over
    what."""
    check_window(recording)
    check_pulses(recording)
    shafts = [segment.shaft for segment in recording.segments]
    if recording.measured == "speed":
        level, still = shafts[0][0], np.ptp(np.concatenate(shafts)) <= SLOWEST_RAD_S
        if still and abs(level) > SLOWEST_RAD_S:
            raise RecordingError(
                f"{recording.source}: the speed never changes ({level:g} rad/s throughout); check the sensor, or "
                "record steps, sines or a PRBS"
            )
    else:
        # A count on an edge may flicker by one.
        least = 1 if recording.measured == "count" else 0
        still = all(np.ptp(shaft) <= least for shaft in shafts)
    if still:
        raise RecordingError(
            f"{recording.source}: the motor never moved: check the supply, the bridge's enable pin, the wiring of "
            "the encoder, and that the input is large enough"
        )


def check_sines(recording: Recording) -> None:
    """**Raises:** `RecordingError` for a sine without frequency, or at or above the Nyquist frequency."""
    for index, segment in enumerate(recording.segments):
        if segment.kind != "sine":
            continue
        frequency = segment.sine_Hz
        if frequency is None:
            raise RecordingError(
                f"{recording.source}: segment {index} is a sine without frequency; add frequency_Hz = ... [Hz]"
            )
        nyquist = _nyquist_Hz(recording, segment)
        if frequency >= nyquist:
            raise RecordingError(
                f"{recording.source}: segment {index} is a sine of {frequency:g} Hz, not below the Nyquist frequency "
                f"of {nyquist:g} Hz; sample faster or lower the frequency"
            )


def warn_saturation(recording: Recording) -> list[str]:
    """Sines whose input is at full scale in more than a fifth of the rows."""
    shares = {
        index: share
        for index, segment in enumerate(recording.segments)
        if segment.kind in PERIODIC and (share := _saturated(recording, segment)) > SATURATED_SHARE
    }
    if not shares:
        return []
    worst = max(shares, key=lambda index: shares[index])
    return [
        f"{_segments(list(shares))}: saturated, segment {worst} in {shares[worst]:.0%} of its rows; lower the amplitude"
    ]


def warn_repetition(recording: Recording) -> list[str]:
    """Sines of which every few rows repeat exactly, and with them the rounding of the encoder."""
    repeating = {
        index: frequency
        for index, segment in enumerate(recording.segments)
        if segment.count is not None
        and (frequency := segment.sine_Hz) is not None
        and _repeats_after(recording, segment, frequency)
    }
    if not repeating:
        return []
    first = next(iter(repeating.values()))
    return [
        f"{_segments(list(repeating))}: whole periods in whole ticks, so the encoder repeats itself and its rounding "
        f"does not average out; detune by 0.1-1 % (such as {first * 1.003:.6g} Hz for {first:g} Hz)"
    ]


def warn_lost_ticks(recording: Recording) -> list[str]:
    """Segments with skipped ticks, and how many."""
    lost = {index: lost_ticks(segment) for index, segment in enumerate(recording.segments)}
    lost = {index: number for index, number in lost.items() if number}
    if not lost:
        return []
    total = sum(lost.values()) + sum(len(recording.segments[index]) for index in lost)
    return [f"{_segments(list(lost))}: lost {sum(lost.values())} of {total} ticks; the gaps are left as gaps"]


def warn_unread(recording: Recording) -> list[str]:
    """Rows without a reading."""
    read = np.concatenate([segment.read for segment in recording.segments])
    missing = int((~read).sum())
    if not missing:
        return []
    return [
        f"{missing} of {len(read)} rows have no {recording.measured}: their input counts, and nothing is compared with "
        "what the motor did there"
    ]


def warn_gaps(recording: Recording) -> list[str]:
    """A few times between uneven rows that are far longer than the others."""
    gaps: list[float] = []
    for segment in recording.segments:
        if segment.tick is None and len(segment) > 1:
            steps = np.diff(segment.time_s)
            long = steps[steps > LONG * np.median(steps)]
            gaps += long.tolist() if len(long) < FEW * len(steps) else []
    if not gaps:
        return []
    least, most = min(gaps), max(gaps)
    many = f"a gap of {least:.3g} s" if len(gaps) == 1 else f"{len(gaps)} gaps of {least:.3g} to {most:.3g} s"
    return [
        f"{many} between rows: the input is taken to have stayed meanwhile, and the clock to be right; where that is "
        f"doubtful, let segments begin there (jaxmotor import: --gap {0.5 * least:.1g})"
    ]


def warn_overlap(recording: Recording) -> list[str]:
    """Segments that begin before the one before them ended."""
    pairs = zip(recording.segments[:-1], recording.segments[1:], strict=True)
    early = [
        index
        for index, (before, after) in enumerate(pairs, 1)
        if after.start_s < (before.start_s + before.time_s[-1]) * (1 - 1e-9)
    ]
    if not early:
        return []
    return [f"{_segments(early)}: begins before the one before it ended; correct start_s, or drifts cannot be told"]


def check_window(recording: Recording) -> None:
    """**Raises:** `RecordingError` where speeds are over rows, and nobody knows how long these take."""
    if recording.speed_window_rows is not None and not recording.speed_window_s:
        raise RecordingError(
            f"{recording.source}: speed_window_rows needs speed_window_s, how long so many rows usually take"
        )


def warn_unknowns(recording: Recording) -> list[str]:
    """What the header leaves open."""
    sentences = []
    if recording.measured == "speed" and recording.speed_window_s is None:
        sentences.append(NO_WINDOW)
    if recording.supply_V is None:
        sentences.append(NO_SUPPLY)
    elif recording.header.get("supply_unknown") is True:
        sentences.append(
            "nobody knows the supply: 1 V stands for it, so volts are shares of it, and gains are speeds at full duty"
        )
    return sentences


def warn_repeats(recording: Recording) -> list[str]:
    """Readings in fewer rows than the input."""
    every = recording.header.get("readings_every_s")
    if not isinstance(every, int | float) or not is_number(every):
        return []
    others = "only these are kept, each with the mean input until the next"
    if recording.measured == "speed":
        means = recording.speed_window_rows == 0
        others = (
            "each is the mean speed since the last" if means else "rows that repeat one have none, but for their input"
        )
    return [
        f"a new reading came about every {1e3 * every:.3g} ms, in fewer rows than the input: {others}; let the sensor "
        "give readings as often as they are logged"
    ]


def warn_pulses(recording: Recording) -> list[str]:
    """Speeds that look like those from the time between two pulses, which nobody has stated."""
    if recording.measured != "speed" or recording.speed_pulses_per_rev is not None:
        return []
    number = seen_pulses_per_rev(recording.segments)
    if number is None:
        return []
    whole = round(number)
    number = whole if abs(number - whole) < WHOLE * whole else number
    return [
        f"each new speed is 1/{number:.4g} of a turn over the time since the one before it: it seems to come from the "
        f"time between two pulses of a sensor; import the log with --speed-pulses {number:.4g}"
    ]


def warn_fixed_time(recording: Recording) -> list[str]:
    """Speeds that look like those of a program that takes its rows to be even, which nobody has stated."""
    if recording.measured != "speed" or recording.speed_pulses_per_rev is not None:
        return []
    if recording.speed_window_rows is not None:
        return []
    usual_s = seen_fixed_time_s(recording.segments)
    if usual_s is None:
        return []
    return [
        "where a row comes late its speed is as much higher: it seems to be what was counted since the row before, "
        f"over a fixed time; import the log with --speed-period and that time, {usual_s:.3g} s if it is the usual one"
    ]


def warn_spikes(recording: Recording) -> list[str]:
    """Speeds and angles that last for a row or few, and that no motor has."""
    found = spikes(recording)
    if not found:
        return []
    index, row, rows = found[0]
    segment, measured = recording.segments[index], recording.measured
    more = f" (and {len(found) - 1} more)" if len(found) > 1 else ""
    unit, why = ("rad/s", "a counter that wraps, or a spike") if measured == "speed" else ("rad", "a lost reading")
    if measured == "speed" and not segment.shaft[row]:
        why = "a program that prints 0 for a row without a pulse"
    # Counts may be judged as angles.
    counts = measured == "angle" and recording.counts_per_rev is not None
    how = "--angle COL:counts --drop-spikes" if counts else "--drop-spikes"
    lasts = "that row only" if rows == 1 else f"that row and the next{'' if rows == 2 else f' {rows - 1}'} only"
    return [
        f"the {measured} of segment {index} at {when(segment, row)} is {segment.shaft[row]:.4g} {unit}, for {lasts}"
        f"{more}: no motor does that, but {why}; correct the {'row' if rows == 1 else 'rows'}, or leave the {measured} "
        f"there empty (jaxmotor import: {how})"
    ]


def warn_beyond_supply(recording: Recording) -> list[str]:
    """An input in volts that the supply does not have."""
    supply_V = recording.supply_V
    if supply_V is None or logs_supply(recording):
        return []
    sizes = np.concatenate([np.abs(segment.volts) for segment in recording.segments])
    beyond = int((sizes > BEYOND * supply_V).sum())
    if not beyond:
        return []
    return [
        f"{beyond} of {len(sizes)} rows ask for more than the supply, up to {sizes.max():.4g} of {supply_V:.4g} V: the "
        "motor got less; log the voltage after the limit, or state that (jaxmotor import: --input-limit), or correct "
        "supply_V (--supply)"
    ]


def warn_share(recording: Recording) -> list[str]:
    """An input that is stated as a share of another full scale than it has."""
    supply_V, stated = recording.supply_V, recording.header.get("imported")
    given = stated.get("input") if isinstance(stated, dict) else None
    if supply_V is None or not isinstance(given, str) or not (given.endswith(":percent") or ":duty:" in given):
        return []
    share = max(float(np.abs(segment.volts).max()) for segment in recording.segments) / supply_V
    if share > LEAST_DUTY:
        return []
    return [
        f"the input is at most {100 * share:.2g} % of the supply, which turns no motor; if its column holds shares of "
        "1 (0.5 for half of the supply), import it with the unit duty:1"
    ]


def warn_supply(recording: Recording) -> list[str]:
    """A logged supply that begins elsewhere than the stated one."""
    if not logs_supply(recording) or recording.supply_V is None:
        return []
    begin = begins_at_V(recording)
    if abs(begin / recording.supply_V - 1) < CALIBRATION:
        return []
    return [
        f"the logged supply begins at {begin:.4g} V, the header states {recording.supply_V:.4g} V: volts follow the "
        "log, scaled to begin at the stated one; correct supply_V if the log is right"
    ]


def _segments(indices: list[int]) -> str:
    """`segment 3`, or `segments 1-10, 12`."""
    return f"segment{'s' if len(indices) > 1 else ''} {ranges(indices)}"


def lost_ticks(segment: Segment) -> int:
    """Ticks that are missing between the first and the last row."""
    if segment.tick is None:
        return 0
    return int(segment.tick[-1] - segment.tick[0]) + 1 - len(segment)


def _nyquist_Hz(recording: Recording, segment: Segment) -> float:
    if recording.period_s is not None:
        return 0.5 / recording.period_s
    return 0.5 / float(np.median(np.diff(segment.time_s))) if len(segment) > 1 else np.inf


def _saturated(recording: Recording, segment: Segment) -> float:
    """Share of rows at full scale."""
    if segment.duty is not None and recording.duty_full_scale is not None:
        return float(np.mean(np.abs(segment.duty) >= recording.duty_full_scale))
    if recording.supply_V is None:
        return 0.0
    return float(np.mean(np.abs(segment.volts) >= recording.supply_V))


def _repeats_after(recording: Recording, segment: Segment, frequency_Hz: float) -> int:
    """Rows after which the sine's samples repeat to 1e-6 of a turn over the segment; 0 where they do not.

    Patterns of more than 400 rows, or seen less than three times, average out.
    """
    rows = len(segment)
    if recording.period_s is None or rows < 6:
        return 0
    return _repeating(frequency_Hz * recording.period_s, rows)


@functools.lru_cache(maxsize=256)
def _repeating(turns_per_row: float, rows: int) -> int:
    # Recordings of many motors share their sines.
    turns = Fraction(turns_per_row)
    ratio = turns.limit_denominator(min(rows // 3, 400))
    return ratio.denominator if abs(turns - ratio) * rows < 1e-6 else 0
