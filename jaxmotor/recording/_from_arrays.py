"""A recording from arrays or from a data frame, read as `import_log` reads a log of these columns."""

import contextlib
import dataclasses
import inspect
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from jaxmotor._arguments import check_text, is_number, taken
from jaxmotor._errors import JaxmotorError
from jaxmotor._sentences import one_of, sentence, shown
from jaxmotor.recording._foreign import import_log
from jaxmotor.recording._from_columns import header_of
from jaxmotor.recording._own_words import as_options, in_own_words, of_arguments
from jaxmotor.recording._recording import Recording, RecordingError
from jaxmotor.recording._stated import Acts, Drive
from jaxmotor.recording._table import Table
from jaxmotor.recording._units import positive

Column = Any
"""Numbers of one segment, or a list with those of each."""
COLUMNS = ("volts", "duty", "counts", "angle_rad", "speed_rad_s", "supply_V")


@in_own_words
def from_arrays(
    *,
    time_s: Column,
    volts: Column = None,
    duty: Column = None,
    counts: Column = None,
    angle_rad: Column = None,
    speed_rad_s: Column = None,
    supply_V: Column = None,
    supply_unknown: bool = False,
    duty_full_scale: float | int | None = None,
    counts_per_rev: float | int | None = None,
    speed_window_s: float | int | None = None,
    speed_pulses_per_rev: float | int | None = None,
    drive: Drive | None = None,
    input_acts: Acts = "after",
    input_holds: bool = False,
    kind: str | Sequence[str] = "other",
    at_rest: bool | Sequence[bool] | None = None,
    parameters: dict[str, Any] | Sequence[dict[str, Any]] | None = None,
    name: str = "arrays",
) -> Recording:
    """The recording whose rows are these arrays (n,), or lists of arrays, one for each segment.

    `volts`, or `duty` of `duty_full_scale` with `supply_V` [V] (a number, or measured in each row; or
    `supply_unknown`); and one of `counts` (with `counts_per_rev`), `angle_rad` and `speed_rad_s`, all at the output
    shaft. Even times become ticks, rows whose input or count is NaN are gaps, those without an angle or a speed are
    kept for their input (`import_log`). Where `input_holds`, a row whose input is NaN has the last one. Whether the
    motor was `at_rest` at first is taken from the rows where it is not stated.
    `kind`, `at_rest` and `parameters` (such as `frequency_Hz`) are those of all segments, or of each.

    **Raises:** `RecordingError`, as `import_log`; rows in messages are counted from 1 over all segments.
    """
    check_text("name", name)
    duty_full_scale = positive(duty_full_scale, "duty_full_scale")
    supply = float(supply_V) if is_number(supply_V) else None
    columns = {"time_s": time_s, "volts": volts, "duty": duty, "counts": counts, "angle_rad": angle_rad}
    table = _table(name, columns | {"speed_rad_s": speed_rad_s, "supply_V": supply_V if supply is None else None})
    has = table.cells.keys()
    _check_columns(set(has), duty_full_scale, name)
    stated = {"kind": kind, "parameters": parameters or {}} | ({} if at_rest is None else {"at_rest": at_rest})
    about = _segments(stated, int(table.cells["segment"][-1]) + 1, drive, name)
    with _in_own_words():
        recording = as_options(import_log)(
            table,
            time="time_s",
            input="volts:V" if "volts" in has else f"duty:duty:{duty_full_scale}",
            speed="speed_rad_s:rad/s" if "speed_rad_s" in has else None,
            angle="angle_rad:rad" if "angle_rad" in has else None,
            count="counts" if "counts" in has else None,
            segment="segment",
            supply="supply_V:V" if "supply_V" in has else None,
            supply_V=supply,
            supply_unknown=supply_unknown,
            counts_per_rev=counts_per_rev,
            speed_window_s=speed_window_s,
            speed_pulses_per_rev=speed_pulses_per_rev,
            drive=drive,
            input_acts=input_acts,
            input_holds=input_holds,
        )
    header = {key: value for key, value in recording.header.items() if key != "imported"}
    segments = [dataclasses.replace(one, **about[int(one.parameters["label"])]) for one in recording.segments]
    return dataclasses.replace(recording, segments=tuple(segments), header=header)


