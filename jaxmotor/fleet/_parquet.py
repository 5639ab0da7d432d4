"""Recordings of many motors in a Parquet file: format 1's columns and `motor`, header keys as file metadata.

The metadata hold each header key under its own name, as JSON; `segment` is the list of the segments' tables. A motor's
rows stand together, segment by segment; it need not have rows of all segments. A file is cut by its row groups: a motor
belongs to the cut in which its first row stands, and is read on into the next groups if it goes on there.
"""

import itertools
import json
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from jaxmotor._errors import JaxmotorError
from jaxmotor._files import replacing
from jaxmotor.fleet._extra import needs
from jaxmotor.recording import Header, Recording, columns_of, from_columns, header_of, values_of

ROWS_PER_CUT = 250_000
"""About so many are one piece of work."""
ROWS_AT_ONCE = 131_072
"""That are read."""
FOREIGN_KEYS = ("pandas", "ARROW:schema", "geo")
"""Metadata that other programs leave."""


class Cut(NamedTuple):
    """Row groups `first` to before `last` of `file`."""

    file: str
    first: int
    last: int


def cuts_of(file: str) -> list[Cut]:
    """`file` in cuts of about `ROWS_PER_CUT` rows. A file that is damaged is one cut, whose reading says so."""
    parquet = needs("pyarrow.parquet")
    try:
        with parquet.ParquetFile(file) as opened:
            rows = [opened.metadata.row_group(index).num_rows for index in range(opened.metadata.num_row_groups)]
    except (OSError, ValueError):
        return [Cut(file, 0, 0)]
    cuts, first, held = [], 0, 0
    for index, number in enumerate(rows):
        held += number
        if held >= ROWS_PER_CUT or index == len(rows) - 1:
            cuts.append(Cut(file, first, index + 1))
            first, held = index + 1, 0
    return cuts or [Cut(file, 0, 0)]


def read_cut(cut: Cut) -> Iterator[tuple[str, str, Recording | str]]:
    """(motor, source, recording or sentence) of each motor that begins in `cut`; memory holds one motor at a time."""
    parquet = needs("pyarrow.parquet")
    name = Path(cut.file).stem
    try:
        with parquet.ParquetFile(cut.file) as opened:
            header = header_of(_header(opened.schema_arrow.metadata or {}), cut.file)
            if opened.metadata.num_rows == 0:
                yield name, cut.file, f"{cut.file}: there are no rows; record or export it again"
            for motor, columns in _motors(opened, cut):
                source = f"{cut.file}, motor {motor}"
                try:
                    yield motor, cut.file, _recording(header, columns, source, motor)
                except JaxmotorError as error:
                    yield motor, cut.file, str(error)
    except JaxmotorError as error:
        yield name, cut.file, str(error)
    except (OSError, ValueError) as error:
        reason = str(error).splitlines()[0] if str(error) else type(error).__name__
        yield name, cut.file, f"{cut.file}: cannot be read as Parquet ({reason}); it is damaged or another kind of file"


def write_parquet(recordings: Iterable[tuple[str, Recording]], path: Path, motors_per_group: int = 100) -> int:
    """Write (motor, recording) pairs to `path`, whole or not at all, and return their number.

    All share the header and the segments of the first.

    **Raises:** `JaxmotorError` where one does not, or the file cannot be written.
    """
    writer, number = None, 0
    header: dict[str, str] = {}
    names: list[str] = []
    group: list[Any] = []
    with replacing(path) as part:
        try:
            for motor, recording in recordings:
                header = header or _shared_header(recording)
                names = names or list(columns_of(recording.segments[0]))
                same = all(list(columns_of(segment)) == names for segment in recording.segments)
                if _shared_header(recording) != header or not same:
                    raise JaxmotorError(
                        f"{path}: motor {motor} has another header, or other columns; write it to a file of its own"
                    )
                group.append(_table(motor, recording, header))
                number += 1
                if len(group) == motors_per_group:
                    writer = _write_group(writer, part, group)
            if group:
                writer = _write_group(writer, part, group)
            if writer is None:
                raise JaxmotorError(f"{path}: there are no recordings to write")
        finally:
            if writer is not None:
                writer.close()
    return number


