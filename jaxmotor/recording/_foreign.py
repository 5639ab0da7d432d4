"""Brings a log from elsewhere in: a CSV with time stamps, an input and a shaft, all units stated."""

import dataclasses
import functools
import itertools
import math
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Literal, get_args

import numpy as np

from jaxmotor._arguments import check_choice, check_text, check_whole, is_number, path_of
from jaxmotor._sentences import shown
from jaxmotor.recording._check import lost_ticks
from jaxmotor.recording._chosen_rows import between_moments, check_apart, of_one
from jaxmotor.recording._damaged import in_order, whole_table
from jaxmotor.recording._fixed_time import over_rows
from jaxmotor.recording._header import RANGES
from jaxmotor.recording._known_step import known_step
from jaxmotor.recording._log import assemble
from jaxmotor.recording._log_columns import Inputs, Log
from jaxmotor.recording._matlab import is_matlab, read_matlab
from jaxmotor.recording._own_words import in_own_words
from jaxmotor.recording._pulse_windows import usual_window_s
from jaxmotor.recording._recording import Recording, RecordingError
from jaxmotor.recording._shaft import Shaft
from jaxmotor.recording._supply import supplied
from jaxmotor.recording._table import Table, read_table
from jaxmotor.recording._text import about_log
from jaxmotor.recording._units import VOLTS, Input, Scale, positive, split_factor, split_input, split_time, split_unit
from jaxmotor.recording._unread import are_far_apart, between
from jaxmotor.recording._without_spikes import without_spikes

Drive = Literal["brake", "coast"]
Acts = Literal["after", "before"]
MAX_LABELS = 10_000
"""Segments that a column of labels may begin."""
FINEST_DUTY = 9
"""Decimals to which fractions of the supply are kept as whole duties."""
INPUT = "u_V:V"
"""What the input is taken to be where it is not stated."""
HOLDS = "; where an input acts until the next one, state --input-holds"
"""What else may be where no row has both."""
UNKNOWN_V = 1.0
"""Stands for a supply that is not known, so that volts are shares of it."""


