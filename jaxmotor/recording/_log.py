"""A foreign log's columns, cut into the segments of a recording."""

import itertools
from collections.abc import Mapping
from typing import Any

import numpy as np

from jaxmotor.recording._log_columns import Log
from jaxmotor.recording._recording import Recording, Segment
from jaxmotor.recording._repeats import Repeats, without_repeats, without_unread
from jaxmotor.recording._timing import timing
from jaxmotor.recording._unread import are_far_apart, filled

STILL = 3
"""Rows of a shaft that is driven and does not move, from which it is taken to begin at rest."""
SLOW, USUAL = 0.02, 0.95
"""Part of the segment's fast speeds, this quantile of all, up to which one that nobody sees is next to none."""
TINY_s = 1e-9
"""In the place of a time of zero."""


def assemble(
    log: Log,
    bounds: np.ndarray,
    parameters: list[dict[str, Any]],
    kinds: list[str],
    *,
    source: str,
    header: Mapping[str, Any],
    keep_repeats: bool = False,
    **fields: Any,
) -> Recording:
    """The recording whose segments lie between `bounds`, without repeated readings unless they are to be kept; `fields`
    are those of `Recording`."""
    repeats = None
    if not keep_repeats:
        turns = "speed_rad_s" not in log.shaft
        log, bounds, repeats = _without_repeats(log, bounds, fields.get("counts_per_rev"))
        if turns and repeats is not None and "speed_rad_s" in log.shaft:
            fields |= {"speed_window_s": float(f"{repeats.time_s:.6g}"), "speed_window_rows": 0}
    if repeats is not None:
        header = {**header, "readings_every_s": float(f"{repeats.time_s:.6g}")}
    time_s, resolution_s = log.stamps
    cuts = _cuts(bounds)
    times = timing([time_s[cut] for cut in cuts], resolution_s)
    ticks, period_s = times.ticks, times.period_s
    if repeats is not None and ticks is not None and any((np.diff(tick) > 1).any() for tick in ticks):
        # A row that only repeats a reading is not lost: what was applied is known.
        ticks = period_s = None
    if ticks is None and log.after_gap is not None:
        # Even rows have skipped ticks; between uneven ones only the end of a segment is a gap.
        within = np.flatnonzero(log.after_gap & ~np.isin(np.arange(len(time_s)), bounds))
        of = np.searchsorted(bounds, within, side="right") - 1
        number = np.sort(np.concatenate([np.arange(len(kinds)), of]))
        parameters, kinds = [parameters[k] for k in number], [kinds[k] for k in number]
        cuts = _cuts(np.sort(np.concatenate([bounds, within])))
    starts = _starts([time_s[cut] for cut in cuts])
    volts, duty, _ = log.input
    [(measured, shaft)] = log.shaft.items()
    is_speed = measured == "speed_rad_s"
    finest = _finest(shaft[log.read], is_speed)
    unread = log.unread
    if unread is not None:
        shaft = np.concatenate([filled(shaft[cut], time_s[cut], unread[cut]) for cut in cuts])
    segments = []
    for index, cut in enumerate(cuts):
        tick = None if ticks is None else ticks[index]
        logged: dict[str, Any] = {measured: shaft[cut]}
        segments.append(
            Segment(
                kind=kinds[index],
                start_s=starts[index],
                at_rest=_begins(log, cut)
                and _rests(time_s[cut], volts[cut], shaft[cut], log.read[cut], is_speed, finest),
                parameters=parameters[index],
                time_s=time_s[cut] - time_s[cut.start] if tick is None else tick * period_s,
                volts=volts[cut],
                tick=tick,
                duty=None if duty is None else duty[cut],
                supply_V=None if log.supply_V is None else log.supply_V[cut],
                unread=None if unread is None else unread[cut],
                **logged,
            )
        )
    return Recording(
        segments=tuple(segments),
        source=source,
        period_s=period_s,
        duty_full_scale=log.input.full_scale,
        header=header,
        **fields,
    )


def _cuts(bounds: np.ndarray) -> list[slice]:
    return [slice(start, stop) for start, stop in itertools.pairwise(bounds.tolist())]


def _without_repeats(
    log: Log, bounds: np.ndarray, counts_per_rev: float | None
) -> tuple[Log, np.ndarray, Repeats | None]:
    """As `without_repeats`, also where few rows say what was turned."""
    if log.unread is not None and "speed_rad_s" not in log.shaft and (log.apart or are_far_apart(log.read)):
        return without_unread(log, bounds, counts_per_rev)
    return without_repeats(log, bounds, counts_per_rev)


def _starts(times_s: list[np.ndarray]) -> list[float]:
    """Start of each segment since the first one's. Where time restarts, one usual step after the last segment."""
    steps = np.concatenate([np.diff(time) for time in times_s])
    step = float(np.median(steps)) if len(steps) else 0.0
    starts = [0.0]
    for before, after in itertools.pairwise(times_s):
        gap = after[0] - before[-1]
        starts.append(float(starts[-1] + before[-1] - before[0] + (gap if gap > 0 else step)))
    return starts


def _begins(log: Log, cut: slice) -> bool:
    """No row is missing before the segment."""
    return log.after_gap is None or not log.after_gap[cut.start]


def _finest(shaft: np.ndarray, is_speed: bool) -> float:
    """The least speed, or the least change of counts or angle, that the log shows; zero where it shows none."""
    seen = np.abs(shaft if is_speed else np.diff(shaft))
    return float(seen[seen > 0].min()) if (seen > 0).any() else 0.0


def _rests(
    time_s: np.ndarray, volts: np.ndarray, shaft: np.ndarray, read: np.ndarray, is_speed: bool, finest: float
) -> bool:
    """By what was `read`, the shaft does not move while the first rows, two or more, have zero input; or, where it is
    driven before, in the first `STILL` rows, in which a turning that the log does not show (`finest`) would be `SLOW`.
    """
    driven = np.flatnonzero(volts)
    rows = int(driven[0]) if len(driven) else len(volts)
    moves = np.flatnonzero(read & (shaft != (0.0 if is_speed else shaft[0])))
    still = int(moves[0]) if len(moves) else len(volts)
    if rows >= 2 or np.count_nonzero(read[:still]) < STILL or not len(moves):
        return 2 <= rows <= still and bool(read[:rows].any())
    speeds = np.abs(shaft if is_speed else np.diff(shaft) / np.maximum(np.diff(time_s), TINY_s))
    unseen = finest if is_speed else finest / max(time_s[still - 1] - time_s[0], TINY_s)
    return bool(unseen <= SLOW * np.quantile(speeds, USUAL))