def from_dataframe(
    frame: Any, *, time_s: str | None = None, segment: str | None = None, name: str = "frame", **columns: Any
) -> Recording:
    """The recording in a data frame (pandas' or one like it), whose `columns` are named as the arrays of `from_arrays`.

    `volts="u", counts="n", counts_per_rev=617.4`: a text that is a column of `frame` stands for it, all else is passed
    on. Times [s], datetimes or time differences stand in the column `time_s`, or are the frame's index. Each change of
    the column `segment` begins a new segment.

    **Raises:** `RecordingError`, as `from_arrays`, and for a column that is not there.
    """
    names = [str(one) for one in getattr(frame, "columns", ())]
    if not names:
        raise RecordingError(f"{type(frame).__name__} is no data frame; give one with columns, or use from_arrays")
    for key in columns:
        if key not in inspect.signature(from_arrays).parameters:
            known = f"name a column as {', '.join(COLUMNS)}, or give what else from_arrays takes"
            raise RecordingError(f"{name}: {shown(key)} is not known; {known}")
    wanted = [key for key in COLUMNS if isinstance(columns.get(key), str)]
    for column in (time_s, segment, *(columns[key] for key in wanted)):
        if column is not None and column not in names:
            raise RecordingError(f"{name}: there is no column {shown(column)}; the columns are {one_of(names, column)}")
    time = np.asarray(frame.index if time_s is None else frame[time_s])
    if time.dtype.kind in "mM":
        time = (time - time[:1]) / np.timedelta64(1, "s")
    labels = np.zeros(len(time)) if segment is None else np.asarray(frame[segment])
    cuts = np.flatnonzero(labels[1:] != labels[:-1]) + 1
    given: dict[str, Any] = {key: np.split(np.asarray(frame[columns[key]]), cuts) for key in wanted}
    return from_arrays(time_s=np.split(time, cuts), name=name, **columns | given)


def _check_columns(given: set[str], duty_full_scale: float | int | None, name: str) -> None:
    if len(given & {"volts", "duty"}) != 1 or len(given & {"counts", "angle_rad", "speed_rad_s"}) != 1:
        wanted = "exactly one of volts and duty, and exactly one of counts, angle_rad and speed_rad_s"
        raise RecordingError(f"{name}: give {wanted}; given are {', '.join(sorted(given - {'segment'}))}")
    if "duty" in given and duty_full_scale is None:
        raise RecordingError(f"{name}: duty needs duty_full_scale, the duty that means the whole supply")


@contextlib.contextmanager
def _in_own_words() -> Iterator[None]:
    """Errors inside speak of arguments, not of options."""
    try:
        yield
    except JaxmotorError as error:
        text = of_arguments(
            str(error), angle="angle_rad", count="counts", speed="speed_rad_s", supply_column="supply_V"
        )
        raise RecordingError(text) from None


def _segments(stated: dict[str, Any], number: int, drive: Drive | None, name: str) -> list[dict[str, Any]]:
    """What is `stated` of all segments, or of each, by segment; as a header it can be."""
    each = {key: _each(key, value, number, name) for key, value in stated.items()}
    about = [dict(zip(each, own, strict=True)) for own in zip(*each.values(), strict=True)]
    for own in about:
        taken(own["parameters"], dict, "a dict of parameters")
    header = [own | {"start_s": 0.0} | own["parameters"] for own in about]
    for own in header:
        del own["parameters"]
    header_of({"drive": drive or "brake", "segment": header}, f"{name}, as a header")
    return about


def _table(name: str, columns: Mapping[str, Column]) -> Table:
    """The arrays as a log's cells, with a column `segment`."""
    pieces = {key: _pieces(value) for key, value in columns.items() if value is not None or key == "time_s"}
    sizes = {key: [piece.shape for piece in its] for key, its in pieces.items()}
    for key, shapes in sizes.items():
        if any(piece.dtype.kind not in "iuf" for piece in pieces[key]):
            raise RecordingError(f"{name}: {key} holds {pieces[key][0].dtype}, not numbers; give floats or integers")
        if wrong := [shape for shape in shapes if len(shape) != 1 or 0 in shape]:
            has = "no rows" if 0 in wrong[0] else f"{len(wrong[0])} dimensions" if wrong[0] else "one number only"
            raise RecordingError(f"{name}: {key} has {has}; give arrays (n,) of one length")
        if shapes != sizes["time_s"]:
            given, time = (
                sentence(", ".join(str(shape[0]) for shape in one if shape), 60) for one in (shapes, sizes["time_s"])
            )
            raise RecordingError(f"{name}: {key} has {given} rows, time_s {time}; give arrays (n,) of one length")
    cells = {key: [cell for piece in its for cell in piece.astype(str).tolist()] for key, its in pieces.items()}
    cells["segment"] = [str(k) for k, piece in enumerate(pieces["time_s"]) for _ in piece]
    return Table(name, range(1, len(cells["segment"]) + 1), cells, "row")


def _pieces(value: Column) -> list[np.ndarray]:
    try:
        several = isinstance(value, list | tuple) and len(value) > 0 and np.ndim(value[0]) > 0
        return [np.asarray(piece) for piece in (value if several else [value])]
    except ValueError:  # rows of different lengths
        return [np.zeros(0, object)]


def _each(key: str, stated: Any, number: int, name: str) -> list[Any]:
    """What is `stated` of all segments, or of each, for each of `number` segments."""
    values = list(stated) if isinstance(stated, list | tuple | np.ndarray) else [stated] * number
    if len(values) != number:
        raise RecordingError(f"{name}: {key} is a list of {len(values)} for {number} segments; give one for each")
    return values
