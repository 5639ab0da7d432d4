"""Brings a log from elsewhere in: a CSV with time stamps, an input and a shaft, all units stated."""

import contextlib
import dataclasses
import itertools
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Literal

import numpy as np

from jaxmotor.recording._recording import Recording, RecordingError, Segment
from jaxmotor.recording._table import Table, read_table
from jaxmotor.recording._timing import timing
from jaxmotor.recording._units import Input, Scale, angle_factor, speed_factor, split_input, split_time, split_unit

MAX_LABELS = 10_000


def import_log(
    path: str | os.PathLike[str],
    *,
    time: str = "t_s:s",
    input: str = "u_V:V",
    speed: str | None = None,
    angle: str | None = None,
    count: str | None = None,
    segment: str | None = None,
    supply_V: float | int | None = None,
    counts_per_rev: float | int | None = None,
    speed_window_s: float | int | None = None,
    wheel_radius_m: float | int | None = None,
    drive: Literal["brake", "coast"] | None = None,
    input_acts: Literal["after", "before"] = "after",
) -> Recording:
    """The recording in the CSV at `path`, whose columns and units are stated.

    `time` is `COL[:s|ms|us]`; `input` is `COL:V`, `COL:mV`, `COL:duty:FULL` or `COL:percent`, of which the last two
    need `supply_V`; exactly one of `speed` (`COL:UNIT`), `angle` (`COL:UNIT`) and `count` (`COL`) is given.
    Even time stamps become ticks, uneven ones stay time. Each change of the column `segment` begins a new segment;
    its value is kept as the parameter `label`. A segment is taken to start at rest only where the log shows it: at
    least its first two rows have zero input, and throughout these rows the shaft does not move. `input_acts` says
    whether a row's input is applied from that row on, or was until it: then it is moved to the row before, and of the
    last row the input is not known and taken to stay.

    **Raises:** `RecordingError`.
    """
    _check_choice(speed, angle, count)
    scale = Scale(positive(counts_per_rev, "--counts-per-rev"), positive(wheel_radius_m, "--wheel-radius"))
    supply_V, speed_window_s = positive(supply_V, "--supply"), _window(speed_window_s)
    table = read_table(Path(path))
    names = list(table.cells)
    with _about(table.source):
        log = Log(
            stamps=_stamps(table, *split_time(time, names)),
            input=input_of(table, split_input(input, names), supply_V),
            shaft=shaft_of(table, names, scale, speed, angle, count),
        )
        bounds, labels = _bounds(table, segment)
        _check_time(table, log.stamps[0], bounds)
    if input_acts == "before":
        log = dataclasses.replace(log, input=_acted_before(log.input, bounds))
    stated = {"time": time, "input": input, "speed": speed, "angle": angle, "count": count, "segment": segment}
    return assemble(
        log,
        bounds,
        [{} if label is None else {"label": label} for label in labels],
        ["other"] * len(labels),
        source=table.source,
        counts_per_rev=scale.counts_per_rev,
        duty_full_scale=log.input[2],
        supply_V=supply_V,
        speed_window_s=speed_window_s,
        drive=drive,
        header={"imported": _how(Path(path), input_acts, stated)},
    )


def _how(path: Path, input_acts: str, stated: dict[str, str | None]) -> dict[str, str]:
    """The log and how it was read, for the header: only what was stated."""
    acts = {} if input_acts == "after" else {"input_acts": input_acts}
    return {"log": path.name} | acts | {key: value for key, value in stated.items() if value is not None}


@contextlib.contextmanager
def _about(source: str) -> Iterator[None]:
    """Errors inside say which log they are about."""
    try:
        yield
    except RecordingError as error:
        if str(error).startswith(source):
            raise
        raise RecordingError(f"{source}: {error}") from error


@dataclasses.dataclass(frozen=True)
class Log:
    """Columns in SI, not yet cut into segments."""

    stamps: tuple[np.ndarray, float]
    """(n,) time [s] and the step of its last printed digit [s]."""
    input: tuple[np.ndarray, np.ndarray | None, float | None]
    """(n,) volts, (n,) duty, and the duty that means the whole supply."""
    shaft: dict[str, np.ndarray]
    """(n,) of one name, `count`, `angle_rad` or `speed_rad_s`."""


def assemble(
    log: Log, bounds: np.ndarray, parameters: list[dict[str, Any]], kinds: list[str], *, source: str, **fields: Any
) -> Recording:
    """The recording whose segments lie between `bounds`; `fields` are those of `Recording`."""
    time_s, resolution_s = log.stamps
    cuts = [slice(start, stop) for start, stop in itertools.pairwise(bounds.tolist())]
    times = timing([time_s[cut] for cut in cuts], resolution_s)
    starts = _starts([time_s[cut] for cut in cuts])
    volts, duty, _ = log.input
    (shaft,) = log.shaft.values()
    (measured,) = log.shaft
    segments = []
    for index, cut in enumerate(cuts):
        tick = None if times.ticks is None else times.ticks[index]
        segments.append(
            Segment(
                kind=kinds[index],
                start_s=starts[index],
                at_rest=_rests(volts[cut], shaft[cut], measured == "speed_rad_s"),
                parameters=parameters[index],
                time_s=times.times_s[index] if tick is None else tick * times.period_s,
                volts=volts[cut],
                tick=tick,
                duty=None if duty is None else duty[cut],
                count=shaft[cut] if measured == "count" else None,
                angle_rad=shaft[cut] if measured == "angle_rad" else None,
                speed_rad_s=shaft[cut] if measured == "speed_rad_s" else None,
            )
        )
    return Recording(segments=tuple(segments), source=source, period_s=times.period_s, **fields)