@in_own_words
def import_log(
    path: str | os.PathLike[str] | Table,
    *,
    time: str | None = None,
    input: str | None = None,
    step_V: float | int | None = None,
    step_at_s: float | int | None = None,
    step_until_s: float | int | None = None,
    speed: str | None = None,
    angle: str | None = None,
    count: str | None = None,
    pulses: str | None = None,
    wrap: int | Literal["turn"] | None = None,
    segment: str | None = None,
    only: str | None = None,
    gap_s: float | int | None = None,
    begin_s: float | int | None = None,
    end_s: float | int | None = None,
    supply: str | None = None,
    supply_V: float | int | None = None,
    supply_unknown: bool = False,
    counts_per_rev: float | int | None = None,
    speed_window_s: float | int | None = None,
    speed_pulses_per_rev: float | int | None = None,
    speed_period_s: float | int | None = None,
    wheel_radius_m: float | int | None = None,
    drive: Drive | None = None,
    input_acts: Acts = "after",
    input_holds: bool = False,
    input_limit: float | int | None = None,
    columns: str | None = None,
    drop_first: int = 0,
    drop_spikes: bool = False,
    drop_damaged: bool = False,
    decimal_comma: bool = False,
    period_s: float | int | None = None,
) -> Recording:
    """The recording in the CSV or MATLAB file at `path`, whose columns and units are stated.

    `time` is `COL[:s|ms|us|ns]`, `t_s:s` unless stated; rows of a log without time stamps are `period_s` [s] apart.
    `input` is `COL:V` (`u_V:V` unless stated), `COL:mV`, `COL:duty:FULL`, `COL:duty:FULL@ZERO` (ZERO is no voltage) or
    `COL:percent`, of which the last three need a supply. Where no column has it, it is one step: `step_V` [V] from the
    first row of each segment on, or from the first that is `step_at_s` [s] later, to the first that is `step_until_s`
    [s] later, and 0 V before and after.

    Exactly one of `speed` (`COL:UNIT`), `angle` (`COL:UNIT`), `count` (`COL`, a running counter) and
    `pulses` (`COL`, the counts since the row before) is given. `wrap` is the width [bit] of a counter that wraps, or
    `"turn"` for an angle within one turn. The supply is `supply_V`, or the column `supply` (`COL:V|mV`), or both:
    then the column is scaled so that it begins at `supply_V`. Where it is `supply_unknown`, 1 V stands for it.

    Even time stamps become ticks, uneven ones stay time. Each change of the column `segment` begins a new segment; its
    value is kept as the parameter `label`; where that is the column of the time, one begins wherever time runs back.
    So it does after more than `gap_s` [s] between two rows: what was applied meanwhile is not known. Of a log of
    several motors by turns, `only` (`COL=VALUE`) names the one whose rows are read; of a log that holds more than is
    wanted, rows are read from `begin_s` on and up to `end_s` [s] after the first one. A segment is taken to start at
    rest only where the log shows it: at least its first two rows have zero input, and throughout these rows
    the shaft does not move. `input_acts` says whether a row's input is applied from that row on, or was until it: then
    it is moved to the row before, and of the last row the input is not known and taken to stay. Where `input_holds` the
    last input acts until the next one is given, in a log that has inputs and readings at moments of their own.
    Otherwise a row whose input is missing (empty or `nan`) is a gap: a skipped tick where time stamps are even, else
    the next row begins a new segment. So is one whose count is missing; without an angle or a speed a row is kept for
    its input (`Segment.unread`). So is one that only repeats a reading while the shaft moves on; the header then says
    how often a new one comes. Where few rows have a new count or angle, and the input changes between these, they
    become speeds, means since the one before (`_repeats`).

    `speed_window_s` says over how long each speed is a mean; `speed_pulses_per_rev` that each is from the time between
    the last two pulses of a sensor, so many per turn of the output shaft; `speed_period_s` that each is what was
    counted since the row before over this fixed time, whenever that row came: it becomes the mean over the row.

    `input_limit`, in the numbers of its column, is what was applied at most, either way: a controller's output was cut
    off there after it was logged.

    `columns` names the columns of a log without names, separated by commas; `drop_first` rows are left out at the
    beginning of the log and of each segment; with `drop_spikes` speeds and angles that no motor has, those of which
    `check` tells, are no readings; with `drop_damaged` lines with another number of fields are left out, and those in
    which a stated column holds no number, or a time that does not fit in; with `decimal_comma` numbers are like 3,14.

    **Raises:** `RecordingError`.
    """
    if time is not None and period_s is not None:
        raise RecordingError("--time and --period both say when the rows were; state one of them")
    time = "t_s:s" if time is None and period_s is None else time
    step = known_step(step_V, step_at_s, step_until_s, input)
    input = INPUT if input is None and step is None else input
    stated = {"time": time, "input": input, "speed": speed, "angle": angle, "count": count, "pulses": pulses}
    stated |= {"wrap": None if wrap is None else str(wrap), "segment": segment, "supply": supply, "columns": columns}
    stated |= {"only": only}
    path = path if isinstance(path, Table) else path_of(path, "the path of a log")
    check_stated(drive, drop_first, **stated)
    check_choice("--input-acts", input_acts, get_args(Acts))
    shaft = Shaft(speed, angle, count, pulses, wrap)
    shaft.check()
    scale = Scale(positive(counts_per_rev, "--counts-per-rev"), positive(wheel_radius_m, "--wheel-radius"))
    supply_V, speed_window_s = positive(supply_V, "--supply"), window_of(speed_window_s)
    period_s, fixed_s = _period(period_s, "--period"), _period(speed_period_s, "--speed-period")
    limit = positive(input_limit, "--input-limit")
    begin_s, end_s = positive(begin_s, "--begin"), positive(end_s, "--end")
    gap_s, pulses_per_rev = positive(gap_s, "--gap"), positive(speed_pulses_per_rev, "--speed-pulses")
    _check_window(
        speed, {"--speed-window": speed_window_s, "--speed-pulses": pulses_per_rev, "--speed-period": fixed_s}
    )
    _check_beside(
        step=step is not None,
        moved=input_acts == "before" or input_holds,
        stamped=time is not None,
        gaps=gap_s is not None,
        counted=speed is None and angle is None,
        drop_spikes=drop_spikes,
        drop_damaged=drop_damaged,
        supply_stated=supply_V is not None or supply is not None,
        supply_unknown=supply_unknown,
    )
    table = path if isinstance(path, Table) else opened(path, columns, drop_first, decimal_comma, stated, drop_damaged)
    names = list(table.cells)
    with about_log(table.source):
        table = of_one(table, only)
        if drop_damaged and time is not None and segment is None:
            table = in_order(table, split_time(time, names)[0])
        if begin_s is not None or end_s is not None:
            table = between_moments(table, _since_first(table, time, period_s, segment), begin_s, end_s)
        table, bounds, labels, stamps = _in_time(table, time, period_s or 1.0, segment, gap_s, drop_first)
        if step is not None:
            table, input = step.as_column(table, stamps[0], bounds)
        stated_input = dataclasses.replace(split_input(input or INPUT, list(table.cells)), limit=limit)
        measured = None if supply is None else _supply(table, supply, names)
        nominal_V = nominal(stated_input, measured, supply_V, supply_unknown)
        log, bounds = _read_log(
            table, bounds, stamps, stated_input, shaft, scale, nominal_V, measured, input_acts == "before", input_holds
        )
    missing = len(table) - len(log.stamps[0])
    imported = _how(Path(table.source), input_acts, stated, period_s, gap_s, fixed_s)
    imported |= {} if step is None else step.stated
    imported |= {"input_holds": True} if input_holds else {}
    imported |= {} if limit is None else {"input_limit": limit}
    imported |= {key: value for key, value in {"begin_s": begin_s, "end_s": end_s}.items() if value is not None}
    imported |= table.left_out | ({"missing_rows": missing} if missing else {})
    recording = assemble(
        log,
        bounds,
        [{} if label is None else {"label": label} for label in labels],
        ["other"] * len(labels),
        source=table.source,
        counts_per_rev=scale.counts_per_rev,
        supply_V=nominal_V,
        speed_window_s=speed_window_s,
        drive=drive,
        header={"imported": imported} | ({"supply_unknown": True} if supply_unknown else {}),
        # Of those from pulses it is known which are new; what is counted in each row is.
        keep_repeats=pulses_per_rev is not None or fixed_s is not None,
    )
    recording = recording if fixed_s is None else over_rows(recording, fixed_s)
    recording = recording if pulses_per_rev is None else _of_pulses(recording, pulses_per_rev)
    # What was counted in a row that is missing is lost.
    lost = pulses is not None and (missing or table.damaged or any(map(lost_ticks, recording.segments)))
    recording = dataclasses.replace(recording, count_resets=True) if lost else recording
    recording = without_spikes(recording) if drop_spikes else recording
    return supplied(recording, scaled=supply_V is not None)


