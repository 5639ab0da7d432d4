"""A foreign log as a table of cells, whatever kind of file it is."""

import functools
import os
from collections.abc import Mapping
from pathlib import Path

from jaxmotor._arguments import path_of
from jaxmotor.recording._damaged import whole_table
from jaxmotor.recording._matlab import is_matlab, read_matlab
from jaxmotor.recording._recording import RecordingError
from jaxmotor.recording._table import Table, read_table


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