def _check_choice(speed: str | None, angle: str | None, count: str | None) -> None:
    if sum(choice is not None for choice in (speed, angle, count)) != 1:
        raise RecordingError("exactly one of --speed, --angle and --count is needed; state which column is the shaft")


def positive(value: float | int | None, flag: str) -> float | None:
    if value is not None and not 0 < value < np.inf:
        raise RecordingError(f"{flag} is {value}; it is a positive number")
    return None if value is None else float(value)


def _window(value: float | int | None) -> float | None:
    if value is not None and not 0 <= value < np.inf:
        raise RecordingError(f"--speed-window is {value}; give seconds, 0 for an instantaneous speed")
    return None if value is None else float(value)


def _stamps(table: Table, column: str, unit_s: float) -> tuple[np.ndarray, float]:
    return table.numbers(column) * unit_s, table.resolution(column) * unit_s


def input_of(
    table: Table, stated: Input, supply_V: float | int | None
) -> tuple[np.ndarray, np.ndarray | None, float | None]:
    values = table.numbers(stated.column)
    if stated.full_scale is None:
        return values * stated.volts_per_unit, None, None
    if supply_V is None:
        raise RecordingError("duty and percent need the supply voltage to become volts (--supply)")
    beyond = np.abs(values) > stated.full_scale
    if beyond.any():
        row = int(np.argmax(beyond))
        sentence = f"{stated.column} is {values[row]:g}, beyond the full scale of {stated.full_scale:g}; state another"
        raise table.fault(row, sentence)
    duty = table.integers(stated.column)
    volts = (values if duty is None else duty) / stated.full_scale * supply_V
    return volts, duty, None if duty is None else stated.full_scale


def _acted_before(
    given: tuple[np.ndarray, np.ndarray | None, float | None], bounds: np.ndarray
) -> tuple[np.ndarray, np.ndarray | None, float | None]:
    """Each segment's inputs, from the row before on."""
    row = np.arange(1, bounds[-1] + 1)
    row[bounds[1:] - 1] -= 1
    volts, duty, full = given
    return volts[row], None if duty is None else duty[row], full


def shaft_of(
    table: Table, names: list[str], scale: Scale, speed: str | None, angle: str | None, count: str | None
) -> dict[str, np.ndarray]:
    if speed is not None:
        column, unit = split_unit(speed, names, "the speed")
        return {"speed_rad_s": table.numbers(column) * speed_factor(unit, scale)}
    if angle is not None:
        column, unit = split_unit(angle, names, "the angle")
        return {"angle_rad": table.numbers(column) * angle_factor(unit, scale)}
    if count not in names:
        raise RecordingError(f"there is no column {count!r}; the columns are {', '.join(map(repr, names))}")
    angle_factor("counts", scale)
    counts = table.integers(count)
    if counts is None:
        raise RecordingError(f"column {count!r} has counts that are not whole; give it as --angle {count}:counts")
    return {"count": counts}


def _bounds(table: Table, segment: str | None) -> tuple[np.ndarray, list[str | None]]:
    """(segments + 1,) rows at which segments begin, and the end; the label of each."""
    rows = len(next(iter(table.cells.values())))
    if segment is None:
        return np.array([0, rows]), [None]
    if segment not in table.cells:
        raise RecordingError(f"there is no column {segment!r}; the columns are {', '.join(map(repr, table.cells))}")
    labels = [label.strip() for label in table.cells[segment]]
    starts = [0, *(row for row in range(1, rows) if labels[row] != labels[row - 1])]
    if len(starts) > MAX_LABELS:
        raise RecordingError(f"{segment!r} changes {len(starts)} times; it is no segment column, or split the log")
    return np.array([*starts, rows]), [labels[row] for row in starts]


def _check_time(table: Table, time_s: np.ndarray, bounds: np.ndarray) -> None:
    step = np.diff(time_s)
    step[bounds[1:-1] - 1] = 1.0
    if (step <= 0).any():
        row = int(np.argmax(step <= 0)) + 1
        what = "stands still" if step[row - 1] == 0 else "runs backwards"
        hint = "" if len(bounds) > 2 else ", or name the column that tells the experiments apart (--segment)"
        raise table.fault(row, f"the time {what} at {time_s[row]:g} s; correct or delete the row{hint}")


def _starts(times_s: list[np.ndarray]) -> list[float]:
    """Start of each segment since the first one's. Where time restarts, one usual step after the last segment."""
    steps = np.concatenate([np.diff(time) for time in times_s])
    step = float(np.median(steps)) if len(steps) else 0.0
    starts = [0.0]
    for before, after in itertools.pairwise(times_s):
        gap = after[0] - before[-1]
        starts.append(float(starts[-1] + before[-1] - before[0] + (gap if gap > 0 else step)))
    return starts


def _rests(volts: np.ndarray, shaft: np.ndarray, is_speed: bool) -> bool:
    """The first rows, two or more, have zero input, and throughout them the shaft does not move."""
    driven = np.flatnonzero(volts)
    rows = int(driven[0]) if len(driven) else len(volts)
    still = 0.0 if is_speed else shaft[0]
    return rows >= 2 and bool((shaft[:rows] == still).all())
