"""The volts that duties applied where the supply was logged beside them.

Readings of the supply give its shape, `Recording.supply_V` gives its scale: the unloaded supply at the first row is
that voltage, as a voltmeter showed it with the motor at rest. A board's divider and reference are off by some percent.
"""

import dataclasses

import numpy as np

from jaxmotor.recording._recording import Recording, Segment, mean_speeds
from jaxmotor.recording._supply_law import mean_supply, resolution_V
from jaxmotor.recording._supply_rows import LEAST, SupplyRows

COARSEST = 1e-3
"""Step of readings that are used, as a share of the supply. With 2.7e-3 and a reading every 100 ms, as on the rig,
what is left of the rounding in the volts (0.6 to 2 mV) makes gain and pole up to 3.5 times less exact."""
FEWEST = 8
"""Changes of a supply that is held between readings, to tell how often it is read."""


def supplied(recording: Recording, *, scaled: bool = True) -> Recording:
    """`recording` with the volts that its duties made of the supply that was logged.

    Where none was logged, or it stood still within the resolution of its readings, volts are duties times
    `Recording.supply_V`. With `scaled` the readings are scaled to begin at that voltage; else they are taken as they
    are, and that voltage becomes what they begin at.
    """
    if not logs_supply(recording):
        return recording
    assert recording.supply_V is not None and recording.duty_full_scale is not None
    rows = _rows_of(recording)
    supply, begin = mean_supply(rows)
    nominal = recording.supply_V if scaled else begin
    supply = np.full(len(rows.time), nominal) if supply is None else supply * (nominal / begin)
    segments, first = [], 0
    for segment in recording.segments:
        assert segment.duty is not None
        own = slice(first, first + len(segment))
        segments.append(dataclasses.replace(segment, volts=segment.duty / recording.duty_full_scale * supply[own]))
        first = own.stop
    return dataclasses.replace(recording, segments=tuple(segments), supply_V=nominal)


def logs_supply(recording: Recording) -> bool:
    """Whether a supply was logged well enough to say what the duties applied: its changes are a known input."""
    if recording.supply_V is None or recording.duty_full_scale is None:
        return False
    columns = [segment.supply_V for segment in recording.segments if segment.duty is not None]
    readings = np.concatenate([column for column in columns if column is not None] or [np.empty(0)])
    readings = readings[~np.isnan(readings)]
    whole = len([column for column in columns if column is not None]) == len(recording.segments)
    if not whole or len(readings) < LEAST or not (readings > 0).all():
        return False
    rows = _rows_of(recording)
    return bool(np.ptp(readings) == 0) or (rows.is_dense and resolution_V(rows) <= COARSEST * recording.supply_V)


def begins_at_V(recording: Recording) -> float:
    """What the readings of a recording that logs its supply say of the unloaded one when it began [V]."""
    return mean_supply(_rows_of(recording))[1]


def _rows_of(recording: Recording) -> SupplyRows:
    parts = [_segment_rows(recording, segment) for segment in recording.segments]
    *columns, tick = (np.concatenate(column) for column in zip(*parts, strict=True))
    rows = SupplyRows(*columns, coasts=recording.drive == "coast")  # pyright: ignore[reportCallIssue]
    return rows._replace(reading=_without_repeats(rows, tick))


def _segment_rows(recording: Recording, segment: Segment) -> tuple[np.ndarray, ...]:
    assert segment.duty is not None and segment.supply_V is not None
    length = np.diff(segment.time_s)
    usual = float(np.median(length)) if len(length) else recording.period_s or 1.0
    first = np.arange(len(segment)) == 0
    return (
        segment.start_s + segment.time_s,
        np.append(length, usual),
        first,
        first & segment.at_rest,
        segment.duty / (recording.duty_full_scale or 1.0),
        _mean_speeds(recording, segment),
        segment.supply_V,
        np.rint(segment.time_s / usual),
    )


def _mean_speeds(recording: Recording, segment: Segment) -> np.ndarray:
    """(n,) from each row to the next [rad/s]; the last one's is that before it."""
    if len(segment) < 2:
        return np.zeros(len(segment))
    speed, mean = segment.speed_rad_s, mean_speeds(recording, segment)
    if speed is not None and not recording.speed_window_s:
        mean = (speed[1:] + speed[:-1]) / 2  # else the mean over the time before a row is that of the row before it
    return np.append(mean, mean[-1])


def _without_repeats(rows: SupplyRows, tick: np.ndarray) -> np.ndarray:
    """(n,) readings without those that only repeat the last one, in recordings that hold one for so many ticks.

    That is so where all changes within a segment are whole multiples of some ticks apart.
    """
    reading = rows.reading
    changes = np.flatnonzero(~rows.first & (np.diff(reading, prepend=reading[:1]) != 0))
    if np.isnan(reading).any() or len(changes) < FEWEST:
        return reading
    part = np.cumsum(rows.first)
    apart = np.diff(tick[changes])[np.diff(part[changes]) == 0].astype(np.int64)
    pace = int(np.gcd.reduce(apart)) if len(apart) else 1
    if pace < 2:
        return reading
    fresh = np.zeros(len(reading), bool)
    for number in np.unique(part):
        own, known = part == number, changes[part[changes] == number]
        # Where it never changes its phase is not known: the last row of each pace has been told its value.
        phase = tick[known[0]] if len(known) else tick[own][0] + pace - 1
        fresh |= own & ((tick - phase) % pace == 0)
    return np.where(fresh, reading, np.nan)
