"""A foreign log's columns, cut into the segments of a recording."""

import dataclasses
import itertools
from typing import Any

import numpy as np

from jaxmotor.recording._recording import Recording, Segment
from jaxmotor.recording._timing import Timing, timing


@dataclasses.dataclass(frozen=True)
class Log:
    """Columns in SI, not yet cut into segments."""

    stamps: tuple[np.ndarray, float]
    """(n,) time [s] and the step of its last printed digit [s]."""
    input: tuple[np.ndarray, np.ndarray | None, float | None]
    """(n,) volts, (n,) duty, and the duty that means the whole supply."""
    shaft: dict[str, np.ndarray]
    """(n,) of one name, `count`, `angle_rad` or `speed_rad_s`."""
    supply_V: np.ndarray | None = None
    """(n,) measured; NaN where it was not."""
    after_gap: np.ndarray | None = None
    """(n,) whether rows are missing before this one."""


def assemble(
    log: Log, bounds: np.ndarray, parameters: list[dict[str, Any]], kinds: list[str], *, source: str, **fields: Any
) -> Recording:
    """The recording whose segments lie between `bounds`; `fields` are those of `Recording`."""
    time_s, resolution_s = log.stamps
    cuts = [slice(start, stop) for start, stop in itertools.pairwise(bounds.tolist())]
    times = timing([time_s[cut] for cut in cuts], resolution_s)
    if times.ticks is None and log.after_gap is not None and log.after_gap.any():
        # Even rows have skipped ticks; between uneven ones only the end of a segment is a gap.
        within = log.after_gap & ~np.isin(np.arange(len(time_s)), bounds)
        of = np.searchsorted(bounds, np.flatnonzero(within), side="right") - 1
        number = np.sort(np.concatenate([np.arange(len(kinds)), of]))
        bounds = np.sort(np.concatenate([bounds, np.flatnonzero(within)]))
        parameters, kinds = [parameters[k] for k in number], [kinds[k] for k in number]
        cuts = [slice(start, stop) for start, stop in itertools.pairwise(bounds.tolist())]
        times = Timing(None, None, [time_s[cut] - time_s[cut.start] for cut in cuts])
    starts = _starts([time_s[cut] for cut in cuts])
    volts, duty, _ = log.input
    [(measured, shaft)] = log.shaft.items()
    segments = []
    for index, cut in enumerate(cuts):
        tick = None if times.ticks is None else times.ticks[index]
        logged: dict[str, Any] = {measured: shaft[cut]}
        segments.append(
            Segment(
                kind=kinds[index],
                start_s=starts[index],
                at_rest=_begins(log, cut) and _rests(volts[cut], shaft[cut], measured == "speed_rad_s"),
                parameters=parameters[index],
                time_s=times.times_s[index] if tick is None else tick * times.period_s,
                volts=volts[cut],
                tick=tick,
                duty=None if duty is None else duty[cut],
                supply_V=None if log.supply_V is None else log.supply_V[cut],
                **logged,
            )
        )
    return Recording(segments=tuple(segments), source=source, period_s=times.period_s, **fields)


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


def _rests(volts: np.ndarray, shaft: np.ndarray, is_speed: bool) -> bool:
    """The first rows, two or more, have zero input, and throughout them the shaft does not move."""
    driven = np.flatnonzero(volts)
    rows = int(driven[0]) if len(driven) else len(volts)
    still = 0.0 if is_speed else shaft[0]
    return rows >= 2 and bool((shaft[:rows] == still).all())