def _in_time(
    table: Table, time: str | None, period_s: float, segment: str | None, gap_s: float | None, drop_first: int
) -> tuple[Table, np.ndarray, list[str | None], tuple[np.ndarray, float]]:
    """As `_segments`; and when the rows were [s], by their stamps or one `period_s` after the other, with the step of
    the last printed digit."""
    clock, unit_s = ("", 1.0) if time is None else split_time(time, list(table.cells))
    gaps = _gaps(table, clock, np.inf if gap_s is None else gap_s / unit_s)
    table, bounds, labels = _segments(table, segment, drop_first, clock, gaps)
    if time is None:
        return table, bounds, labels, (np.arange(len(table)) * period_s, 0.0)
    stamps = table.since_first(clock) * unit_s, table.resolution(clock) * unit_s
    _check_time(table, stamps[0], bounds, clock, segment is None)
    return table, bounds, labels, stamps


def _since_first(table: Table, time: str | None, period_s: float | None, segment: str | None) -> np.ndarray:
    """(n,) how long after the first row each is [s]."""
    if time is None:
        return np.arange(len(table)) * (period_s or 1.0)
    clock, unit_s = split_time(time, list(table.cells))
    if segment == clock:
        raise RecordingError("--begin and --end are on one clock, and each segment starts its own; leave them out")
    return table.since_first(clock) * unit_s


