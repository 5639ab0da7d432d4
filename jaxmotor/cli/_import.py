"""`jaxmotor import`: a log from elsewhere becomes a recording."""

import inspect
from pathlib import Path
from typing import Annotated, Any, Literal

import typer

from jaxmotor.cli._folder import check_free

CURVE = {
    *("input", "speed", "period_s", "supply_V", "supply_unknown", "counts_per_rev", "speed_window_s"),
    *("drive", "only", "columns", "drop_first", "decimal_comma"),
}
"""What may be stated of a steady-state curve."""
OWN = ("log", "output", "wheel_radius_m", "hold_s", "source", "units", "motor", "force")
"""What is stated of any log, or of the kind that it is."""
Source = Literal["csv", "sysid"]
"""Programs whose logs are known."""


def import_command(
    log: Annotated[Path, typer.Argument(metavar="LOG", help="CSV, MATLAB file or SysId JSON to import.")],
    output: Annotated[Path, typer.Option("-o", "--output", help="Recording to write.")],
    time: Annotated[str | None, typer.Option(metavar="COL[:s|ms|us|ns]", help="Time stamps.")] = None,
    input: Annotated[
        str | None, typer.Option(metavar="COL:V|mV|duty:FULL[@ZERO]|percent", help="What was applied.")
    ] = None,
    step_V: Annotated[
        float | None,
        typer.Option("--step", metavar="V", help="No column has the input: so many volts, from the first row on."),
    ] = None,
    step_at_s: Annotated[
        float | None,
        typer.Option("--step-at", metavar="S", help="From so long after the first row on, and 0 V before."),
    ] = None,
    step_until_s: Annotated[
        float | None,
        typer.Option("--step-until", metavar="S", help="Until so long after the first row, and 0 V from there on."),
    ] = None,
    speed: Annotated[str | None, typer.Option(metavar="COL:UNIT", help="rad/s, rpm, m/s, ...; 3.92rad/s.")] = None,
    angle: Annotated[str | None, typer.Option(metavar="COL:UNIT", help="rad, deg, rev, counts, m, ...")] = None,
    count: Annotated[str | None, typer.Option(metavar="COL", help="Running encoder counter.")] = None,
    pulses: Annotated[str | None, typer.Option(metavar="COL", help="Counts since the row before.")] = None,
    wrap: Annotated[
        str | None, typer.Option(metavar="BITS|turn", help="The counter wraps at so many bits, the angle at a turn.")
    ] = None,
    segment: Annotated[
        str | None, typer.Option(metavar="COL", help="Each change begins a segment; of the time, each start anew.")
    ] = None,
    only: Annotated[
        str | None, typer.Option(metavar="COL=VALUE", help="Rows that have it there: of motors by turns, one.")
    ] = None,
    gap_s: Annotated[
        float | None, typer.Option("--gap", metavar="S", help="More than that between two rows begins a segment, too.")
    ] = None,
    begin_s: Annotated[
        float | None, typer.Option("--begin", metavar="S", help="Rows from so long after the first one on, no others.")
    ] = None,
    end_s: Annotated[
        float | None, typer.Option("--end", metavar="S", help="Rows up to so long after the first one, no others.")
    ] = None,
    supply_V: Annotated[
        float | None, typer.Option("--supply", metavar="V", help="Supply, for duty and percent.")
    ] = None,
    supply: Annotated[
        str | None, typer.Option("--supply-column", metavar="COL:V|mV", help="Measured supply; cells may be empty.")
    ] = None,
    supply_unknown: Annotated[
        bool, typer.Option("--supply-unknown", help="Nobody knows it: volts become shares of it.")
    ] = False,
    counts_per_rev: Annotated[float | None, typer.Option(metavar="N", help="Per turn of the output shaft.")] = None,
    speed_window_s: Annotated[
        float | None, typer.Option("--speed-window", metavar="S", help="Each speed is the mean over it.")
    ] = None,
    speed_pulses_per_rev: Annotated[
        float | None,
        typer.Option("--speed-pulses", metavar="N", help="Speeds are from the time between pulses, N per turn."),
    ] = None,
    speed_period_s: Annotated[
        float | None,
        typer.Option(
            "--speed-period", metavar="S", help="Speeds are counts since the row before, over this fixed time."
        ),
    ] = None,
    wheel_radius_m: Annotated[float | None, typer.Option("--wheel-radius", metavar="M", help="For lengths.")] = None,
    drive: Annotated[Literal["brake", "coast"] | None, typer.Option(help="The bridge between pulses.")] = None,
    input_acts: Annotated[
        Literal["after", "before"],
        typer.Option(help="A row's input is applied from it on (after), or was until it (before)."),
    ] = "after",
    input_holds: Annotated[
        bool, typer.Option("--input-holds", help="An empty input: the last one acts until the next.")
    ] = False,
    input_limit: Annotated[
        float | None,
        typer.Option(metavar="N", help="Larger inputs were cut off at N, in the column's numbers, before they acted."),
    ] = None,
    columns: Annotated[
        str | None, typer.Option(metavar="NAME,NAME,...", help="Of a log without column names, all of them.")
    ] = None,
    drop_first: Annotated[
        int, typer.Option(metavar="N", min=0, help="Leave out N rows at the beginning of the log and each segment.")
    ] = 0,
    drop_spikes: Annotated[
        bool,
        typer.Option("--drop-spikes", help="Speeds and angles that no motor has, for a row or few, are no readings."),
    ] = False,
    drop_damaged: Annotated[
        bool, typer.Option("--drop-damaged", help="Lines with other fields, or no numbers, are left out.")
    ] = False,
    decimal_comma: Annotated[bool, typer.Option("--decimal-comma", help="Numbers are like 3,14.")] = False,
    hold_s: Annotated[
        float | None,
        typer.Option("--steady", metavar="S", help="Rows are steady states, each taken to last S seconds."),
    ] = None,
    period_s: Annotated[
        float | None,
        typer.Option("--period", metavar="S", help="Of rows, where no column has the time; of the ticks of --steady."),
    ] = None,
    source: Annotated[Source, typer.Option("--from", help="The program that wrote the log.")] = "csv",
    units: Annotated[str | None, typer.Option(help="sysid CSV: rotations, radians, degrees, meters, ...")] = None,
    motor: Annotated[str | None, typer.Option(help="sysid: which of several motors.")] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace an existing output.")] = False,
) -> None:
    """Turn a log of another program into a recording; units are stated, nothing is guessed."""
    # Options have the names of what `import_log` takes, and are passed on where they are given.
    stated = dict(locals())
    options = inspect.signature(import_command).parameters
    given = {key: value for key, value in stated.items() if key not in OWN and value != options[key].default}
    if wrap is not None:
        given["wrap"] = _wrap(wrap)
    _check_usage(stated, set(given))
    check_free(output, force)

    from jaxmotor.recording import as_options, import_log, import_steady, import_sysid, write

    if source == "sysid":
        recording = as_options(import_sysid)(log, units=units, motor=motor, wheel_radius_m=wheel_radius_m)
    elif hold_s is not None:
        recording = as_options(import_steady)(log, wheel_radius_m=wheel_radius_m, hold_s=hold_s, **given)
    else:
        recording = as_options(import_log)(log, wheel_radius_m=wheel_radius_m, **given)
    write(recording, output)
    typer.echo(_summary(recording, output))


