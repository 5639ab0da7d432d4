"""Brings a log from elsewhere in: a CSV with time stamps, an input and a shaft, all units stated."""

import dataclasses
import os
from pathlib import Path
from typing import Literal, get_args

from jaxmotor._arguments import check_choice, path_of
from jaxmotor.recording._check import lost_ticks
from jaxmotor.recording._chosen_rows import of_one
from jaxmotor.recording._clock import Clock
from jaxmotor.recording._damaged import in_order
from jaxmotor.recording._fixed_time import over_rows
from jaxmotor.recording._known_step import known_step
from jaxmotor.recording._log import assemble
from jaxmotor.recording._log_input import measured_supply, nominal
from jaxmotor.recording._log_rows import read_log
from jaxmotor.recording._opened import opened
from jaxmotor.recording._own_words import in_own_words
from jaxmotor.recording._pulse_windows import usual_window_s
from jaxmotor.recording._recording import Recording, RecordingError
from jaxmotor.recording._shaft import Shaft
from jaxmotor.recording._stated import Acts, Drive, check_beside, check_stated, check_window, period_of, window_of
from jaxmotor.recording._supply import supplied
from jaxmotor.recording._table import Table
from jaxmotor.recording._text import about_log
from jaxmotor.recording._units import Scale, positive, split_input
from jaxmotor.recording._without_spikes import without_spikes

INPUT = "u_V:V"
"""What the input is taken to be where it is not stated."""


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
    period_s, fixed_s = period_of(period_s, "--period"), period_of(speed_period_s, "--speed-period")
    limit = positive(input_limit, "--input-limit")
    begin_s, end_s = positive(begin_s, "--begin"), positive(end_s, "--end")
    gap_s, pulses_per_rev = positive(gap_s, "--gap"), positive(speed_pulses_per_rev, "--speed-pulses")
    windows = {"--speed-window": speed_window_s, "--speed-pulses": pulses_per_rev, "--speed-period": fixed_s}
    check_window(speed, windows)
    beside = {"step": step, "before": input_acts == "before", "holds": input_holds, "gap": gap_s}
    beside |= {"spikes": drop_spikes, "damaged": drop_damaged, "supply_V": supply_V, "unknown": supply_unknown}
    check_beside(stated | beside)
    clock = Clock(time, period_s, segment, gap_s, drop_first)
    table = path if isinstance(path, Table) else opened(path, stated, drop_first, decimal_comma, drop_damaged)
    with about_log(table.source):
        table = of_one(table, only)
        if drop_damaged and segment is None:
            table = in_order(table, clock.column(table)[0])
        cut = clock.cut(clock.between(table, begin_s, end_s))
        table = cut.table
        if step is not None:
            driven, input = step.as_column(table, cut.stamps[0], cut.bounds)
            cut = cut._replace(table=driven)
        stated_input = dataclasses.replace(split_input(input or INPUT, cut.table.cells), limit=limit)
        measured = None if supply is None else measured_supply(table, supply)
        nominal_V = nominal(stated_input, measured, supply_V, supply_unknown)
        before = input_acts == "before"
        log, bounds = read_log(cut, stated_input, shaft, scale, nominal_V, measured, before, input_holds)
    missing = len(table) - len(log.stamps[0])
    how = {"input_acts": "before" if before else None, "period_s": period_s, "gap_s": gap_s, "speed_period_s": fixed_s}
    how |= stated | ({} if step is None else step.stated)
    how |= {"input_holds": True if input_holds else None, "input_limit": limit, "begin_s": begin_s, "end_s": end_s}
    how |= table.left_out | {"missing_rows": missing or None}
    imported = {"log": Path(table.source).name} | {key: value for key, value in how.items() if value is not None}
    recording = assemble(
        log,
        bounds,
        [{} if label is None else {"label": label} for label in cut.labels],
        ["other"] * len(cut.labels),
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


def _of_pulses(recording: Recording, pulses_per_rev: float) -> Recording:
    """`recording`, whose speeds are from the time between two pulses."""
    usual_s = usual_window_s(recording.segments, pulses_per_rev)
    if usual_s is None:
        raise RecordingError(f"{recording.source}: no speed ever changes, so no pulse is seen; check --speed")
    return dataclasses.replace(recording, speed_pulses_per_rev=pulses_per_rev, speed_window_s=usual_s)