def _check_beside(
    *,
    step: bool,
    moved: bool,
    stamped: bool,
    gaps: bool,
    counted: bool,
    drop_spikes: bool,
    drop_damaged: bool,
    supply_stated: bool,
    supply_unknown: bool,
) -> None:
    """**Raises:** `RecordingError` for what cannot be asked for beside the rest."""
    if step and moved:
        raise RecordingError(
            "--step says from which row on the input acts; leave --input-acts before and --input-holds out"
        )
    if gaps and not stamped:
        raise RecordingError("--gap is between two time stamps; name their column (--time)")
    if drop_spikes and counted:
        raise RecordingError(
            "a count that jumps as no motor does is refused; leave --drop-spikes out, or state --angle COL:counts"
        )
    if drop_damaged and not stamped:
        raise RecordingError(
            "how many rows a damaged line was is known where each row has its time; leave --drop-damaged out, or "
            "state --time"
        )
    if supply_unknown and supply_stated:
        raise RecordingError("the supply is stated, so it is not unknown; leave --supply-unknown out")


def _of_pulses(recording: Recording, pulses_per_rev: float) -> Recording:
    """`recording`, whose speeds are from the time between two pulses."""
    usual_s = usual_window_s(recording.segments, pulses_per_rev)
    if usual_s is None:
        raise RecordingError(f"{recording.source}: no speed ever changes, so no pulse is seen; check --speed")
    return dataclasses.replace(recording, speed_pulses_per_rev=pulses_per_rev, speed_window_s=usual_s)


def _check_window(speed: str | None, stated: Mapping[str, float | None]) -> None:
    """**Raises:** `RecordingError` where two options say over how long speeds are, or one does so of none."""
    given = [flag for flag, value in stated.items() if value is not None]
    if len(given) > 1:
        raise RecordingError(f"{given[1]} says over how long each speed is; leave {given[0]} out")
    if speed is None and given and given != ["--speed-window"]:
        raise RecordingError(
            f"{given[0]} is of a speed, and no column of speeds is named; leave it out, or state --speed"
        )


def _period(value: float | int | None, flag: str) -> float | None:
    period_s, (least, most) = positive(value, flag), RANGES["period_s"]
    if period_s is not None and not least <= period_s <= most:
        raise RecordingError(f"{flag} is {period_s:g}; rows are {least:g} to {most:g} s apart")
    return period_s


def check_stated(drive: Any, drop_first: Any, **texts: Any) -> None:
    """**Raises:** `JaxmotorError` for what was stated of a log and cannot be; `texts` are columns, or not stated."""
    for name, text in texts.items():
        if text is not None:
            check_text(f"--{'supply-column' if name == 'supply' else name}", text)
    if drive is not None:
        check_choice("--drive", drive, get_args(Drive))
    check_whole("--drop-first", drop_first)


def column_names(path: str | os.PathLike[str]) -> tuple[str, ...]:
    """Of the log at `path`, as they are to be stated.

    **Raises:** `RecordingError` where they cannot be read, or there are none.
    """
    return tuple(opened(path_of(path, "the path of a log"), None, 0, False, {}).cells)