def _check_usage(stated: dict[str, Any], given: set[str]) -> None:
    is_sysid = stated["source"] == "sysid"
    if stated["hold_s"] is not None:
        if stated["period_s"] is None:
            raise typer.BadParameter("--steady needs --period S, the period of its ticks")
        if is_sysid or not {"input", "speed"} <= given:
            raise typer.BadParameter("--steady needs --input COL:UNIT and --speed COL:UNIT")
        if beside := _flags(given - CURVE):
            raise typer.BadParameter(f"--steady takes --input and --speed, and no other column; leave {beside} out")
        return
    if is_sysid:
        if flags := _flags(given):
            raise typer.BadParameter(f"a SysId log states its columns itself; leave {flags} out")
        return
    if stated["units"] is not None or stated["motor"] is not None:
        raise typer.BadParameter("--units and --motor belong to --from sysid")
    if len(given & {"time", "period_s"}) != 1 or not given & {"input", "step_V"}:
        raise typer.BadParameter(
            "state the columns with --time COL[:s|ms|us] (or --period S, where no column has the time) and "
            f"--input COL:UNIT (or --step V, where none has the input){_columns_of(stated['log'])}"
        )
    if len(given & {"speed", "angle", "count", "pulses"}) != 1:
        raise typer.BadParameter(
            "state the shaft with exactly one of --speed COL:UNIT, --angle COL:UNIT, --count COL, --pulses COL"
            f"{_columns_of(stated['log'])}"
        )