def _write_group(writer: Any, part: Path, group: list[Any]) -> Any:
    table = needs("pyarrow").concat_tables(group)
    if writer is None:
        writer = needs("pyarrow.parquet").ParquetWriter(part, table.schema, compression="zstd")
    writer.write_table(table, row_group_size=table.num_rows)
    group.clear()
    return writer


def _shared_header(recording: Recording) -> dict[str, str]:
    values = values_of(recording)
    return {key: json.dumps(value, default=str) for key, value in values.items() if key != "motor"}


def _table(motor: str, recording: Recording, header: Mapping[str, str]) -> Any:
    arrow = needs("pyarrow")
    parts = [
        columns_of(segment) | {"segment": np.full(len(segment), k)} for k, segment in enumerate(recording.segments)
    ]
    columns = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    length = len(columns["segment"])
    names = arrow.DictionaryArray.from_arrays(np.zeros(length, np.int32), [motor]).cast(arrow.string())
    return arrow.table({"motor": names, **columns}).replace_schema_metadata(dict(header))


def _header(metadata: Mapping[bytes, bytes]) -> dict[str, Any]:
    """Header keys and their values; what is not JSON is text."""
    values = {}
    for key, value in metadata.items():
        name, text = key.decode("utf-8", "replace"), value.decode("utf-8", "replace")
        if name in FOREIGN_KEYS:
            continue
        try:
            values[name] = json.loads(text)
        except (ValueError, RecursionError):
            values[name] = text
    return values


def _recording(header: Header, columns: dict[str, np.ndarray], source: str, motor: str) -> Recording:
    own = Header(source, [], {**header.values, "motor": motor})
    return from_columns(own, columns, source)


def _motors(opened: Any, cut: Cut) -> Iterator[tuple[str, dict[str, np.ndarray]]]:
    """Each motor's rows, of those that begin in the cut."""
    names = [name for name in opened.schema_arrow.names if name != "motor"]
    if "motor" not in opened.schema_arrow.names:
        raise JaxmotorError(f"{cut.file}: column 'motor' is missing; columns are {', '.join(names[:20])}")
    before = _last_motor(opened, cut.first - 1) if cut.first else None
    held: list[dict[str, np.ndarray]] = []
    motor = before
    for motor_of, rows, beyond in _runs(opened, cut, names):
        if motor_of != motor:
            if held and motor is not None:
                yield motor, _joined(held)
            if beyond:
                return
            held, motor = [], motor_of
            before = None
        if before is None:
            held.append(rows)
    if held and motor is not None:
        yield motor, _joined(held)


def _runs(opened: Any, cut: Cut, names: list[str]) -> Iterator[tuple[str, dict[str, np.ndarray], bool]]:
    """Runs of rows with one motor's name, and whether they stand beyond the cut."""
    groups = opened.metadata.num_row_groups
    for group in range(cut.first, groups):
        for batch in opened.iter_batches(ROWS_AT_ONCE, row_groups=[group], columns=["motor", *names]):
            motor = batch.column("motor")
            code = _codes(motor)
            bounds = [0, *(np.flatnonzero(code[1:] != code[:-1]) + 1).tolist(), len(code)]
            columns = {name: batch.column(name).to_numpy(zero_copy_only=False) for name in names}
            for begin, end in itertools.pairwise(bounds):
                if end > begin:
                    rows = {name: column[begin:end] for name, column in columns.items()}
                    yield _shown_name(motor[begin].as_py()), rows, group >= cut.last


def _codes(names: Any) -> np.ndarray:
    """Numbers, equal where the `names` are."""
    arrow = needs("pyarrow")
    if arrow.types.is_nested(names.type):
        names = arrow.array(map(str, names.to_pylist()))
    return names.dictionary_encode().indices.fill_null(-1).to_numpy()


def _shown_name(motor: Any) -> str:
    return "(without a name)" if motor is None or str(motor) == "" else str(motor)


def _last_motor(opened: Any, group: int) -> str:
    column = opened.read_row_group(group, columns=["motor"]).column("motor")
    return _shown_name(column[len(column) - 1].as_py())


def _joined(held: list[dict[str, np.ndarray]]) -> dict[str, np.ndarray]:
    return {name: np.concatenate([rows[name] for rows in held]) for name in held[0]}