def opened(
    path: Path,
    columns: str | None,
    drop_first: int,
    decimal_comma: bool,
    stated: Mapping[str, str | None],
    drop_damaged: bool = False,
) -> Table:
    """The log at `path`, a CSV or a file of MATLAB, which has the columns that are `stated`.

    **Raises:** `RecordingError`.
    """
    names = [one for key, one in stated.items() if one is not None and key not in ("wrap", "columns", "only")]
    if not is_matlab(path):
        read = functools.partial(
            read_table, path, columns=columns, drop=drop_first, decimal_comma=decimal_comma, stated=names
        )
        numbers = [one for key, one in stated.items() if one in names and key != "segment"]
        return whole_table(lambda drop: read(drop_damaged=drop), numbers, stated.get("time"), drop_damaged)
    if columns is not None or decimal_comma or drop_damaged:
        raise RecordingError(
            f"{path}: the variables have names and numbers; leave --columns, --decimal-comma and --drop-damaged out"
        )
    return read_matlab(path, drop=drop_first, stated=names)


def nominal(stated: Input, measured: np.ndarray | None, supply_V: float | None, unknown: bool) -> float | None:
    """The supply [V] of which duties are shares: stated, or else the first that was `measured`."""
    if unknown and stated.full_scale is None:
        raise RecordingError("the input is in volts, so no supply is asked for; leave --supply-unknown out")
    if unknown:
        return UNKNOWN_V
    return supply_V if supply_V is not None or measured is None else float(measured[np.isfinite(measured)][0])


def _how(
    path: Path,
    input_acts: str,
    stated: dict[str, str | None],
    period_s: float | None,
    gap_s: float | None,
    fixed_s: float | None,
) -> dict[str, Any]:
    """The log and how it was read, for the header: only what was stated."""
    acts: dict[str, Any] = {} if input_acts == "after" else {"input_acts": input_acts}
    acts |= {} if period_s is None else {"period_s": period_s}
    acts |= {} if gap_s is None else {"gap_s": gap_s}
    acts |= {} if fixed_s is None else {"speed_period_s": fixed_s}
    return {"log": path.name} | acts | {key: value for key, value in stated.items() if value is not None}


def window_of(value: float | int | None) -> float | None:
    if value is not None and not (is_number(value) and 0 <= value < np.inf):
        raise RecordingError(f"--speed-window is {shown(value)}; give seconds, 0 for an instantaneous speed")
    return None if value is None else float(value)


def _supply(table: Table, stated: str, names: list[str]) -> np.ndarray:
    """(n,) measured supply [V], NaN where it was not."""
    column, unit = split_unit(stated, names, "the supply")
    factor, volts = split_factor(unit)
    if volts not in VOLTS:
        raise RecordingError(f"the supply's unit {unit!r} is not known; it is V or mV")
    values = table.sparse(column) * factor * VOLTS[volts]
    if not np.isfinite(values).any():
        raise RecordingError(f"column {column!r} never holds a supply; leave --supply-column out")
    if (values <= 0).any():
        row = int(np.argmax(values <= 0))
        raise table.fault(row, f"{column} is {values[row]:g} V, which drives no motor; correct it, or leave it empty")
    return values