def _columns_of(log: Path) -> str:
    """Which there are, for the end of a sentence; nothing where that cannot be read."""
    from jaxmotor._errors import JaxmotorError
    from jaxmotor._sentences import one_of, shown
    from jaxmotor.recording import column_names

    try:
        names = column_names(log)
    except JaxmotorError:
        return ""
    return f"; the log's columns are {one_of(map(shown, names))}"


def _flags(given: set[str]) -> str:
    """The options that were `given`, for a sentence."""
    known = {"supply": "--supply-column", "supply_V": "--supply", "step_V": "--step"}
    known |= {"speed_pulses_per_rev": "--speed-pulses"}
    return ", ".join(sorted(known.get(key, f"--{key.removesuffix('_s').replace('_', '-')}") for key in given))


def _wrap(text: str) -> int | str:
    if text == "turn":
        return text
    if not text.isdecimal() or len(text) > 3:
        raise typer.BadParameter("--wrap takes the width of the counter in bits, such as 16, or the word turn")
    return int(text)


def _summary(recording, output: Path) -> str:
    from jaxmotor.recording import lost_ticks, warn_imported

    segments = recording.segments
    rows = sum(map(len, segments))
    number = f"{len(segments)} segment{'s' if len(segments) > 1 else ''}"
    imported = recording.header.get("imported", {})
    above, missing = imported.get("lines_above", 0), imported.get("missing_rows", 0)
    below = "rows" if "columns" in imported else "column names"
    without = f"; {above} line{'s' if above > 1 else ''} above the {below} left out" if above else ""
    without += "; the last line is cut, and left out" if "cut_lines" in imported else ""
    are = "are gaps" if missing > 1 else "is a gap"
    damaged = imported.get("damaged_lines", 0)
    without += f"; {damaged} damaged line{'s' if damaged > 1 else ''} left out" if damaged else ""
    without += f"; {missing} row{'s' if missing > 1 else ''} without input or shaft {are}" if missing else ""
    every_s = recording.header.get("readings_every_s")
    if every_s is not None:
        kept = "rows that repeat one have none" if recording.measured == "speed" else "only these rows are kept"
        kept = "each is the mean speed since the last" if recording.speed_window_rows == 0 else kept
        without += f"; a new reading came about every {1e3 * every_s:.3g} ms, {kept}"
    without += "".join(f"; {sentence}" for sentence in warn_imported(recording))
    if recording.period_s is None:
        return f"{output}: {rows} rows in {number}, {recording.measured}; time stamps are uneven and kept{without}"
    lost = sum(map(lost_ticks, segments))
    paced = f"one per {recording.period_s:g} s, {lost} ticks lost"
    return f"{output}: {rows} rows in {number}, {recording.measured}, {paced}{without}"