def _read_log(
    table: Table,
    bounds: np.ndarray,
    stamps: tuple[np.ndarray, float],
    stated: Input,
    shaft: Shaft,
    scale: Scale,
    supply_V: float | None,
    measured: np.ndarray | None,
    acted_before: bool,
    holds: bool,
) -> tuple[Log, np.ndarray]:
    """The log without the rows whose input is missing, and without those at the ends of what is left whose shaft is;
    and where its segments begin and end."""
    no_input, no_shaft = table.missing(stated.column), table.missing(shaft.column(list(table.cells)))
    row = _rows_before(bounds) if acted_before else np.arange(len(table))
    row = _held(row, ~no_input, bounds, acted_before) if holds else row
    known, read = ~no_input[row], ~no_shaft
    whole = known & read
    if not whole.any():
        hint = "" if holds or no_input.all() or no_shaft.all() else HOLDS
        raise RecordingError(f"no row has both an input and a shaft; log both at the same moments{hint}")
    if not whole.all() and len(set(np.searchsorted(bounds, np.flatnonzero(whole), side="right"))) < len(bounds) - 1:
        raise RecordingError("a segment has no row with both an input and a shaft; leave it out of the log")
    given = input_of(table.only(~no_input), stated, supply_V, measured is not None)
    [(name, values)] = shaft.read(table.only(read), list(table.cells), scale).items()
    kept = between(known, read, np.isin(np.arange(len(table)), bounds))
    # A turn over several rows is not counted from row to row; and what a row without pulses counted is lost.
    is_lost = shaft.pulses or not (holds or are_far_apart(read[kept]))
    kept = whole if name == "count" and is_lost else kept
    column = np.zeros(len(table), values.dtype)
    column[read] = values
    log = Log(
        (stamps[0][kept], stamps[1]),
        given.at((np.cumsum(~no_input) - 1)[row][kept]),
        {name: column[kept]},
        None if measured is None else measured[kept],
        None if kept.all() else np.concatenate([[False], np.diff(np.flatnonzero(kept)) > 1]),
        None if read[kept].all() else no_shaft[kept],
        holds,
    )
    return log, np.concatenate([[0], np.cumsum(kept)])[bounds]


def _held(row: np.ndarray, given: np.ndarray, bounds: np.ndarray, acted_before: bool) -> np.ndarray:
    """(n,) of each row the one whose input acts there, where that is `given` in some alone: the last up to `row`, or,
    where inputs are those that acted until their row, the next from it on. `row` itself where its segment has none."""
    rows, number = np.flatnonzero(given), len(given)
    place = np.searchsorted(rows, row, "left") if acted_before else np.searchsorted(rows, row, "right") - 1
    of = np.concatenate([rows, [number]])[place]
    segment = np.repeat(np.arange(len(bounds) - 1), np.diff(bounds))
    same = (of < number) & (segment[np.minimum(of, number - 1)] == segment)
    return np.where(same, of, row)


def _rows_before(bounds: np.ndarray) -> np.ndarray:
    """(n,) the row whose input acts from each row on, where inputs are those that acted until their row."""
    row = np.arange(1, bounds[-1] + 1)
    row[bounds[1:] - 1] -= 1
    return row


def input_of(table: Table, stated: Input, supply_V: float | int | None, as_duty: bool = False) -> Inputs:
    """Volts, and whole duties where they are.

    With `as_duty` fractions of the supply become whole duties of a larger full scale.
    """
    values = table.numbers(stated.column)
    if stated.limit is not None:
        values = np.clip(values, stated.zero - stated.limit, stated.zero + stated.limit)
    if stated.full_scale is None:
        return Inputs(values * stated.volts_per_unit)
    if supply_V is None:
        raise RecordingError(
            "duty and percent need the supply voltage to become volts (--supply); where nobody knows it, "
            "--supply-unknown"
        )
    beyond = np.abs(values - stated.zero) > abs(stated.full_scale)
    if beyond.any():
        row = int(np.argmax(beyond))
        scale = f"{abs(stated.full_scale):g}{f' around {stated.zero:g}' if stated.zero else ''}"
        raise table.fault(
            row,
            f"{stated.column} is {values[row]:g}, beyond the full scale of {scale}; state another, or of "
            "a log of rows what was applied at most (--input-limit)",
        )
    # Where the value of the supply is below that of no voltage, duties are counted downward.
    sign, full = (1 if stated.full_scale > 0 else -1), abs(stated.full_scale)
    values = sign * (values - stated.zero)
    limit = math.inf if stated.limit is None else stated.limit
    is_whole = stated.zero.is_integer() and (limit == math.inf or limit.is_integer())
    duty = table.integers(stated.column) if is_whole else None
    if duty is not None:
        most = int(min(limit, full))
        duty = np.clip(sign * (duty - int(stated.zero)), -most, most)
    elif as_duty:
        finer = 10.0 ** min(max(round(-np.log10(table.resolution(stated.column))), 0), FINEST_DUTY)
        duty, full = np.rint(values * finer).astype(np.int64), full * finer
    if duty is None:
        return Inputs(values / full * supply_V)
    return Inputs(duty / full * supply_V, duty, full)


def _segments(
    table: Table, segment: str | None, drop: int, clock: str, gaps: np.ndarray
) -> tuple[Table, np.ndarray, list[str | None]]:
    """The table, (segments + 1,) rows at which segments begin, and the end; the label of each. In the column `clock`
    the time runs back where one begins; so it does at rows with `gaps` before them.

    Of all segments but the first, whose first rows were not even read, `drop` rows are left out.
    """
    labels = _labels(table, segment, clock)
    starts = [0, *(row for row in range(1, len(table)) if gaps[row] or labels[row] != labels[row - 1])]
    if len(starts) > MAX_LABELS:
        many = "--gap" if gaps.any() else repr(segment)
        raise RecordingError(f"{many} begins {len(starts)} segments; it is no segment column, or split the log")
    if segment is not None and not gaps.any():
        check_apart(table, segment, starts)
    bounds = np.array([*starts, len(table)])
    kept = np.ones(len(table), bool)
    for start, stop in itertools.pairwise(bounds[1:].tolist()):
        if drop >= stop - start:
            raise table.fault(
                start, f"--drop-first {drop} leaves nothing of this segment's {stop - start} rows; lower it"
            )
        kept[start : start + drop] = False
    return table.only(kept), np.concatenate([[0], np.cumsum(kept)])[bounds], [labels[row] for row in starts]


def _gaps(table: Table, clock: str, longest: float) -> np.ndarray:
    """(n,) before which rows more than the `longest` time passes in the column `clock` [its unit]."""
    if longest == np.inf:
        return np.zeros(len(table), bool)
    return np.diff(table.since_first(clock), prepend=0.0) > longest


def _labels(table: Table, segment: str | None, clock: str) -> Sequence[str | None]:
    """Of the segment of each row."""
    if segment is None:
        return [None] * len(table)
    if segment not in table.cells:
        raise RecordingError(f"there is no column {segment!r}; the columns are {', '.join(map(repr, table.cells))}")
    if segment == clock:
        back = np.diff(table.numbers(clock), prepend=-np.inf) < 0
        return [str(number) for number in np.cumsum(back).tolist()]
    return [label.strip() for label in table.cells[segment]]


def _check_time(table: Table, time_s: np.ndarray, bounds: np.ndarray, clock: str, alone: bool) -> None:
    """**Raises:** `RecordingError` where the time in the column `clock` does not run on in a segment; `alone` says that
    no column tells segments apart."""
    step = np.diff(time_s)
    step[bounds[1:-1] - 1] = 1.0
    if (step <= 0).any():
        row = int(np.argmax(step <= 0)) + 1
        what = "stands still" if step[row - 1] == 0 else "runs backwards"
        apart = f"the column that tells the experiments apart (--segment; {clock!r} if each starts its own clock)"
        hint = f", or name {apart}" if alone else ""
        hint = ", or leave a stale first row out (--drop-first 1)" if row == 1 else hint
        if step[row - 1] == 0 and (step == 0).sum() > 1:
            hint = (
                "; where stamps are coarse and rows come evenly, state --period instead of --time; where motors take "
                "turns, read one of them (--only COL=VALUE)"
            )
        at = table.cells[clock][row].strip()
        raise table.fault(row, f"the time {what} at {clock} = {at}; correct or delete the row{hint}")
